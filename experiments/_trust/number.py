"""A number that others have published or derived, and ours beside it."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Number:
    """One row of the page.

    key, words, unit: what it is. source: where the published number comes from. published: it.
    values: ours, one for each mesh or draw. low, high: what counts as agreement; published within a
    percent where neither is given. note: what a reader should know of a miss.
    """

    key: str
    words: str
    unit: str
    source: str
    published: float
    values: np.ndarray
    low: float | None = None
    high: float | None = None
    note: str = ""
    #: Widest error that counts as agreement where no range is given, as a share.
    allowed: float = field(default=0.01)

    @property
    def mean(self) -> float:
        """Mean over the meshes."""
        return float(np.mean(self.values))

    @property
    def spread(self) -> float:
        """Half of the range of all meshes."""
        return 0.5 * float(np.ptp(self.values))

    @property
    def error_percent(self) -> float:
        """Of the mean, in percent of the published number; absolute where that is zero."""
        gap = self.mean - self.published
        return 100.0 * (gap / abs(self.published) if self.published else gap)

    @property
    def wanted(self) -> tuple[float, float]:
        """Range of agreement."""
        reach = self.allowed * abs(self.published)
        low = self.published - reach if self.low is None else self.low
        return low, self.published + reach if self.high is None else self.high

    @property
    def holds(self) -> bool:
        """Whether the mean of the meshes is within it."""
        low, high = self.wanted
        return bool(low <= self.mean <= high)

    def as_dict(self):
        """Row of the CSV."""
        low, high = self.wanted
        same = {"key": self.key, "unit": self.unit, "published": self.published, "ours": self.mean}
        ends = {"spread": self.spread, "low": low, "high": high, "holds": self.holds}
        return {
            **same,
            **ends,
            "values": " ".join(f"{value:.8g}" for value in np.ravel(self.values)),
        }

    def cells(self):
        """Cells of the printed table."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        low, high = self.wanted
        ours = f"{self.mean:.4g}{unit}"
        if np.size(self.values) > 1:
            ours = f"{self.mean:.4g} ± {self.spread:.2g}{unit}"
        verdict = "holds" if self.holds else "misses"
        published = f"{self.published:.4g}{unit}"
        return self.words, self.source, published, ours, f"{low:.4g} to {high:.4g}{unit}", verdict
