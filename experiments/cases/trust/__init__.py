"""Numbers that others have published, and ours beside them.

A case is a function of an ``Effort`` that returns its Numbers, and the data of its picture by name.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Effort:
    """What is spent: seeds of random meshes of a size, and sizes of element."""

    seeds: range = range(2)
    sizes: int = 1


@dataclass
class Number:
    """A number that others have published or derived, and ours beside it.

    key, words, unit: what it is. source: where the published number comes from. values: ours, one
    for each mesh or draw. low, high: what counts as agreement, published within a share ``allowed``
    where not given. miss: why it is known to miss, none where it has to hold. mean, spread: of the
    meshes, which is half of their range.
    """

    key: str
    words: str
    published: float
    values: np.ndarray
    low: float | None = None
    high: float | None = None
    unit: str = "1"
    source: str = ""
    miss: str = ""
    allowed: float = 0.01

    def __post_init__(self):
        reach = self.allowed * abs(self.published)
        self.low = self.published - reach if self.low is None else self.low
        self.high = self.published + reach if self.high is None else self.high
        self.mean, self.spread = float(np.mean(self.values)), 0.5 * float(np.ptp(self.values))

    @property
    def error_percent(self):
        """Of the mean, in percent of the published number; absolute where that is zero."""
        gap = self.mean - self.published
        return 100.0 * (gap / abs(self.published) if self.published else gap)

    @property
    def holds(self):
        """Whether the mean of the meshes lies within what counts as agreement."""
        return bool(self.low <= self.mean <= self.high)
