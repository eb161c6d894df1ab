"""Values over time, linear between given points, for loads and supports."""

from math import inf
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import real
from taichi_dem.kit.validation import real_numbers, shown
from taichi_dem.laws.contracts import BodyEffect
from taichi_dem.state.model import names_of

#: Points that a history may have.
MOST_POINTS = 4096


def history_points(times: object, values: object) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times [s] and values as tuples of floats."""
    t, v = (np.atleast_1d(real_numbers(*named)) for named in (("times", times), ("values", values)))
    if t.ndim != 1 or not 1 <= len(t) <= MOST_POINTS:
        raise InputError(f"times must be 1 to {MOST_POINTS} numbers in a row, got {shown(times)}")
    if t.shape != v.shape:
        raise InputError(f"values must be as many as times, {len(t)}, got {shown(values)}")
    if t[0] < 0.0 or (np.diff(t) <= 0.0).any():
        raise InputError(
            f"times must rise from 0 s or later, each above the last, got {shown(times)}"
        )
    return tuple(t.tolist()), tuple(v.tolist())


def shortest_piece(times: tuple[float, ...], values: tuple[float, ...]) -> float:
    """Shortest time in which ``history_points`` change [s]; infinite where nothing does."""
    pieces = zip(times, times[1:], values, values[1:])
    return min((end - begin for begin, end, one, other in pieces if one != other), default=inf)


def unresolved_histories(effects: Any, step: float) -> tuple[str, ...]:
    """A sentence about each load or support that changes within less than a step [s]."""
    listed = tuple(effects)
    named = zip(names_of(listed), listed)
    times = (
        (name, effect.change_time()) for name, effect in named if isinstance(effect, BodyEffect)
    )
    return tuple(
        f"{name} changes within {time:.3g} s, "
        f"less than the largest step, {step:.3g} s: its shape over time may be lost, though loads "
        "keep their whole impulse and ramps their whole displacement; steps of at most "
        f"{time:.3g} s resolve it"
        for name, time in times
        if time < step
    )


@ti.data_oriented
class History:
    """Values over time on the device; before the first and after the last time they stay."""

    constant_fields = ("count", "times", "values", "integral")

    def __init__(self):
        self.count = ti.field(ti.i32, shape=())
        self.times = ti.field(real, shape=MOST_POINTS)
        self.values = ti.field(real, shape=MOST_POINTS)
        self.integral = ti.field(real, shape=MOST_POINTS)

    def upload(self, times: tuple[float, ...], values: tuple[float, ...]) -> None:
        """Take over points of ``history_points``; one that never changes needs none."""
        t, v = np.array(times), np.array(values)
        areas = 0.5 * (v[1:] + v[:-1]) * np.diff(t)
        assign(self.count, len(t) if (v != v[0]).any() else 0)
        assign(self.times, t)
        assign(self.values, v)
        assign(self.integral, np.array([0.0, *np.cumsum(areas)]))

    @ti.func
    def mean(self, since, until):
        """Mean value from a time to a later one [s]; of one time the value."""
        # Within a piece the middle value is the mean; a difference of integrals would lose digits.
        first = self._passed(since, 0)
        last = self._passed(until, first)
        mean = self._value(first, 0.5 * (since + until))
        if first < last:
            begin, end = self.times[first], self.times[last - 1]
            area = self.integral[last - 1] - self.integral[first]
            area += (begin - since) * self._value(first, 0.5 * (since + begin))
            area += (until - end) * self._value(last, 0.5 * (end + until))
            mean = area / (until - since)
        return mean

    @ti.func
    def changes(self, since, until):
        """Nonzero where the value changes between two times [s]."""
        passed = self._passed(since, 0)
        changes = self._passed(until, passed) > passed
        if 0 < passed and passed < self.count[None]:
            changes = changes or self.values[passed] != self.values[passed - 1]
        return changes

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
        value = self.values[ti.max(passed - 1, 0)]
        if 0 < passed and passed < self.count[None]:
            before, after = self.times[passed - 1], self.times[passed]
            value += (t - before) / (after - before) * (self.values[passed] - value)
        return value
