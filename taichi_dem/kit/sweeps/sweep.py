"""Run one function over the rows of a table: in processes of this machine or on a Dask cluster."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import claiming
from taichi_dem.kit.progress.progress import Listener, Progress
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.sweeps.cluster import check_client, run_on_cluster
from taichi_dem.kit.sweeps.dependencies import Dependencies
from taichi_dem.kit.sweeps.job import Job, Record, Work, checked_work, identity_of, jobs_of
from taichi_dem.kit.sweeps.journal import Journal
from taichi_dem.kit.sweeps.local import leave_unless_main, run_locally
from taichi_dem.kit.sweeps.rows import SEED, TableLike, checked_rows
from taichi_dem.kit.sweeps.table import SweepTable
from taichi_dem.kit.validation import AUTO, FileName, whole

#: File of the whole table in the folder of a sweep.
RESULTS = "results.csv"


@claiming()
def sweep(
    function: Work,
    table: TableLike,
    *,
    workers: int | None = None,
    client: Any = None,
    out: FileName | None = None,
    seed: int = 0,
    progress: Listener | str | None = AUTO,
) -> SweepTable:
    """Run a function on each row of a table, many rows at a time.

    Each worker is a process with Taichi on one CPU thread, which compiles a structure once and
    keeps it for further rows. The results are the same bits wherever and beside whatever a row ran.

    Parameters
    ----------
    function : callable
        Called with a row, a dict of column name to number or text; returns a dict of numbers and
        text. It must stand at the top of a file. ``row["seed"]`` is the seed of the row, a whole
        number below 2^31, unless the table has such a column.
    table : list of dict, dict, DataFrame or path
        A list of dicts with the same keys, a dict or DataFrame of columns, the name of a CSV file
        with a header, or what ``parameter_grid`` makes.
    workers : int, optional
        Number of processes on this machine, from 1 to 1024; by default one a core.
    client : distributed.Client, optional
        A ``dask.distributed.Client`` whose workers run the rows instead; each has one thread.
    out : path, optional
        Folder that keeps each finished row. The same call later runs only rows that are missing
        or changed, or for which the function changed, what it calls, names or closes over in the
        user's files, a file that it or the row names, or the version of the package.
    seed : int
        Seed from which those of the rows follow, a whole number from 0 to 2^63.
    progress : "auto", function or None
        "auto" for a bar on a terminal and in Jupyter, None, or a function of a ``Progress``.

    Returns
    -------
    SweepTable
        A row for each row of the table, in its order, with provenance; its attribute ``unseen``
        says of what a change is not noticed.

    Raises
    ------
    InputError
        For a bad argument, a folder of another sweep or without space, or a client that is lost:
        finished rows are kept in ``out``.

    Notes
    -----
    A row that fails has the sentence in the column ``error`` and does not stop the others. A row
    whose process dies is run again, three times in all; on a cluster as often as Dask's setting
    ``allowed-failures`` says. Ctrl-C keeps the rows that are finished.

    Examples
    --------
    >>> table = sweep(blast, parameter_grid(peak=[4e8, 5e8, 6e8]), out="results/peaks")
    ... # doctest: +SKIP
    """
    rows = checked_rows(table)
    jobs = jobs_of(function, rows, whole("seed", seed, 0, 2**63))
    count = _processes(workers, client)
    journal = Journal(out, identity_of(function))
    records = run_missing(function, jobs, journal, count=count, client=client, progress=progress)
    made = SweepTable(jobs, records, SEED in rows[0], Dependencies(function).unseen)
    if journal.folder:
        made.write_csv(os.path.join(journal.folder, RESULTS))
    return made


def run_missing(
    function: Work,
    jobs: Sequence[Job],
    journal: Journal,
    *,
    count: int,
    client: Any = None,
    progress: Listener | str | None = AUTO,
) -> list[Record]:
    """Records of jobs, of which those that the journal lacks are run; count: of processes."""
    leave_unless_main()
    name, records = checked_work(function), journal.read(jobs)
    missing = [*{job.digest: job for job in jobs if job.digest not in records}.values()]
    if missing:
        arch = _architecture()
        with (
            reporting(progress, "sweeping") as listen,
            contextlib.closing(
                run_locally(name, missing, count, arch)
                if client is None
                else run_on_cluster(function, missing, client, arch)
            ) as ended,
        ):
            _collect(ended, records, journal, _counter(listen, len(missing)))
    return [records[job.digest] for job in jobs]


def _collect(ended: Iterator[tuple[Job, Record]], records, journal, count):
    """Keep the records of jobs as they end. Raises InputError, which says what is kept."""
    done = 0
    try:
        for job, record in ended:
            done += 1
            records[job.digest] = record
            journal.write(job, record)
            count(done)
    except InputError as error:
        kept = f"; {journal.words()}" if done or journal.kept else ""
        raise InputError(f"{error}{kept}") from None


def _counter(listen: Listener | None, total: int) -> Callable[[int], None]:
    """Function that tells a listener how many jobs of a number are done."""
    started = time.perf_counter()

    def count(done):
        if listen is not None:
            words = f"{done} of {total} runs"
            listen(Progress(done / total, time.perf_counter() - started, words=words))

    count(0)
    return count


def _processes(workers, client):
    """Number of processes of this machine, 0 with a client; both checked."""
    if client is None:
        return runtime.usable_cores() if workers is None else whole("workers", workers, 1, 1024)
    if workers is not None:
        raise InputError(f"workers must be left out with a client, got {workers}")
    check_client(client)
    return 0


def _architecture():
    """Architecture that this process has chosen, the CPU where it has not started Taichi."""
    settings = runtime.settings()
    return settings.arch if settings else "cpu"
