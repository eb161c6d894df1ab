"""A function of time on a uniform grid, with a smooth interpolant: the form of every excitation.

The interpolant is a cubic spline with two continuous derivatives, so that displacement, velocity
and acceleration of a base belong to one motion. In the interval of length h from node 0 to node 1,
with u = (t - t0) / h, w = 1 - u, values y and second derivatives m,

    y(t) = w y0 + u y1 + h^2 / 6 ((w^3 - w) m0 + (u^3 - u) m1).

An acceleration gives the m themselves; for samples of the function they follow from continuity
(de Boor, A Practical Guide to Splines, chapter IV, with the condition "not a knot").
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import (
    LARGEST,
    between,
    instance,
    positive,
    real_numbers,
    shown,
)

#: Nodes of a signal: fewer determine no spline with "not a knot", more find no memory.
LEAST_NODES, MOST_NODES = 4, 2**24
# What is rounding, as a share of the largest value.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Signal:
    """A smooth function of time from t = 0, such as a base displacement [m] or a force [N].

    A cubic spline with two continuous derivatives, by functions of ``ca_damper.excitation``.

    Parameters
    ----------
    step : float
        Time between nodes [s].
    value : ndarray
        Values at the nodes, shape (nodes,).
    bend : ndarray
        Second derivative at the nodes, shape (nodes,).
    label : str, default "signal"
        Description in words.
    treated : str, default ""
        Treatment of samples before the signal was made, in words.
    apart : float, default 0.0
        Time between the samples that it was made of [s]; 0 for a formula.
    gap : float, default 0.0
        Longest gap between samples that was bridged [s].

    References
    ----------
    de Boor, A Practical Guide to Splines, chapter IV ("not a knot").
    """

    step: float
    value: np.ndarray
    bend: np.ndarray
    label: str = "signal"
    treated: str = ""
    apart: float = 0.0
    gap: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "step", positive("step", self.step))
        instance("label", self.label, str)
        for name in ("value", "bend"):
            object.__setattr__(self, name, nodes(name, getattr(self, name)))
        if len(self.value) != len(self.bend):
            raise InputError(
                f"bend must have as many nodes as value, {len(self.value)}, got {len(self.bend)}"
            )

    def __repr__(self) -> str:
        size = f"{counted(len(self.value), 'node')} in {self.duration:.6g} s"
        return in_brief(self, self.label, size, f"largest {np.abs(self.value).max():.4g}")

    @property
    def duration(self) -> float:
        """Time of the last node [s]."""
        return self.step * (len(self.value) - 1)

    def at(self, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value, first and second derivative at given times, as kernels evaluate them.

        Parameters
        ----------
        time_s : ndarray
            Times within the duration [s], any shape.
        """
        place = real_numbers("time_s", time_s) / self.step
        k = np.clip(np.floor(place).astype(np.int64), 0, len(self.value) - 2)
        u, h = place - k, self.step
        w = 1.0 - u
        y0, y1, m0, m1 = self.value[k], self.value[k + 1], self.bend[k], self.bend[k + 1]
        value = w * y0 + u * y1 + h * h / 6.0 * ((w**3 - w) * m0 + (u**3 - u) * m1)
        slope = (y1 - y0) / h + h / 6.0 * ((3.0 * u * u - 1.0) * m1 - (3.0 * w * w - 1.0) * m0)
        return value, slope, w * m0 + u * m1

    def scaled(self, factor: float) -> "Signal":
        """Return the signal multiplied by a factor.

        Parameters
        ----------
        factor : float
            Factor; ``treated`` stays the same.
        """
        between("factor", factor, -LARGEST, LARGEST)
        label, times = f"{factor:g} times {self.label}", float(factor)
        return replace(self, value=times * self.value, bend=times * self.bend, label=label)

    def in_words(self, unit: str) -> str:
        """Origin, length, treatment of samples, and both ends of the signal."""
        values, slopes, _ = self.at(np.array([0.0, self.duration]))
        size = _ROUNDING * np.abs(self.value).max()
        values, slopes = _unless_tiny(values, size), _unless_tiny(slopes, size / self.step)
        begin, end = (f"at {y:.3g} {unit} and {v:.3g} {unit}/s" for y, v in zip(values, slopes))
        done = f"{self.treated}; " if self.treated else ""
        return f"{self.label}, {self.duration:.4g} s; {done}begins {begin}, ends {end}"


def _unless_tiny(values, size):
    """Values, 0 for those that are rounding."""
    return np.where(np.abs(values) <= size, 0.0, values)


def spline(step: float, value: np.ndarray, label: str) -> Signal:
    """Signal through values at the nodes."""
    from scipy.interpolate import CubicSpline

    # In steps, whose number is exact.
    value, count = nodes("value", value), np.arange(len(value))
    return Signal(step, value, CubicSpline(count, value)(count, 2) / step**2, label)


def integral(step: float, bend: np.ndarray, label: str) -> Signal:
    """Signal that begins at rest in zero, from its second derivative at the nodes: exact."""
    bend = nodes("bend", bend)
    first, second = bend[:-1], bend[1:]
    slope = np.concatenate([[0.0], np.cumsum(0.5 * step * (first + second))])
    more = step * slope[:-1] + step**2 / 6.0 * (2.0 * first + second)
    return Signal(step, np.concatenate([[0.0], np.cumsum(more)]), bend, label)


def end_slope(signal: Signal) -> float:
    """First derivative at the end of a signal."""
    return float(signal.at(np.array([signal.duration]))[1][0])


def nodes(name: str, values: ArrayLike) -> np.ndarray:
    """A copy of finite numbers (nodes,) that refuses to be written."""
    numbers = real_numbers(name, values)
    if numbers.ndim != 1 or not LEAST_NODES <= len(numbers) <= MOST_NODES:
        raise InputError(
            f"{name} must be from {LEAST_NODES} to {MOST_NODES} numbers, got {shown(values)}"
        )
    numbers.flags.writeable = False
    return numbers
