"""Processes that a program starts, waits for, and ends with itself."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.errors import InputError

#: What batch systems, process managers and closed terminals send.
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
#: Time in which a process that is told to end may save itself [s].
_ENDING = 10.0
#: Calls a function and prints what it returns.
_CHILD = """
import importlib, json, sys
folder, module, function, arch, threads, arguments = json.loads(sys.argv[1])
sys.path.insert(0, folder)
work = getattr(importlib.import_module(module), function)
from taichi_dem.kit import progress_bar, runtime
progress_bar.hide_bars()
runtime.start(arch, threads)
print(json.dumps(work(**arguments)))
"""

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


def call_in_process(
    work: Callable,
    *,
    arch: str = "",
    threads: int = 1,
    cache: str = "",
    title: str = "",
    **arguments: Any,
) -> Any:
    """Result of work(**arguments) in a new process, on this process's architecture by default."""
    file = Path(str(sys.modules[work.__module__].__file__)).absolute()
    settings: Any = runtime.settings()
    job = [str(file.parent), file.stem, work.__name__, arch or settings.arch, threads, arguments]
    environment = dict(os.environ)
    if cache:
        os.makedirs(cache, exist_ok=True)
        environment.update(TI_OFFLINE_CACHE="1", TI_OFFLINE_CACHE_FILE_PATH=cache)
    done = run([sys.executable, "-c", _CHILD, json.dumps(job)], env=environment)
    if done.returncode != 0:
        said = done.stderr.strip()[-300:]
        raise InputError(f"the run {title or f'of {work.__name__}'} ended with: {said}")
    # Taichi may have printed lines of its own before.
    return json.loads(done.stdout.splitlines()[-1])


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
