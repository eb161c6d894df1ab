"""Run one function over the rows of a table by Dask: in processes of one machine or of several."""

import contextlib
import logging
import multiprocessing
import os
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.data_table import arrays_of
from taichi_dem.kit.errors import InputError, carrying
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.progress import Listener, Progress
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.sweeps.jobs import (
    Job,
    Journal,
    Record,
    Work,
    jobs_of,
    run_in_worker,
    table_of,
)
from taichi_dem.kit.sweeps.table import TableLike, checked_rows
from taichi_dem.kit.validation import AUTO, FileName, instance, whole

#: File of the whole table in the folder of a sweep.
RESULTS = "results.csv"
_GUARD = 'if __name__ == "__main__"'
#: Time without any worker after which none is expected any more [s].
_NO_WORKER = 60.0
#: Dask's on this machine: a row whose process is lost is run three times, and a worker whose kernel
#: keeps it from answering for long is not lost.
_SETTINGS = {
    "distributed.scheduler.allowed-failures": 2,
    "distributed.scheduler.worker-ttl": None,
    "distributed.comm.timeouts.connect": "1h",
}


def sweep(
    function: Work,
    table: TableLike,
    *,
    workers: int | None = None,
    client: object = None,
    out: FileName | None = None,
    seed: int = 0,
    version: str = "",
    progress: Listener | str | None = AUTO,
) -> Any:
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
    client : distributed.Client or str, optional
        A client, or the address, of a Dask scheduler whose workers run the rows instead.
    out : path, optional
        Folder that keeps each finished row. The same call later runs only rows that are missing,
        or whose values, function's file, package version or ``version`` have changed.
    seed : int
        Seed from which those of the rows follow, a whole number from 0 to 2^63.
    version : str
        Version of whatever else the results depend on, such as files that the function reads.
    progress : "auto", function or None
        "auto" for a bar or lines, None, or a function of a ``Progress``.

    Returns
    -------
    pandas.DataFrame
        A row for each row of the table, in its order: the columns of the table, the results, NaN or
        "" where a row has none, ``error``, the sentence of a row that failed, and ``seed``,
        ``version``, ``commit``, ``machine``, ``seconds`` on the wall. All but the last three are
        the same bits wherever a row ran.

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
    count = runtime.usable_cores() if workers is None else whole("workers", workers, 1, 1024)
    rows, journal = checked_rows(table), Journal(out)
    jobs = jobs_of(function, rows, whole("seed", seed, 0, 2**63), instance("version", version, str))
    records = journal.read(jobs)
    missing = [*{job.digest: job for job in jobs if job.digest not in records}.values()]
    ended = _run(function, missing, client, count)
    for job, record in _watched(ended, len(missing), progress):
        records[job.digest] = record
        journal.write(job, record)
    frame = table_of(jobs, [records[job.digest] for job in jobs], list(rows[0]))
    if journal.folder:
        with carrying(frame):
            write_csv(os.path.join(journal.folder, RESULTS), arrays_of(frame))
    return frame


def _watched(ended, count, progress) -> Iterator[tuple[Job, Record]]:
    """Jobs and their records as they end, while progress is shown; closes what runs them."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        # A worker imports the main script, which starts the sweep again.
        sys.exit(1)
    started = time.perf_counter()

    def tell(listen, done):
        if listen is not None and count:
            words, seconds = f"{done} of {count} runs", time.perf_counter() - started
            listen(Progress(done / count, seconds, words=words))

    with reporting(progress if count else None, "sweeping") as listen, contextlib.closing(ended):
        tell(listen, 0)
        for done, pair in enumerate(ended, 1):
            yield pair
            tell(listen, done)


def _run(work, jobs: Sequence[Job], client, count) -> Iterator[tuple[Job, Record]]:
    """Jobs and their records by Dask; count: of processes here, where there is no client."""
    if not jobs:
        return
    try:
        import distributed
    except ImportError:
        raise InputError(
            'a sweep needs Dask: python -m pip install "taichi-dem[sweeps]", or distributed alone'
        ) from None
    hint = f" (the call of sweep must stand below {_GUARD})" if client is None else ""
    try:
        with contextlib.ExitStack() as opened:
            if client is None:
                client = opened.enter_context(_here(min(count, len(jobs))))
                work = work if work.__module__ != "__main__" else work.__qualname__
            elif isinstance(client, str):
                client = opened.enter_context(distributed.Client(client))
            yield from _records(work, jobs, client)
    except (OSError, RuntimeError) as error:
        raise InputError(f"workers of the sweep do not start or are lost{hint}: {error}") from None


@contextlib.contextmanager
def _here(count: int):
    """A client of processes on this machine; at the end they write the kernels that they made."""
    import dask
    import distributed

    options = {"threads_per_worker": 1, "memory_limit": 0, "dashboard_address": ":0"}
    with (
        dask.config.set(_SETTINGS),
        distributed.LocalCluster(count, silence_logs=logging.CRITICAL, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
        wait = [
            client.submit(runtime.stop, workers=[worker], pure=False)
            for worker in client.nthreads()
        ]
        with contextlib.suppress(TimeoutError):
            distributed.wait(wait, timeout=_NO_WORKER)


def _records(work, jobs: Iterable[Job], client) -> Iterator[tuple[Job, Record]]:
    """Jobs and their records, at most one job a worker at a time."""
    # One job a worker: Dask blames each job that a dead worker had, also one that only waited.
    import distributed

    settings = runtime.settings()
    arch = settings.arch if settings else "cpu"
    active: dict[Any, Job] = {}
    waiting, ended = deque(jobs), distributed.as_completed()
    try:
        while waiting or active:
            client.wait_for_workers(1, timeout=_NO_WORKER)
            for _ in range(min(len(waiting), _worker_count(client) - len(active))):
                job = waiting.popleft()
                future = client.submit(run_in_worker, work, job.row, arch, pure=False)
                active[future] = job
                ended.add(future)
            for future in ended.next_batch():
                yield active.pop(future), _record_of(future)
    finally:
        client.cancel([*active])


def _worker_count(client):
    threads = client.nthreads().values()
    if any(count != 1 for count in threads):
        raise InputError(
            "workers of the client must have one thread each, as Taichi runs on one alone, got "
            f"{max(threads)}: start them with threads_per_worker=1, or --nthreads 1"
        )
    return len(threads)


def _record_of(future) -> Record:
    import distributed

    try:
        return future.result()
    except distributed.KilledWorker as error:
        # Dask allows a number of failures, 3 unless it is told otherwise.
        return Record({}, f"its process was lost {error.allowed_failures + 1} times", final=False)
    except (ImportError, AttributeError) as error:
        raise InputError(f"workers cannot import the function: {error}") from None
