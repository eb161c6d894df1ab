"""Frequency of the peak of a response, found on a lattice that is halved as often as needed."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ca_damper.report.measures import peak, vertex
from taichi_dem.kit.errors import InputError

#: Frequencies of the first look, evenly over the range.
FIRST = 8
# Over this share of its lowest value may 1 / RMS^2 rise from the peak to its neighbours.
_RISE = 0.4
# Levels of halving at most.
_DEEPEST = 24
#: Range that a search may be extended to, as ratios f/f0.
LEAST_RATIO, MOST_RATIO = 0.05, 4.0


@dataclass(frozen=True)
class RatioGrid:
    """Ratios origin + k spacing / 2^level, the same numbers whatever way they are found."""

    origin: float
    spacing: float

    def ratio(self, k: int, level: int) -> float:
        """The k-th ratio of a level."""
        return round(self.origin + k * self.spacing / 2**level, 12)

    def position(self, ratio: float, level: int) -> float:
        """Place of a ratio on a level, not rounded."""
        return (ratio - self.origin) / self.spacing * 2**level

    def around(self, ratio: float, level: int) -> tuple[float, ...]:
        """Three ratios of a level around one, or four where it lies between two of them."""
        place = self.position(ratio, level)
        k = round(place)
        first = k - 2 if place - k < -0.2 else k - 1
        last = k + 2 if place - k > 0.2 else k + 1
        return tuple(self.ratio(j, level) for j in range(first, last + 1))

    def wide(self, ratio: float, level: int) -> tuple[tuple[float, ...], ...]:
        """Triples twice as far apart: around the middle one of ``around``, or each of two."""
        place = self.position(ratio, level)
        middle = {round(place), math.floor(place), math.ceil(place)}
        if len(self.around(ratio, level)) == 3:
            middle = {round(place)}
        return tuple(tuple(self.ratio(j, level) for j in (k - 2, k, k + 2)) for k in sorted(middle))


class PeakOutside(InputError):
    """A range of frequencies does not contain the peak."""


class PeakSearch:
    """Search of a peak in [lowest, highest] f/f0; finest: spacing that resolves every peak."""

    def __init__(
        self,
        rms_at: Callable[[list[float]], list[float]],
        lowest: float,
        highest: float,
        may_extend: bool,
        finest: float = 0.0,
    ):
        self.rms_at, self.may_extend, self.finest = rms_at, may_extend, finest
        self.lowest, self.highest = lowest, highest
        self.lattice, self.level = RatioGrid(lowest, (highest - lowest) / FIRST), 0
        self.found: dict[float, float] = {}

    def run(self) -> tuple[float, RatioGrid, int]:
        """Ratio of the peak, the lattice, and its level on which the peak is resolved."""
        ends = range(FIRST + 1)
        self._measure([self.lattice.ratio(k, 0) for k in ends])
        while True:
            ratio, wanted = self._peak()
            # A plateau wants no finer spacing; beside a zero or no number, none is fine enough.
            widest = self.lattice.spacing
            wanted = min(widest, max(widest / 2.0**_DEEPEST, self.finest, wanted))
            level = min(math.ceil(math.log2(widest / wanted)), self.level + 3)
            self.level = max(self.level, level)
            around = self.lattice.around(ratio, self.level)
            missing = [missed for missed in around if missed not in self.found]
            if not missing:
                return ratio, self.lattice, self.level
            self._measure(missing)

    def _measure(self, ratios):
        self.found.update(zip(ratios, self.rms_at(ratios)))

    def _curve(self):
        ratios = np.array(sorted(self.found))
        return ratios, np.array([self.found[ratio] for ratio in ratios.tolist()])

    def _peak(self):
        """(ratio of the peak, spacing that resolves it)."""
        ratios, rms = self._curve()
        while not np.isfinite(peak(ratios, rms)[0]):
            self._extend(ratios, rms)
            ratios, rms = self._curve()
        ratio, _ = peak(ratios, rms)
        k = int(rms.argmax())
        x, y = ratios[k - 1 : k + 2] ** 2, (rms[k] / rms[k - 1 : k + 2]) ** 2
        top, low = vertex(x, y)
        far = max(range(3), key=lambda j: abs(x[j] - top))
        bend = (y[far] - low) / (x[far] - top) ** 2
        low = max(low, 1e-12)
        return ratio, math.sqrt(_RISE * low / bend) / (2.0 * ratio) if bend > 0.0 else math.inf

    def _extend(self, ratios, rms):
        """Look one ratio further where the response still rises."""
        below = int(np.nanargmax(rms)) == 0 if np.isfinite(rms).any() else False
        end = float(ratios[0] if below else ratios[-1])
        further = end - self.lattice.spacing if below else end + self.lattice.spacing
        if not self.may_extend or not LEAST_RATIO < further < MOST_RATIO or not rms.any():
            side = "below" if below else "above"
            raise PeakOutside(
                f"ratios must contain the peak, which lies outside, {side} {end:.6g}: the response "
                f"still rises there, got ({self.lowest:g}, {self.highest:g})"
            )
        k = round(self.lattice.position(further, 0))
        self._measure([self.lattice.ratio(k, 0)])
