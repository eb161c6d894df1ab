"""Jobs of a sweep: a row, its seed and its digest; what running it leaves; the finished ones."""

import contextlib
import hashlib
import json
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from taichi_dem.kit import runtime
from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.progress_bar import hide_bars
from taichi_dem.kit.provenance import commit, machine
from taichi_dem.kit.sweeps.table import ADDED, Row, Value, plain_value
from taichi_dem.kit.validation import FileName, shown
from taichi_dem.kit.version import __version__

#: What is run: a row in, numbers and text by name out.
Work = Callable[[Row], Mapping[str, Any]]
#: Column of the seeds of rows.
SEED = "seed"


class Record(NamedTuple):
    """What is kept of a job; final: whether another run would end alike."""

    values: dict[str, Value]
    error: str = ""
    final: bool = True
    seconds: float = 0.0
    version: str = __version__
    commit: str = ""
    machine: str = ""


class Job(NamedTuple):
    """row: with its seed. digest: of the row and of what its result depends on."""

    row: Row
    digest: str


def identity_of(work: object) -> str:
    """Name of a function as file:name; InputError unless other processes can import it."""
    module, name = (str(getattr(work, key, "")) for key in ("__module__", "__qualname__"))
    loaded = sys.modules.get(module)
    file = getattr(loaded, "__file__", None)
    if getattr(loaded, name, None) is not work or not file or not os.path.isfile(file):
        raise InputError(
            "function must be defined at the top of a file, where other processes can import it, "
            f"got {name or shown(work)}"
        )
    if module == "__main__":
        module = os.path.splitext(os.path.basename(file))[0]
    return f"{module}:{name}"


def jobs_of(work: object, rows: Sequence[Row], seed: int, version: str = "") -> list[Job]:
    """A job for each row; one without a seed gets it from the sweep's and its number."""
    file: Any = sys.modules[work.__module__].__file__
    with open(file, encoding="utf-8") as source:
        depends = [identity_of(work), source.read(), __version__, version]
    seeded = [{SEED: _seed_of(seed, number), **row} for number, row in enumerate(rows)]
    return [Job(row, _digest([*depends, row])) for row in seeded]


def _seed_of(seed, number):
    """Seed of row ``number`` of a sweep, a whole number below 2^31."""
    return int.from_bytes(hashlib.sha256(f"{seed} {number}".encode()).digest()[:4], "big") >> 1


def _digest(content):
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]


def run_job(work: Work, row: Row) -> Record:
    """Run one job; an error of its function is part of the record."""
    started = time.perf_counter()
    values, error, final = {}, "", True
    try:
        values = _checked_values(work(dict(row)), row)
    except (InputError, SimulationDiverged) as failure:
        error = " ".join(str(failure).split())
    except (Exception, SystemExit) as failure:
        # SystemExit of a program's parser would end the process, and the row with it.
        last, final = traceback.format_exception_only(failure)[-1], False
        error = " ".join(last.split())
    seconds = time.perf_counter() - started
    return Record(values, error, final, seconds, commit=commit(), machine=machine())


def run_in_worker(work: Work | str, row: Row, arch: str) -> Record:
    """Run one job with Taichi started on one CPU thread; work: or its name in the main script."""
    function: Work = getattr(sys.modules["__main__"], work) if isinstance(work, str) else work
    settings = runtime.settings()
    if settings and settings.threads != 1:
        raise InputError(
            f"Taichi must run on one thread in a worker of a sweep, got {settings.threads}: the "
            'file of the function must call runtime.start() below if __name__ == "__main__": only'
        )
    runtime.start(arch, threads=1)
    hide_bars()
    return run_job(function, row)


def table_of(jobs: Sequence[Job], records: Sequence[Record], given: Sequence[str]) -> Any:
    """DataFrame of jobs and what running them left; given: columns of the input."""
    columns: dict[str, list] = {name: [job.row[name] for job in jobs] for name in given}
    for name in dict.fromkeys(name for record in records for name in record.values):
        columns[name] = [record.values.get(name) for record in records]
    columns["error"] = [record.error for record in records]
    columns.setdefault(SEED, [job.row[SEED] for job in jobs])
    for name in ADDED[1:]:
        columns[name] = [getattr(record, name) for record in records]
    table = data_frame(columns)
    # A row that failed has no text.
    texts = [name for name in table if any(isinstance(value, str) for value in columns[name])]
    return table.fillna(dict.fromkeys(texts, ""))


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
    # NaN may be a result.
    return {
        name: float("nan") if value != value else plain_value(f"result {name}", value)
        for name, value in values.items()
    }


class Journal:
    """Records of finished jobs in a folder, a small file each: whole or not there.

    folder: path; None for a journal that forgets. InputError for a folder that refuses files.
    """

    def __init__(self, folder: FileName | None):
        self.folder = "" if folder is None else output_folder(folder)
        if self.folder:
            output_folder(os.path.join(self.folder, "jobs"))

    def read(self, jobs: Iterable[Job]) -> dict[str, Record]:
        """Records of those jobs that are finished, by digest; damaged files do not count."""
        records = {}
        for job in jobs if self.folder else ():
            with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
                with open(self._path(job), encoding="utf-8") as file:
                    records[job.digest] = Record(**json.load(file))
        return records

    def write(self, job: Job, record: Record) -> None:
        """Keep the record of a job that is final. Raises InputError where there is no space."""
        if self.folder and record.final:
            write_text(self._path(job), json.dumps(record._asdict()))

    def _path(self, job):
        return os.path.join(self.folder, "jobs", f"{job.digest}.json")
