"""Run a function with a time limit, for third-party code that may never return."""

import ctypes
import threading
from collections.abc import Callable
from typing import TypeVar, cast

from taichi_dem.kit.errors import InputError

#: Result of the function.
Value = TypeVar("Value")


class _Ended(Exception):
    """Raised in a thread that has run for too long."""


def run_with_timeout(seconds: float, call: Callable[[], Value], sentence: str) -> Value:
    """Return or raise as call() does; InputError with a sentence where it takes longer [s].

    It runs in a thread of its own, which is ended then: code that spins in Python ends at once,
    other code when it comes back to Python.
    """
    values: list[Value] = []
    errors: list[BaseException] = []

    def work():
        """Keep the result or exception; SystemExit too, as some readers end a program."""
        try:
            values.append(call())
        except (Exception, SystemExit) as error:
            errors.append(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    if thread.is_alive():
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(cast(int, thread.ident)), ctypes.py_object(_Ended)
        )
        raise InputError(sentence)
    if errors:
        raise errors[0]
    return values[0]
