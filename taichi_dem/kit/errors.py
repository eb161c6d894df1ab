"""Exceptions that a user of the package may meet."""

from typing import Any


class InputError(ValueError):
    """Invalid input; the sentence names the argument, its value and the allowed range."""


class SimulationDiverged(RuntimeError):
    """The run left the range in which its numbers mean anything.

    result: of the run up to its last good sample, None where there is none.
    """

    result: Any = None
