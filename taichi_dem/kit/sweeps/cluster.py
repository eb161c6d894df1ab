"""Workers of a Dask cluster that run the jobs of a sweep."""

import time
from collections import Counter, deque
from collections.abc import Generator, Iterable
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.sweeps.job import Job, Record, Work, failed, run_in_worker
from taichi_dem.kit.validation import shown

#: Time without any worker after which none is expected any more, and between looks [s].
_NO_WORKER, _LOOK, _PAUSE = 60.0, 1.0, 0.01
#: Time in which a result comes, unless its worker was lost with it [s]; runs after such a loss.
_ANSWER, TRIES = 30.0, 3


def check_client(client: Any) -> None:
    """Raise InputError unless a client is connected to workers that can run Taichi."""
    if not isinstance(client, _dask().Client):
        raise InputError(f"client must be a dask.distributed.Client, got {shown(client)}")
    if client.asynchronous:
        raise InputError("client must not be asynchronous, got one that is")
    if _worker_count(client) == 0:
        raise InputError("client must have at least one worker, got none")


def run_on_cluster(
    work: Work, jobs: Iterable[Job], client: Any, arch: str
) -> Generator[tuple[Job, Record], None, None]:
    """Jobs and their records as they end, one job a worker at a time.

    So Dask, which counts how often a job was on a worker that died, blames no job that only waited.
    Raises InputError when the client is lost, or workers cannot run the function.
    """
    waiting, ended, tries = deque(jobs), _dask().as_completed(), Counter[str]()
    active: dict[Any, Job] = {}
    try:
        while waiting or active:
            while waiting and len(active) < max(1, _worker_count(client)):
                job = waiting.popleft()
                future = _submitted(client, work, job, arch)
                active[future] = job
                ended.add(future)
            _wait(ended, client, active)
            future = next(ended)
            job, record = active.pop(future), _record_of(future)
            if record is None:
                future.cancel()
                tries[job.digest] += 1
                if tries[job.digest] < TRIES:
                    waiting.appendleft(job)
                    continue
                record = failed(f"its result was lost with its worker {TRIES} times")
            yield job, record
    finally:
        if client.status == "running":
            client.cancel(list(active))


def _wait(ended, client, active):
    """Wait until a future has ended. Raises InputError where no worker is left to end one."""
    there = looked = time.perf_counter()
    while not ended.has_ready():
        time.sleep(_PAUSE)
        now = time.perf_counter()
        if now - looked > _LOOK:
            looked = now
            there = now if _worker_count(client) else there
        if now - there > _NO_WORKER:
            raise InputError(
                f"the client must have a worker, got none for {_NO_WORKER:.0f} s: the last ones "
                f"were lost by one of the rows {shown([job.row for job in active.values()])}; "
                "a Nanny, which dask worker starts by default, replaces workers"
            )


def _dask():
    import distributed

    return distributed


def _submitted(client, work, job, arch):
    try:
        return client.submit(run_in_worker, work, job.row, arch, pure=False)
    except (OSError, RuntimeError) as error:
        raise _client_lost(error) from None


def _record_of(future):
    """Record of a future that has ended, one way or another; None where it was lost since."""
    if future.status in ("cancelled", "lost"):
        raise _client_lost(future.status)
    try:
        error = future.exception(timeout=_ANSWER)
        if error is None:
            return future.result(timeout=_ANSWER)
    except _dask().TimeoutError:
        return None
    except (OSError, RuntimeError) as broken:
        raise _client_lost(broken) from None
    if isinstance(error, _dask().KilledWorker):
        # Dask allows a number of failures, 3 unless it is told otherwise.
        return failed(f"its worker was lost {error.allowed_failures + 1} times")
    if isinstance(error, InputError):
        raise error
    raise InputError(f"workers of the client cannot run the function: {_in_words(error)}")


def _worker_count(client):
    """Number of workers; InputError where one has several threads, or the client is lost."""
    if client.status != "running":
        raise _client_lost(f"it is {client.status}")
    try:
        threads = client.nthreads().values()
    except (OSError, RuntimeError) as error:
        raise _client_lost(error) from None
    if any(count != 1 for count in threads):
        raise InputError(
            "workers of the client must have one thread each, as Taichi runs on one alone, got "
            f"{max(threads)}: start them with threads_per_worker=1, or --nthreads 1"
        )
    return len(threads)


def _client_lost(reason):
    return InputError(f"the client has lost its scheduler: {_in_words(reason)}")


def _in_words(error):
    return " ".join(str(error).split()) or type(error).__name__
