"""The one thread that owns Taichi, for every page and every session of the lessons.

Each browser that opens a lesson is served by a thread of its own, in one process. Taichi makes
fields only on the thread that started it, and two starts would take each other's fields away. So
all work is handed to this thread, and what it has built is kept for whoever asks next.
"""

import atexit
import itertools
import queue
import threading
from concurrent.futures import Future

from taichi_dem import runtime

#: Order of the work: what somebody waits for, then what may be asked for later.
_ASKED, _PREPARED = range(2)


class Engine:
    """A thread that does work one piece after the other; it starts Taichi with its first piece.

    threads: of the CPU, as in ``runtime.start``.
    """

    def __init__(self, threads=None):
        self.threads = threads
        self._lock, self._order = threading.Lock(), itertools.count()
        self._work, self._thread, self._kept = queue.PriorityQueue(), None, {}

    def ask(self, work, *arguments):
        """Do work(*arguments) before all that is only prepared; returns or raises what it does."""
        if threading.current_thread() is self._thread:
            return work(*arguments)
        return self._put(_ASKED, work, arguments).result()

    def prepare(self, work, *arguments):
        """Do work(*arguments) when nobody waits for anything, so that a later ask is quick."""
        self._put(_PREPARED, work, arguments)

    def kept(self, key, make):
        """What make() gave when it was first asked for under this key; on the engine's thread."""
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def close(self):
        """Forget what is only prepared, end Taichi and the thread; another ask begins anew."""
        with self._lock:
            thread, self._thread = self._thread, None
            if thread is not None:
                self._work.put((_ASKED - 1, next(self._order), None, None, ()))
        if thread is not None:
            thread.join()

    def _put(self, rank, work, arguments):
        answer = Future()
        with self._lock:
            if self._thread is None:
                self._work = queue.PriorityQueue()
                line = {"target": self._serve, "args": (self._work,), "daemon": True}
                self._thread = threading.Thread(**line)
                self._thread.start()
            self._work.put((rank, next(self._order), answer, work, arguments))
        return answer

    def _serve(self, waiting):
        """Work until ``close``. Taichi starts with the first piece, so that its fault is told."""
        started = False
        while True:
            _, _, answer, work, arguments = waiting.get()
            if work is None:
                break
            try:
                if not started:
                    runtime.start(threads=self.threads)
                    started = True
                answer.set_result(work(*arguments))
            except BaseException as error:
                answer.set_exception(error)
        self._kept.clear()
        if started:
            runtime.stop()
        _cancel(waiting)


def _cancel(waiting):
    """Tell all who still wait that nobody is going to answer."""
    while not waiting.empty():
        answer = waiting.get()[2]
        if answer is not None:
            answer.cancel()


#: That of this process. It ends before the interpreter: a thread that compiles must not be cut off.
engine = Engine()
atexit.register(engine.close)
