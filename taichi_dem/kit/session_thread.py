"""One thread that owns Taichi, for programs that serve several users: pages, notebooks, sliders.

In one process, each browser that opens a page has a thread of its own. Taichi makes fields only on
the thread that started it, and a second start would remove them. So this thread does all work, and
keeps its results for the next user.
"""

import functools
import threading
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from taichi_dem.kit import runtime


class SessionThread:
    """A thread that does work one piece after the other; it starts Taichi with its first piece.

    threads: of the CPU, as in ``runtime.start``.
    """

    def __init__(self, threads: int | None = None):
        self.threads, self._lock = threads, threading.Lock()
        self._pool: ThreadPoolExecutor | None = None
        self._thread: threading.Thread | None = None
        self._kept: dict[Hashable, Any] = {}

    def ask(self, work: Callable, *arguments: Any) -> Any:
        """Do work(*arguments) on the thread, in its turn; returns or raises its outcome."""
        if threading.current_thread() is self._thread:
            return work(*arguments)
        with self._lock:
            if self._pool is None:
                self._pool = ThreadPoolExecutor(1)
            answer = self._pool.submit(self._do, work, arguments)
        return answer.result()

    def kept(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """Result of make(), called once under a key; on this thread."""
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def remember(self, work: Callable) -> Callable:
        """Decorate a function so that it is called once with the same arguments, as by ``kept``."""

        @functools.wraps(work)
        def recall(*arguments):
            return self.kept((work, *arguments), lambda: work(*arguments))

        return recall

    def close(self) -> None:
        """End Taichi and the thread, after what has been asked for; another ask begins anew."""
        with self._lock:
            pool, self._pool = self._pool, None
            if pool is not None:
                pool.submit(self._end)
                pool.shutdown()

    def _do(self, work, arguments):
        if self._thread is None:
            runtime.start(threads=self.threads)
            self._thread = threading.current_thread()
        return work(*arguments)

    def _end(self):
        self._kept.clear()
        if self._thread is not None:
            runtime.stop()
        self._thread = None


#: That of this process.
session = SessionThread()
