"""Whether an extreme was passed before the end of a run."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_dem.goals import Goal
from taichi_dem.kit.bars.answer import share_in_words
from taichi_dem.observers import At, RunView
from taichi_dem.result import Result

#: Share of a run from which on an extreme should change no more. Where it does, a run that is
#: longer by the rest shows whether it goes on.
BEFORE = 0.9


class Earlier:
    """Observer of the largest speeds up to a share of a run."""

    def __init__(self, until: float):
        self.when = At((BEFORE * until,))
        self.time_s, self.peak_speed = math.nan, np.zeros(0)

    def observe(self, view: RunView) -> None:
        """Keep the speeds so far."""
        self.time_s, self.peak_speed = view.time_s, view.peak_speed


def change(goal: Goal, result: Result, time_s: float, peak_speed: np.ndarray) -> float:
    """How much a goal changes from a time on [s]; NaN for a function that cannot say it then."""
    # A user's function may fail in whatever way where nothing changes.
    try:
        return abs(goal.value(result) - goal.value(_stopped(result, time_s, peak_speed)))
    except Exception:
        return math.nan


def _stopped(result, time_s, peak_speed):
    """The result as if nothing changed from a time on [s]."""
    times = result.series["time_s"]
    last = int(np.searchsorted(times, time_s, side="right")) - 1
    rows = np.minimum(np.arange(len(times)), last)
    series = {name: column[rows] for name, column in result.series.items()}
    broken = np.where(result.broken_time <= time_s, result.broken_time, np.nan)
    kept = {**series, "time_s": times}
    return replace(result, series=kept, broken_time=broken, peak_speed=peak_speed)


def extreme_doubts(
    runs: Any, first: float, last: float, error: float, affords: Callable[[float, float], bool]
) -> Iterator[str]:
    """Reasons to doubt an extreme, as sentences; none where it was passed before the end."""
    goal, until, result = runs.levels.goal, runs.levels.until, runs.results[last]
    if change(goal, result, 0.0, result.frames[0].speed) <= error:
        yield (
            "the extreme is the value at the start, which no later one exceeds by more than the "
            "bar: ask for a later time, or for a goal of the kind 'value'"
        )
    elif runs.late_change(last) > error:
        words = "the extreme lies in the last tenth of the run"
        if not affords(1.0 / BEFORE, first):
            yield f"{words}, and no budget is left for a longer one"
        elif (grown := runs.longer_change(first)) > error:
            by = share_in_words(grown, runs.value(first), goal.unit)
            to = f"{until / BEFORE:.3g} s"
            yield f"{words} and changes by {by} in one to {to}: ask for a later time"
