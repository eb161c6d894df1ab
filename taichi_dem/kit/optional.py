"""Libraries that only some functions need: imported there, or refused in one sentence."""

import importlib
from typing import Any

from taichi_dem.kit.errors import InputError


def optional(module: str) -> Any:
    """Import a library that need not be installed.

    Parameters
    ----------
    module : str
        Name of the library, as it is imported.

    Returns
    -------
    module
        The library.

    Raises
    ------
    InputError
        Where it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(f"{module} must be installed for this: pip install {module}") from None
