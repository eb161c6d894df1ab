"""Progress of a job, as passed to progress bars and progress callbacks."""

import contextlib
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta

from taichi_dem.kit.validation import FileName

#: Share of a job below which its first calls, which take longer than later ones, rule its speed.
LEAST_SHARE = 0.01
#: Phases whose end nobody knows: a kernel may come from the cache or be compiled.
_UNTIMED = ("compiling", "drawing")


@dataclass(frozen=True)
class Progress:
    """Progress of a job; every job of both packages and of the experiments reports it.

    Parameters
    ----------
    share : float
        Share of the job that is done, from 0 to 1.
    seconds : float
        Time spent on it so far, without compiling [s].
    phase : str, default "running"
        "compiling", "stepping", "drawing" or "running".
    words : str, default ""
        Speed of the job, how much of it is done, or what is compiled or drawn.
    """

    share: float
    seconds: float
    phase: str = "running"
    words: str = ""

    @property
    def seconds_left(self) -> float:
        """Expected time until the end [s]; infinite while unknown."""
        if self.phase in _UNTIMED or self.share < LEAST_SHARE:
            return math.inf
        return max(0.0, self.seconds * (1.0 / self.share - 1.0))

    def __str__(self):
        """Phase, percent done, time left and words in one line."""
        if self.phase in _UNTIMED:
            return f"{self.phase} {self.words}"
        done, left = f"{self.phase} {100.0 * self.share:3.0f} %", ""
        if math.isfinite(self.seconds_left):
            left = f"{timedelta(seconds=round(self.seconds_left))} left"
        return ", ".join(part for part in (done, left, self.words) if part)


class Pace:
    """Says when it is time to report again: after some seconds [s]."""

    def __init__(self, seconds: float):
        self.seconds, self._last = seconds, -math.inf

    def should_report(self, at_any_rate: bool = False) -> bool:
        """Whether to report now; the next time is counted from then on."""
        now = time.perf_counter()
        due = at_any_rate or now - self._last >= self.seconds
        if due:
            self._last = now
        return due


#: Function that is called with the progress of a job.
Listener = Callable[[Progress], object]

#: Listeners to compiling and drawing, the innermost last, and since when each listens [s].
_listeners: list[tuple[Listener, float]] = []


@contextlib.contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Call listener with a Progress where compiling or drawing begins in the block."""
    _listeners.append((listener, time.perf_counter()))
    try:
        yield
    finally:
        _listeners.pop()


def compiling(part: str, number: int, total: int) -> None:
    """Report that a part of the kernels is compiled next, the one of a number of all parts."""
    words = f"{number} of {total}, {part}, the next start is faster"
    _tell((number - 1) / total, "compiling", words)


def drawing(path: FileName) -> None:
    """Report that a picture is drawn next, by its path."""
    _tell(1.0, "drawing", os.path.basename(path))


def _tell(share, phase, words):
    if _listeners:
        listener, since = _listeners[-1]
        listener(Progress(share, time.perf_counter() - since, phase, words))
