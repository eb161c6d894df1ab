"""Exceptions that a user of the package may meet."""


class InputError(ValueError):
    """What the user gave cannot be used; the sentence names it, its value and what is allowed."""


class SimulationDiverged(RuntimeError):
    """The run left the range in which its numbers mean anything."""
