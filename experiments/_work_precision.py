"""Runs of a method at several steps, and the cheapest of them for an error."""

import itertools
import math
from typing import NamedTuple


class Point(NamedTuple):
    """A run of a method.

    step: the swept number, larger is coarser; label: the same in words. error: a share, NaN where a
    run failed. failure: why it did, in a word.
    """

    method: str
    step: float
    label: str
    seconds: float
    error: float = math.nan
    failure: str = ""


def cheapest(points, target, floor=0.0):
    """The cheapest point of a method with an error up to a target, or None.

    All finer steps must be as good, and the floor must lie below: the distance of runs that should
    not differ. A single lucky run answers nothing.
    """
    finest_first = sorted(points, key=lambda one: one.step)
    # NaN, of a failure, is no error at all.
    reached = itertools.takewhile(lambda one: one.error <= target, finest_first)
    return min(reached, key=lambda one: one.seconds, default=None) if floor <= target else None
