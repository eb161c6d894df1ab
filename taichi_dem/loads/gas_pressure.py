"""Pressure of the blast gas on the wall of the hole (Konno et al., 4.1, eq. 4, Fig. 11)."""

import math

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_dem.kit.elementary import sine_and_cosine, sine_shortfall
from taichi_dem.kit.likely_units import BLAST_RISE, PRESSURE, in_unit
from taichi_dem.kit.validation import positive, real_numbers, word
from taichi_dem.loads.pressure import FacePressure
from taichi_dem.materials import Material


@ti.pyfunc
def pulse(peak, rise, decay_ratio, t):
    """Pressure [Pa] of eq. 4: a squared cosine up to the peak, a cosine down to zero."""
    pressure = 0.0
    s = t / rise - 1.0
    if 0.0 <= t and s <= 0.0:
        _, swing = sine_and_cosine(0.5 * math.pi * s)
        pressure = peak * (swing * swing)
    elif 0.0 < s and s <= decay_ratio:
        _, swing = sine_and_cosine(0.5 * math.pi * s / decay_ratio)
        pressure = peak * swing
    return pressure


@ti.func
def mean_pulse(peak, rise, decay_ratio, since, until):
    """Mean of ``pulse`` [Pa] from a time to a later one.

    The mean of a cosine is its value in the middle times sin(w) / w, w half of the angle, which
    for a short time is 1: nothing is lost to rounding at any step.
    """
    end, mean = (1.0 + decay_ratio) * rise, 0.0
    low, high = ti.max(since, 0.0), ti.min(until, rise)
    if low < high:
        less = sine_shortfall(0.5 * math.pi * (high - low) / rise)
        middle = pulse(peak, rise, decay_ratio, 0.5 * (low + high))
        mean += (high - low) / (until - since) * (middle - less * (middle - 0.5 * peak))
    low, high = ti.max(since, rise), ti.min(until, end)
    if low < high:
        less = sine_shortfall(0.25 * math.pi * (high - low) / (decay_ratio * rise))
        middle = pulse(peak, rise, decay_ratio, 0.5 * (low + high))
        mean += (high - low) / (until - since) * (1.0 - less) * middle
    return mean


@ti.data_oriented
class GasPressure(FacePressure):
    """Pressure on the faces of a group along their current normal, also after they came loose.

    Parameters
    ----------
    group : str, default "hole"
        Name of the face group.
    peak : float, default 575000000.0
        Peak pressure [Pa].
    rise : float, default 0.000133
        Time to the peak [s].
    decay_ratio : float, default 2.75
        Ratio of the time from the peak to zero to the rise.
    start : float, default 0.0
        Time at which the pressure begins [s]: holes with a ``GasPressure`` each fire one after the
        other.

    Raises
    ------
    InputError
        A value is out of its range.

    Notes
    -----
    The pressure is a squared cosine up to the peak and a cosine down to zero. The area is that of
    the mesh.

    References
    ----------
    Konno et al., section 4.1, eq. 4, Fig. 11.

    Examples
    --------
    >>> gas = GasPressure(rise=1e-4, decay_ratio=3.0)
    >>> round(gas.duration, 6)
    0.0004
    """

    name = "gas_pressure"

    def __init__(
        self,
        group: str = "hole",
        peak: float = 575e6,
        rise: float = 1.33e-4,
        decay_ratio: float = 2.75,
        start: float = 0.0,
    ):
        self.group = word("group", group)
        self.peak = in_unit("peak", positive("peak", peak), PRESSURE)
        self.rise = in_unit("rise", positive("rise", rise), BLAST_RISE)
        self.decay_ratio = positive("decay_ratio", decay_ratio)
        self.start = positive("start", start, zero_allowed=True)

    @property
    def duration(self) -> float:
        """Time from its start until there is no pressure any more [s]."""
        return (self.decay_ratio + 1.0) * self.rise

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Peak [Pa], rise [s], decay ratio and start [s]."""
        return self.peak, self.rise, self.decay_ratio, self.start

    def stress(self, material: Material, size: float) -> float:
        """The peak pressure."""
        return self.peak

    def change_time(self) -> float:
        """Time to the peak, or from there to zero."""
        return self.rise * min(1.0, self.decay_ratio)

    @ti.func
    def changes(self, since, until):
        """Nonzero where there is pressure between two times [s]."""
        end = self.law[3] + (1.0 + self.law[2]) * self.law[1]
        return since < end and self.law[3] < until

    @ti.func
    def mean_pressure(self, since, until):
        """Mean pressure [Pa] from a time to a later one [s]."""
        start = self.law[3]
        return mean_pulse(self.law[0], self.law[1], self.law[2], since - start, until - start)

    def pressure_at(self, times: ArrayLike) -> np.ndarray:
        """Pressure at given times, for pictures.

        Parameters
        ----------
        times : array_like
            Times [s].

        Returns
        -------
        ndarray
            Pressure [Pa].
        """
        since = real_numbers("times", times) - self.start
        at = np.vectorize(pulse, otypes=[float])
        return at(self.peak, self.rise, self.decay_ratio, since)
