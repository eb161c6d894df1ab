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

    constant_fields = ("count", "times", "values", "integral")

    def __init__(self):
        self.count = ti.field(ti.i32, shape=())
        self.times = ti.field(real, shape=MOST_POINTS)
        self.values = ti.field(real, shape=MOST_POINTS)
        self.integral = ti.field(real, shape=MOST_POINTS)

    def load(self, times: tuple[float, ...], values: tuple[float, ...]) -> None:
        """Take over points of ``history_points``; one that never changes needs none."""
        t, v = np.array(times), np.array(values)
        areas = 0.5 * (v[1:] + v[:-1]) * np.diff(t)
        assign(self.count, 0 if (v == v[0]).all() else len(t))
        assign(self.times, t)
        assign(self.values, v)
        assign(self.integral, np.array([0.0, *np.cumsum(areas)]))

    @ti.func
    def mean(self, since, until):
        """Mean value from a time to a later one [s]; of one time the value.

        Within a piece it is the value in the middle, which no difference of integrals spoils.
        """
        first = self._passed(since, 0)
        last = self._passed(until, first)
        found = self._value(first, 0.5 * (since + until))
        if first < last:
            begin, end = self.times[first], self.times[last - 1]
            area = self.integral[last - 1] - self.integral[first]
            area += (begin - since) * self._value(first, 0.5 * (since + begin))
            area += (until - end) * self._value(last, 0.5 * (end + until))
            found = area / (until - since)
        return found

    @ti.func
    def _passed(self, t, low):
        """Number of points up to a time [s], at least low."""
        high = self.count[None]
        while low < high:
            middle = (low + high) // 2
            if self.times[middle] <= t:
                low = middle + 1
            else:
                high = middle
        return low

    @ti.func
    def _value(self, passed, t):
        """Value at a time [s] after a number of points."""
        found = self.values[ti.max(passed - 1, 0)]
        if 0 < passed and passed < self.count[None]:
            before, after = self.times[passed - 1], self.times[passed]
            found += (t - before) / (after - before) * (self.values[passed] - found)
        return found
