"""Exceptions that a user of the package may meet."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


class InputError(ValueError):
    """Invalid input; the sentence names the argument, its value and the allowed range."""


class SimulationDiverged(RuntimeError):
    """The run left the range in which its numbers mean anything.

    Attributes
    ----------
    result : Result or None
        Result of the run up to its last good sample; None where there is none.
    advice : mapping of float
        What the sentence advises, numbers by name: step [s], the largest one of the method;
        max_speed [m/s] of the scene; contact_stiffness [N/m] of the material; of the damper dt [s].
        A run that follows it may have to be advised again.
    """

    result: Any = None
    advice: Mapping[str, float] = MappingProxyType({})
