"""Exceptions that a user of the package may meet."""

import copyreg
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


class Portable(BaseException):
    """Base of exceptions that other processes raise again, whatever their ``__init__`` asks for."""

    def __reduce__(self):
        return copyreg.__newobj__, (type(self), *self.args), vars(self)  # type: ignore[attr-defined]


class InputError(Portable, ValueError):
    """Invalid input; the sentence names the argument, its value and the allowed range."""


class SimulationDiverged(Portable, RuntimeError):
    """The run left the range of meaningful numbers.

    Attributes
    ----------
    result : Result or None
        Result of the run up to its last good sample; None where there is none.
    advice : mapping of float
        Numbers that the sentence advises, by name: step [s], the largest one of the method;
        max_speed [m/s] of the scene; contact_stiffness [N/m] or, of whole bodies, normal_stiffness
        [Pa/m] of the material; of the damper dt [s].
        A run that follows it may need further advice.
    """

    result: Any = None
    advice: Mapping[str, float] = MappingProxyType({})
