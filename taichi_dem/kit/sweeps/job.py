"""One job of a sweep: a row, its seed and its digest; what running it leaves."""

import hashlib
import importlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

from taichi_dem.kit import runtime
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.progress.progress_bar import hide_bars
from taichi_dem.kit.provenance import commit, machine
from taichi_dem.kit.sweeps.dependencies import Dependencies, named_file
from taichi_dem.kit.sweeps.rows import ADDED, SEED, Row, Value, plain_text, plain_value
from taichi_dem.kit.validation import shown
from taichi_dem.kit.version import __version__

#: What is run: a row in, numbers and text by name out.
Work = Callable[[Row], Mapping[str, Any]]


class Record(NamedTuple):
    """What is kept of a job.

    values: results by name. error: a sentence where there are none. final: whether another run
    would end alike. seconds: on the wall [s]. version, commit, machine: of what computed it.
    """

    values: dict[str, Value]
    error: str
    final: bool
    seconds: float
    version: str
    commit: str
    machine: str


class Job(NamedTuple):
    """row: with its seed. digest: of the function and the row. files: named there, by digest."""

    row: Row
    digest: str
    files: dict[str, str]


def checked_work(work: Any) -> str:
    """Name of a function as module:name; InputError unless other processes can import it."""
    if not callable(work):
        raise InputError(f"function must be a function of a row, got {shown(work)}")
    module, name = (getattr(work, key, "") for key in ("__module__", "__qualname__"))
    try:
        found = attrgetter(name)(sys.modules[module])
    except (AttributeError, KeyError, TypeError):
        found = None
    if found is not work or (module == "__main__" and not _main_file()):
        raise InputError(
            "function must be defined at the top of a file, where other processes can import it, "
            f"got {name or shown(work)}"
        )
    return f"{module}:{name}"


def imported_work(name: str) -> Work:
    """The function of a name by ``checked_work``."""
    module, _, path = name.partition(":")
    return attrgetter(path)(importlib.import_module(module))


def identity_of(work: Any) -> str:
    """Name of a function that is the same wherever its script or module is run."""
    module, _, path = checked_work(work).partition(":")
    if module == "__main__":
        module = os.path.splitext(os.path.basename(_main_file()))[0]
    return f"{module}:{path}"


def jobs_of(work: Any, rows: Sequence[Row], seed: int, files: Iterable[str] = ()) -> list[Job]:
    """A job for each row; a row without a column seed gets one from the sweep's and its number.

    files: on which all jobs depend, beside those that the function and a row name.
    """
    seen = Dependencies(work)
    depends = [identity_of(work), seen.digest, __version__]
    known = dict(seen.files)
    for path in files:
        known.update(named_file(path, known))
    common, jobs = dict(known), []
    for number, given in enumerate(rows):
        row = {**given, SEED: given.get(SEED, seed_of(seed, number))}
        own: dict[str, str] = {}
        for value in row.values():
            own.update(named_file(value, known) if isinstance(value, str) else {})
        known.update(own)
        jobs.append(Job(row, _digest([*depends, row]), {**common, **own}))
    return jobs


def seed_of(seed: int, number: int) -> int:
    """Seed of row ``number`` of a sweep, a whole number below 2^31."""
    return int.from_bytes(hashlib.sha256(f"{seed} {number}".encode()).digest()[:4], "big") >> 1


class Leave(BaseException):
    """Raised where a process has been told to end: no end of its job."""


def run_job(work: Work, row: Row) -> Record:
    """Run one job; an error of its function is part of the record."""
    started = time.perf_counter()
    values, error, final = {}, "", True
    try:
        values = _checked_values(work(dict(row)), row)
    except (InputError, SimulationDiverged) as failure:
        error = _in_one_line(failure)
    except Exception as failure:
        error, final = _named(failure), False
    return _record(values, error, final, time.perf_counter() - started)


def run_in_worker(work: Work, row: Row, arch: str) -> Record:
    """Run one job with Taichi started on one CPU thread, by the thread of the worker."""
    settings = runtime.settings()
    if settings and settings.threads != 1:
        raise InputError(
            f"Taichi must run on one thread in a worker of a sweep, got {settings.threads}: the "
            'file of the function must call runtime.start() below if __name__ == "__main__": only'
        )
    runtime.start(arch, threads=1)
    runtime.check_thread("job of a sweep")
    hide_bars()
    try:
        return run_job(work, row)
    except (Leave, Interrupted):
        raise
    except BaseException as failure:
        # Such as SystemExit of a program's parser: it would end the process, and the row with it.
        return failed(_named(failure))


def failed(error: str) -> Record:
    """Record of a job that never came to its end."""
    return _record({}, error, False, 0.0)


def _record(values, error, final, seconds):
    return Record(values, error, final, seconds, __version__, commit(), machine())


def _checked_values(values, row):
    """Results as numbers and text; InputError where they are something else."""
    if not isinstance(values, Mapping):
        raise InputError(f"the function of a sweep must return a dict, got {shown(values)}")
    for name in values:
        if not isinstance(name, str) or name in row or name in ADDED:
            raise InputError(
                "a result must have a name that is no column of the table and none of "
                f"{', '.join(ADDED)}, got {shown(name)}"
            )
        plain_text("the name of a result", name)
    return {name: plain_value(f"result {name}", value) for name, value in values.items()}


def _named(failure):
    words = _in_one_line(failure)
    return f"{type(failure).__name__}: {words}" if words else type(failure).__name__


def _in_one_line(failure):
    """Words of an exception, as a table and a file can hold them: names of files may be no text."""
    try:
        words = " ".join(str(failure).replace("\0", r"\0").split())
    except Exception as broken:
        words = f"its text cannot be read: {type(broken).__name__}"
    return words.encode(errors="backslashreplace").decode()


def _main_file():
    return getattr(sys.modules["__main__"], "__file__", None) or ""


def _digest(content):
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
