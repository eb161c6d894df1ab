"""Exceptions that a user of the package may meet."""

import contextlib
import copyreg
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any


class Portable(BaseException):
    """Base of exceptions that other processes raise again, whatever their ``__init__`` asks for."""

    result: Any = None

    def __reduce__(self):
        return copyreg.__newobj__, (type(self), *self.args), vars(self)  # type: ignore[attr-defined]


class InputError(Portable, ValueError):
    """Invalid input; the sentence names the argument, its value and the allowed range.

    Attributes
    ----------
    result : object or None
        Result of a run that could not write it, or a checkpoint, as on a full disk; else None.
    """


class SimulationDiverged(Portable, RuntimeError):
    """The run left the range of meaningful numbers.

    Attributes
    ----------
    result : Result or None
        Result of the run up to its last good sample; None where there is none.
    advice : mapping of float
        Numbers that the sentence advises, by name: step [s] of the method; max_speed [m/s] of the
        scene; contact_stiffness [N/m] or normal_stiffness [Pa/m]; of the damper dt [s].
    """

    advice: Mapping[str, float] = MappingProxyType({})


@contextlib.contextmanager
def carrying(result: object) -> Iterator[None]:
    """What is raised in its block carries a result, so that it is not lost with it."""
    try:
        yield
    except Exception as error:
        carry(error, result)
        raise


def carry(error: Exception, result: object) -> None:
    """Have an exception carry a result as ``result``, unless its class has another use for that."""
    with contextlib.suppress(AttributeError):
        error.result = result  # type: ignore[attr-defined]
