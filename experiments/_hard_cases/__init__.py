"""Hard cases of both packages, one registry for the experiment and the tests.

A file in this folder whose name does not begin with an underscore holds cases in a list ``CASES``
(see ``_case.cases_of``); nothing else has to be told of it.
"""

import importlib
import pkgutil

from _hard_cases._case import Case, Curves, Limit, Measured, Result, judge, named

__all__ = ["Case", "Curves", "Limit", "Measured", "Result", "judge", "named", "registry"]


def registry():
    """All cases, file by file."""
    found = []
    for module in pkgutil.iter_modules(__path__):
        if not module.name.startswith("_"):
            found.extend(importlib.import_module(f"{__name__}.{module.name}").CASES)
    return tuple(found)
