"""Progress of a job, as passed to progress bars and progress callbacks."""

import contextlib
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from taichi_dem.kit.validation import FileName

#: Share of a job below which its first calls, which take longer than later ones, rule its speed.
LEAST_SHARE = 0.01


@dataclass(frozen=True)
class Progress:
    """How far a job is; every job of both packages and of the experiments reports one of these.

    Parameters
    ----------
    share : float
        Share of the job that is done, from 0 to 1.
    seconds : float
        Time spent on it so far, without compiling [s].
    """

    phase: ClassVar[str] = "running"
    share: float
    seconds: float

    @property
    def seconds_left(self) -> float:
        """Time expected until the end [s]; infinite while too little is known of it."""
        if self.share < LEAST_SHARE:
            return math.inf
        return max(0.0, self.seconds * (1.0 / self.share - 1.0))

    @property
    def speed(self) -> str:
        """Speed of the job in words; may be empty."""
        return ""

    def __str__(self):
        """Phase, percent done, time left and speed in one line."""
        done = f"{self.phase} {100.0 * self.share:3.0f} %"
        return ", ".join(part for part in (done, time_left(self.seconds_left), self.speed) if part)


@dataclass(frozen=True)
class Counted(Progress):
    """Progress of a job that consists of a number of runs; done of total are finished."""

    done: int
    total: int

    @property
    def speed(self) -> str:
        """How many runs are done."""
        return f"{self.done} of {self.total} runs"


@dataclass(frozen=True)
class Worded(Progress):
    """Progress of a run that says in words how fast it is, or how much is done."""

    phase: ClassVar[str] = "stepping"
    words: str

    @property
    def speed(self) -> str:
        """The words."""
        return self.words


@dataclass(frozen=True)
class Compiling(Progress):
    """Progress of compiling kernels before the first step.

    part: which of them, in words; it is the one of this number of all parts.
    """

    phase: ClassVar[str] = "compiling"
    part: str
    number: int
    total: int

    @property
    def seconds_left(self) -> float:
        """Infinite, as unknown: a part may come from the cache of kernels or be compiled."""
        return math.inf

    def __str__(self):
        """Number and name of the part, in one line."""
        return f"compiling {self.number} of {self.total}, {self.part}, the next start is faster"


@dataclass(frozen=True)
class Drawing(Progress):
    """Progress of drawing, after the run. file: name of the picture that is next."""

    phase: ClassVar[str] = "drawing"
    file: str

    def __str__(self):
        """The picture."""
        return f"drawing {self.file}"


def time_left(seconds: float) -> str:
    """A time that is left [s] in words, no finer than it is known; "" when it is unknown."""
    if not math.isfinite(seconds):
        return ""
    if seconds < 90.0:
        return f"{seconds:.0f} s left"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min left"
    return f"{seconds / 3600.0:.1f} h left"


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
    """Call listener with a Compiling or Drawing where one begins in the block; inner blocks win."""
    _listeners.append((listener, time.perf_counter()))
    try:
        yield
    finally:
        _listeners.pop()


def compiling(part: str, number: int, total: int) -> None:
    """Report that a part of the kernels is compiled next, the one of a number of all parts."""
    _tell(Compiling, (number - 1) / total, part, number, total)


def drawing(path: FileName) -> None:
    """Report that a picture is drawn next, by its path."""
    _tell(Drawing, 1.0, os.path.basename(path))


def _tell(kind, share, *more):
    if _listeners:
        listener, since = _listeners[-1]
        listener(kind(share, time.perf_counter() - since, *more))
