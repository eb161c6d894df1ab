"""Logarithmic decrement of a decaying motion over its amplitude."""

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import real_numbers, shown

#: Fewer samples between two extremes do not show where they are.
_LEAST_SAMPLES = 8


def logarithmic_decrement(x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes of a decay, and the logarithmic decrement at each of them.

    Parameters
    ----------
    x : array_like
        Displacement at even times [m], shape (samples,), such as ``TimeHistory.x[:, 0, 0]``.

    Returns
    -------
    tuple of (ndarray, ndarray)
        Amplitudes [m] and decrements [-], shape (extremes - 3,) each.

    Notes
    -----
    An amplitude is half the distance between two neighbouring extremes, so that a constant sag has
    no part in it. The decrement there is ln(a[k] / a[k + 2]), of the whole cycle around it; a
    damping ratio z gives 2 pi z / sqrt(1 - z^2) at every amplitude. It ends as the motion does.

    Examples
    --------
    >>> time = np.arange(4000) * 1e-3
    >>> size, decrement = logarithmic_decrement(np.exp(-0.1 * time) * np.sin(2 * np.pi * 5 * time))
    >>> round(float(decrement[0]), 4)
    0.02
    """
    series = real_numbers("x", x)
    if series.ndim != 1:
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
    step = np.diff(series)
    turns = 1 + np.flatnonzero(step[:-1] * step[1:] < 0.0)
    near = np.flatnonzero(np.diff(turns) < _LEAST_SAMPLES)
    if len(near):
        turns = turns[: near[0] + 1]
    before, at, after = series[turns - 1], series[turns], series[turns + 1]
    bend = before - 2.0 * at + after
    return at - (after - before) ** 2 / (8.0 * bend)
