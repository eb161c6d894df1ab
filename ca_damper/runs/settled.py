"""Peak of a structure under sines of its base, however little the structure itself damps."""

from typing import Any

import numpy as np

from ca_damper.report.measures import Cycles, peak
from ca_damper.report.peak_search import PeakOutside, PeakSearch
from ca_damper.runs.response import Grid
from ca_damper.scenes.gravity import gravity_along

# Cycles that show an approach, at least.
_LEAST_CYCLES = 4
# Distance from the limit that does not matter, as a share; runs are doubled so often for it.
_SETTLED, _DOUBLINGS = 0.02, 3
# Scenes below this share of the highest do not matter.
_NEAR = 0.5


class SteadyPeak:
    """Search of the peak of a box on a structure, (seeds,) values."""

    def __init__(self, filling: Any, cycles: tuple[int, int], progress: Any, **scenes: Any):
        self.filling, self.progress, self.scenes = filling, progress, scenes
        self.transient, self.measured = cycles[0], max(cycles[1], _LEAST_CYCLES)
        self.found: dict[float, tuple[np.ndarray, np.ndarray]] = {}

    def run(self, low: float, high: float, doublings: int = _DOUBLINGS) -> tuple[np.ndarray, float]:
        """Peak RMS of each seed [m], and the half-width [m] by what has not settled and spacing."""

        def rms_at(ratios: list[float]) -> list[float]:
            rms, errors = self._rms(ratios, doublings)
            self.found.update(zip(ratios, zip(rms, errors)))
            return [float(ratio) for ratio in rms.mean(axis=1)]

        # Grains only add to the structure's own damping, and no peak is narrower than by that.
        finest = self.scenes["oscillator"].damping_ratio
        try:
            PeakSearch(rms_at, low, high, True, finest).run()
        except PeakOutside:
            # A peak outside has no vertex: the highest value stands.
            pass
        ratios = np.array(sorted(self.found))
        rms, errors = (np.array([self.found[ratio][k] for ratio in ratios]) for k in (0, 1))
        if np.isnan(rms).any():
            return np.full(rms.shape[1], np.nan), np.nan
        highest = int(rms.mean(axis=1).argmax())
        values = np.array([_top(ratios, curve) for curve in rms.T])
        return values, float(np.hypot(errors[highest].mean(), _spacing(ratios, rms, highest)))

    def _rms(self, ratios, doublings):
        """RMS [m] and its half-width by what has not settled [m], (ratios, seeds) each."""
        grid = Grid(self.filling, ratios=ratios, **self.scenes)
        batch = grid.batch(grid.ratios, self.measured)
        own = self.scenes["oscillator"]
        mass = grid.particles[0] * self.filling.particle_mass
        weight = gravity_along(self.filling)
        batch.start("rest", **_near(own, batch.table.column("frequency"), mass, weight))
        cycles = batch.run(self.transient, self.measured, self.progress)
        for k in range(doublings):
            rms, error = steady_rms(cycles, weight)
            if not (error > _SETTLED * rms)[rms + error > _NEAR * np.nanmax(rms)].any():
                break
            cycles = batch.run(2**k * self.transient, self.measured, self.progress)
        shape = grid.shape[1:]
        return tuple(reading.reshape(shape) for reading in steady_rms(cycles, weight))


def _near(structure, frequency, mass, weight):
    """State near the steady one, by name: of a fixed mass, as far as grains do not fly [m, m/s]."""
    x, v = structure.steady_state(frequency, mass)
    omega = 2.0 * np.pi * frequency
    share = np.minimum(1.0, weight / np.maximum(omega**2 * np.hypot(x, v / omega), 1e-300))
    sag = weight * mass / structure.stiffness
    return {"displacement": share * x - sag, "velocity": share * v}


def steady_rms(cycles: Cycles, weight: float) -> tuple[np.ndarray, np.ndarray]:
    """RMS of the steady motion that cycles approach [m] and its half-width [m], (scenes,) each."""
    harmonic = cycles.harmonic_by_cycle("x")
    limit, blur = limit_of(harmonic)
    shown = cycles.rms
    square = shown**2 + 0.5 * (np.abs(limit) ** 2 - (np.abs(harmonic) ** 2).mean(axis=1))
    ahead = np.sqrt(np.maximum(square, 0.0))
    largest = np.maximum(np.abs(harmonic).max(axis=1), np.abs(limit))
    still = largest * cycles.omega**2 < weight
    apart = np.sqrt(0.5) * blur
    return np.where(still, ahead, shown), np.where(still, apart, np.abs(ahead - shown))


def limit_of(harmonic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limit of numbers that approach it by a factor a cycle, and its standard error, (scenes,)."""
    before, after = harmonic[:, :-1], harmonic[:, 1:]
    means = before.mean(axis=1), after.mean(axis=1)
    x, y = before - means[0][:, None], after - means[1][:, None]
    square = (np.abs(x) ** 2).sum(axis=1)
    factor = (np.conj(x) * y).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    far = np.abs(1.0 - factor)
    rest = np.abs(y - factor[:, None] * x)
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = means[1] + factor * (means[1] - means[0]) / (1.0 - factor)
        error = np.sqrt((rest**2).mean(axis=1) / before.shape[1]) / far
    nears = np.abs(factor) < 1.0
    return np.where(nears, limit, np.inf), np.where(nears, error, np.inf)


def _top(ratios, curve):
    top = peak(ratios, curve)[1]
    return float(curve.max()) if np.isnan(top) else top


def _spacing(ratios, rms, highest):
    """By how much the peak of the mean changes without one of the points around it [m]."""
    curve = rms.mean(axis=1)
    around = range(max(0, highest - 1), min(len(ratios), highest + 2))
    without = (_top(np.delete(ratios, k), np.delete(curve, k)) for k in around)
    return max(abs(fewer - _top(ratios, curve)) for fewer in without)
