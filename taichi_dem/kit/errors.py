"""Exceptions that a user of the package may meet."""


class InputError(ValueError):
    """Invalid input; the sentence names the argument, its value and the allowed range."""


class SimulationDiverged(RuntimeError):
    """The run left the range in which its numbers mean anything."""
