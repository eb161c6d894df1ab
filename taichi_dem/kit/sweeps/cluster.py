"""Workers of a Dask cluster that run the jobs of a sweep."""

from collections import deque
from collections.abc import Generator, Iterable
from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.optional import optional
from taichi_dem.kit.sweeps.job import Job, Record, Work, failed, run_in_worker
from taichi_dem.kit.validation import shown


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
    waiting, ended = deque(jobs), _dask().as_completed()
    active: dict[Any, Job] = {}
    try:
        while waiting or active:
            while waiting and len(active) < max(1, _worker_count(client)):
                job = waiting.popleft()
                future = _submitted(client, work, job, arch)
                active[future] = job
                ended.add(future)
            future = next(ended)
            yield active.pop(future), _record_of(future)
    finally:
        if client.status == "running":
            client.cancel(list(active))


def _dask():
    return optional("distributed")


def _submitted(client, work, job, arch):
    try:
        return client.submit(run_in_worker, work, job.row, arch, pure=False)
    except (OSError, RuntimeError) as error:
        raise _client_lost(error) from None


def _record_of(future):
    """Record of a future that has ended, one way or another."""
    if future.status in ("cancelled", "lost"):
        raise _client_lost(future.status)
    try:
        error = future.exception()
    except (OSError, RuntimeError) as broken:
        raise _client_lost(broken) from None
    if error is None:
        return future.result()
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
