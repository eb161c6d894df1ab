"""A figure of the bench, its share of the machine's floor, and candidates that take turns."""

from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import NamedTuple

from taichi_dem.kit.study.floors import Work

#: Units of times [s]; of all others more is better.
TIMES = {"s": 1.0, "s of wall": 1.0, "ms": 1e-3, "ns": 1e-9}


class Figure(NamedTuple):
    """Repeated measurements of one quantity.

    values: in a unit. bound: what is wanted, in words. work: least work of what takes the time, or
    of one of those that are counted; None where nothing bounds it. then: what it was before the
    work on waits, at 1e0e56e, in words.
    """

    name: str
    unit: str
    values: Sequence[float]
    bound: str = ""
    work: Work | None = None
    then: str = ""

    @property
    def middle(self):
        """Median of the values."""
        return float(median(self.values))

    @property
    def is_time(self):
        """Whether less is better."""
        return self.unit in TIMES

    def share(self, floors: Mapping[str, float]):
        """Least time of the work over the time it took [1]; floors: rates by name. None without."""
        if self.work is None or not floors:
            return None
        least = self.work.seconds(floors)
        if self.is_time:
            return least / (TIMES[self.unit] * self.middle)
        return least * self.middle * (1e6 if self.unit.startswith("million") else 1.0)


def by_turns(works: Mapping[str, tuple[Callable[[], object], int]]):
    """Results by name of functions that are called so many times, one call each before a second.

    So a busy minute of the machine does not fall on one candidate alone.
    """
    found = {name: [] for name in works}
    for turn in range(max(repeats for _, repeats in works.values())):
        for name, (work, repeats) in works.items():
            if turn < repeats:
                found[name].append(work())
    return found
