"""Processes of this machine that run the jobs of a sweep; one that is lost loses nothing."""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Generator, Iterable
from multiprocessing import connection
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.sweeps.job import Job, Leave, Record, failed, imported_work, run_in_worker

#: Runs of a job whose process was lost each time, and starts of a process that ended each time.
TRIES = 3
#: Exit code of a process whose main script starts a sweep while it is imported.
_UNGUARDED = 79
#: Time in which a process may write the kernels that it has compiled, and end when it is told [s].
_LEAVING, _ENDING = 60.0, 5.0
_GUARD = 'the call of sweep must stand below if __name__ == "__main__": in the script'


def leave_unless_main() -> None:
    """End a process that imports the main script of a sweep, which starts it again."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        sys.exit(_UNGUARDED)


class _Worker:
    """A process and the job that it runs, None while it has none."""

    def __init__(self, name: str, arch: str):
        context = multiprocessing.get_context("spawn")
        try:
            self.connection, theirs = context.Pipe()
            self.process = context.Process(target=_serve, args=(theirs, name, arch))
            self.process.start()
        except OSError as error:
            reason = error.strerror or error
            raise InputError(
                f"workers must be so few that their processes start, got: {reason}"
            ) from None
        theirs.close()
        self.ready = False
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        """Have a job run; one that is lost is noticed when its answer is awaited."""
        self.job = job
        try:
            self.connection.send(job.row)
        except OSError:
            pass

    def answer(self) -> Any:
        """Next message (kind, content), None while there is none; kind "lost" where it died."""
        try:
            if self.connection.poll():
                return self.connection.recv()
        except (EOFError, OSError):
            self.process.join(_ENDING)
            return "lost", self.process.exitcode
        return None if self.process.is_alive() else ("lost", self.process.exitcode)

    def leave(self) -> None:
        """Let it end when it is idle, which writes its kernels for the next one."""
        try:
            self.connection.send(None)
        except OSError:
            pass
        self.process.join(_LEAVING)
        self.end()

    def end(self) -> None:
        """End it, whatever it does."""
        self.process.terminate()
        self.process.join(_ENDING)
        self.process.kill()
        self.process.join()
        self.connection.close()


def run_locally(
    name: str, jobs: Iterable[Job], count: int, arch: str
) -> Generator[tuple[Job, Record], None, None]:
    """Jobs and their records as they end, by a number of processes side by side.

    name: of the function, as of ``checked_work``. Raises InputError where processes do not start.
    """
    waiting, tries = deque(jobs), Counter[str]()
    workers: list[_Worker] = []
    early = 0
    try:
        for _ in range(min(count, len(waiting))):
            workers.append(_Worker(name, arch))
        while waiting or any(worker.job for worker in workers):
            for k, worker in enumerate(workers):
                message = worker.answer()
                if message is None:
                    continue
                kind, content = message
                if kind == "lost":
                    early = 0 if worker.ready else early + 1
                    _check_start(content, early)
                    worker.end()
                    workers[k] = _Worker(name, arch)
                    yield from _lost(worker.job, content, waiting, tries)
                elif kind == "refused":
                    raise InputError(content)
                else:
                    job, worker.job, worker.ready = worker.job, None, True
                    if waiting:
                        worker.give(waiting.popleft())
                    if job is not None:
                        yield job, content
            _wait(workers)
        for worker in workers:
            worker.leave()
    finally:
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.end()


def _wait(workers):
    """Wait until a process says something or ends."""
    ends = [(worker.connection, worker.process.sentinel) for worker in workers]
    connection.wait([one for pair in ends for one in pair], timeout=1.0)


def _lost(job, code, waiting, tries):
    """Have the job of a lost process run again, or say that it failed."""
    if job is None:
        return
    tries[job.digest] += 1
    if tries[job.digest] < TRIES:
        waiting.appendleft(job)
    else:
        yield job, failed(f"its process was lost {TRIES} times, the last time by {_cause(code)}")


def _check_start(code, early):
    if early and code == _UNGUARDED:
        raise InputError(_GUARD)
    if early == TRIES:
        raise InputError(f"no process of the sweep starts: the last one ended by {_cause(code)}")


def _cause(code):
    if code is None or code >= 0:
        return f"exit code {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def _serve(link, name, arch):
    """Run the rows that come in, until None comes; answers are pairs of kind and content."""
    # Ctrl-C reaches all processes of a terminal: the sweep ends this one when it has been heard. A
    # handler, since programs that a job starts would inherit that it is ignored.
    signal.signal(signal.SIGINT, lambda *_: None)
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        work = imported_work(name)
        link.send(("ready", None))
        while True:
            row = link.recv()
            if row is None:
                break
            link.send(("done", run_in_worker(work, row, arch)))
    except InputError as error:
        link.send(("refused", str(error)))
    except (ImportError, AttributeError) as error:
        link.send(("refused", f"function {name} cannot be imported by other processes: {error}"))
    except Leave:
        sys.exit(128 + signal.SIGTERM)
    except (EOFError, OSError):
        # The sweep itself was killed.
        return
    runtime.stop()


def _leave(*_):
    raise Leave


def _end_with_parent():
    """End this process where that of the sweep has ended, however: nobody waits for its row."""
    parent: Any = multiprocessing.parent_process()
    connection.wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_ENDING)
    os._exit(128 + signal.SIGTERM)
