"""Hard cases of both packages, one registry for the experiment and the tests.

A file in this folder whose name does not begin with an underscore holds cases in ``CASES``, a
``Cases``; nothing else has to be told of it.
"""

import importlib
import pkgutil


def registry():
    """All cases, file by file."""
    modules = (module.name for module in pkgutil.iter_modules(__path__))
    names = [f"{__name__}.{name}" for name in modules if not name.startswith("_")]
    return [case for name in names for case in importlib.import_module(name).CASES]
