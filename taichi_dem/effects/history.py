"""Values over time, linear between given points, for loads and supports."""

from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real
from taichi_dem.kit.validation import LARGEST, finite, shown

#: Points that a history may have.
MOST_POINTS = 4096


def history_points(times: Any, values: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times [s] and values as tuples of floats.

    Raises InputError unless both are lists of finite numbers of one length, from 1 to
    ``MOST_POINTS``, and the times rise from 0 or later.
    """
    first, second = _numbers("times", times), _numbers("values", values)
    if len(first) != len(second):
        raise InputError(
            f"values must be as many as times, {len(first)}, got {len(second)}: {shown(values)}"
        )
    if first[0] < 0.0 or any(b <= a for a, b in zip(first, first[1:])):
        raise InputError(f"times must rise from 0 s or later, each above the last, {_got(times)}")
    return first, second


def _numbers(name, given):
    try:
        found = list(given)
    except TypeError:
        found = []
    if isinstance(given, (str, bytes, dict, set)) or not 1 <= len(found) <= MOST_POINTS:
        raise InputError(f"{name} must be a list of 1 to {MOST_POINTS} numbers, {_got(given)}")
    wrong = [value for value in found if not (finite(value) and abs(value) <= LARGEST)]
    if wrong:
        raise InputError(f"{name} must be a list of numbers of at most {LARGEST:g}, {_got(given)}")
    return tuple(float(value) for value in found)


def _got(given):
    return f"got {shown(given)}"


@ti.data_oriented
class History:
    """Values over time on the device; before the first and after the last time they stay."""

    constant_fields = ("count", "times", "values")

    def __init__(self):
        self.count = ti.field(ti.i32, shape=())
        self.times = ti.field(real, shape=MOST_POINTS)
        self.values = ti.field(real, shape=MOST_POINTS)

    def load(self, times: tuple[float, ...], values: tuple[float, ...]) -> None:
        """Take over points of ``history_points``."""
        assign(self.count, len(times))
        assign(self.times, np.array(times))
        assign(self.values, np.array(values))

    @ti.func
    def at(self, t):
        """Value at a time [s]."""
        low, high = 0, self.count[None] - 1
        found = self.values[0]
        if t >= self.times[high]:
            found = self.values[high]
        elif t > self.times[0]:
            while high - low > 1:
                middle = (low + high) // 2
                if self.times[middle] <= t:
                    low = middle
                else:
                    high = middle
            share = (t - self.times[low]) / (self.times[high] - self.times[low])
            found = self.values[low] + share * (self.values[high] - self.values[low])
        return found
