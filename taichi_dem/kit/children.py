"""Processes that a program starts, waits for, and ends with itself."""

import contextlib
import signal
import subprocess
import threading
from collections.abc import Iterator, Sequence
from typing import Any

#: What batch systems, process managers and closed terminals send.
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
#: Time in which a process that is told to end may save itself [s].
_ENDING = 10.0

_running: set[subprocess.Popen] = set()
_told = threading.Event()


class Terminated(BaseException):
    """A signal has told the program to end."""

    @property
    def number(self) -> int:
        """Of the signal."""
        return int(self.args[0])


def run(line: Sequence[str], **options: Any) -> "subprocess.CompletedProcess[str]":
    """Run a program to its end and return what it said, as text."""
    if _told.is_set():
        raise Terminated(signal.SIGTERM)
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(line, **pipes, **options) as process:
        _running.add(process)
        try:
            said, errors = process.communicate()
        except BaseException:
            _end(process)
            raise
        finally:
            _running.discard(process)
    return subprocess.CompletedProcess(line, process.returncode, said, errors)


def _end(process):
    process.terminate()
    try:
        process.wait(_ENDING)
    except subprocess.TimeoutExpired:
        process.kill()


@contextlib.contextmanager
def ending_children() -> Iterator[None]:
    """In its block a signal to end reaches the processes of ``run``, and raises Terminated here."""
    # Python delivers signals to the main thread only; ignored ones, as SIGHUP under nohup, stay so.
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in _SIGNALS:
            if signal.getsignal(number) == signal.SIG_DFL:
                before[number] = signal.signal(number, _pass_on)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if before:
            _told.clear()


def _pass_on(number, _):
    # Other threads may be waiting for processes, and about to start the next.
    _told.set()
    for process in tuple(_running):
        process.terminate()
    raise Terminated(number)
