"""Logarithmic decrement of a decaying motion over its amplitude."""

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown

#: Fewer samples between two extremes do not show where they are.
_LEAST_SAMPLES = 8


def logarithmic_decrement(x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes [m] of a decay, and the logarithmic decrement at each of them.

    x: displacement at even times, (samples,), such as ``TimeHistory.x[:, 0, 0]``. An amplitude is
    half the way between two neighbouring extremes, so that a constant sag has no part in it; the
    decrement there is ln(a[k] / a[k + 2]), of the whole cycle around it. With a damping ratio z it
    is 2 pi z / sqrt(1 - z^2) at every amplitude; grains make it depend on the amplitude.
    Extremes are those of parabolas through three samples. A motion that has ended, or that grains
    push to and fro within a few samples, ends the decay.
    Raises InputError unless x is a series of finite numbers with four extremes at least.
    """
    series = np.asarray(x, dtype=np.float64)
    if series.ndim != 1 or not np.isfinite(series).all():
        raise InputError(f"x must be a series of finite numbers, got {shown(x)}")
    extremes = _extremes(series)
    if len(extremes) < 4:
        raise InputError(
            "x must swing to and fro at least twice, with eight samples or more from side to side, "
            f"got {len(extremes)} extremes in {len(series)} samples"
        )
    amplitude = 0.5 * np.abs(np.diff(extremes))
    decrement = np.log(amplitude[:-2] / amplitude[2:])
    return amplitude[1:-1], decrement


def _extremes(series: np.ndarray) -> np.ndarray:
    """Values at the maxima and minima in turn, as long as they are well apart."""
    step = np.diff(series)
    turns = 1 + np.flatnonzero(step[:-1] * step[1:] < 0.0)
    near = np.flatnonzero(np.diff(turns) < _LEAST_SAMPLES)
    if len(near):
        turns = turns[: near[0] + 1]
    before, at, after = series[turns - 1], series[turns], series[turns + 1]
    bend = before - 2.0 * at + after
    return at - (after - before) ** 2 / (8.0 * bend)
