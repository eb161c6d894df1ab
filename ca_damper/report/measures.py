"""Response, loss and apparent mass from sums over whole cycles of a run.

Harmonics are complex amplitudes: x(t) = mean + Re(X exp(i w t)) + higher ones, and the base motion
y = y0 sin(w t) has Y = -i y0. X comes from n samples at the beginnings of steps, F from n means
over steps, which belong to their middles and stand lower by sinc(w dt / 2): divided out.

The filling answers the container's speed V with the force F = -(c + i w m) V: this defines its
apparent damping c [N s/m] and apparent mass m [kg], and it takes the mean power c |V|^2 / 2.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.types import FloatOrArray
from taichi_dem.kit.validation import choice, real_numbers

#: Summed over the steps of a cycle; _cos and _sin: times cos(w t) and sin(w t).
SUMS = ("x", "x_squared", "x_cos", "x_sin", "v_cos", "v_sin", "f", "f_cos", "f_sin")
#: Columns of the record of a cycle; energy: of the particles, at its end [J].
COLUMNS = (*SUMS, "x_max", "x_min", "energy")
#: Units of what is sampled over time.
SAMPLE_UNITS = {"x": "m", "v": "m/s", "a": "m/s^2", "y": "m", "force": "N", "energy": "J"}
SAMPLE_UNITS["momentum"] = "kg m/s"
#: Columns of ``Batch.sample`` beside the time.
SAMPLE = tuple(SAMPLE_UNITS)
#: Measures of a response and the unit that a CSV file says behind their names.
MEASURE_UNITS = {
    "rms": "m",
    "amplitude": "m",
    "mean": "m",
    "mean_force": "N",
    "apparent_mass": "kg",
    "apparent_damping": "N_s_m",
    "loss_factor": "",
    "damping_ratio": "",
    "energy": "J",
    "rms_about_all": "m",
}
_NOT_A_NUMBER = complex(np.nan, np.nan)
#: A peak is far above the highest point of a curve where (point / peak)^2 is less than the first:
#: its parabola must then come within the second, a factor, of the next points.
_FAR_ABOVE, _OFF = 0.5, 2.0


def column_of(measure: str) -> str:
    """Name of a measure in tables and files, with its unit: "rms" -> "rms_m"."""
    unit = MEASURE_UNITS[measure]
    return f"{measure}_{unit}" if unit else measure


@dataclass(frozen=True, eq=False)
class Cycles:
    """Sums over measured cycles, and the measures made of them.

    All arrays are of shape (scenes,) unless they say otherwise.

    Parameters
    ----------
    frequency : ndarray
        Frequency of each scene [Hz].
    steps : ndarray
        Number of steps in a cycle.
    record : ndarray
        Sums of each cycle, shape (scenes, cycles, len(COLUMNS)).
    """

    frequency: np.ndarray
    steps: np.ndarray
    record: np.ndarray

    __repr__ = by_fields

    def mean_of(self, name: str) -> np.ndarray:
        """Mean of a column over cycles, shape (scenes,).

        Parameters
        ----------
        name : str
            Name of a column, one of COLUMNS.
        """
        choice("name", name, COLUMNS)
        return self.record[:, :, COLUMNS.index(name)].mean(axis=1)

    def per_step(self, name: str) -> np.ndarray:
        """Mean of a summed quantity over steps and cycles, shape (scenes,).

        Parameters
        ----------
        name : str
            Name of a column, one of SUMS.
        """
        return self.mean_of(name) / self.steps

    def harmonic(self, name: str) -> np.ndarray:
        """Complex amplitude of the first harmonic, shape (scenes,).

        Parameters
        ----------
        name : str
            ``"x"`` [m], ``"v"`` [m/s] or ``"f"`` [N].
        """
        choice("name", name, ("x", "v", "f"))
        amplitude = 2.0 * (self.per_step(f"{name}_cos") - 1j * self.per_step(f"{name}_sin"))
        if name != "f":
            return amplitude
        half = np.pi / np.asarray(self.steps, dtype=np.float64)
        return amplitude / (np.array([sine_and_cosine(a)[0] for a in half.tolist()]) / half)

    def harmonic_by_cycle(self, name: str) -> np.ndarray:
        """Complex amplitude of the first harmonic in every cycle, shape (scenes, cycles).

        Parameters
        ----------
        name : str
            ``"x"`` [m] or ``"v"`` [m/s].
        """
        choice("name", name, ("x", "v"))
        cosine, sine = (
            self.record[:, :, COLUMNS.index(f"{name}_{part}")] for part in ("cos", "sin")
        )
        return 2.0 * (cosine - 1j * sine) / np.asarray(self.steps)[:, None]

    @property
    def omega(self) -> np.ndarray:
        """Angular frequency [rad/s]."""
        return 2.0 * np.pi * self.frequency

    @property
    def rms(self) -> np.ndarray:
        """Root mean square of x about its mean in each cycle [m]: the response of the paper."""
        return np.sqrt(self._variance.mean(axis=1))

    @property
    def rms_about_all(self) -> np.ndarray:
        """Root mean square of x about its mean over all cycles [m], slow motions included."""
        # Variance within cycles, and that of their means: no difference of large numbers.
        means = self.record[:, :, COLUMNS.index("x")] / np.asarray(self.steps)[:, None]
        return np.sqrt(self._variance.mean(axis=1) + means.var(axis=1))

    @property
    def rms_by_cycle(self) -> np.ndarray:
        """The same of every cycle [m], (scenes, cycles)."""
        return np.sqrt(self._variance)

    @property
    def _variance(self):
        """Mean square of x about its mean in each cycle [m^2], (scenes, cycles)."""
        totals = [self.record[:, :, COLUMNS.index(name)] for name in ("x_squared", "x")]
        square, mean = (total / self.steps[:, None] for total in totals)
        return np.maximum(square - mean**2, 0.0)

    @property
    def amplitude(self) -> np.ndarray:
        """Half the distance from lowest to highest x [m], mean over cycles."""
        return 0.5 * (self.mean_of("x_max") - self.mean_of("x_min"))

    @property
    def mean(self) -> np.ndarray:
        """Mean displacement [m]."""
        return self.per_step("x")

    @property
    def mean_force(self) -> np.ndarray:
        """Mean force of the filling on the container [N]; -N m g in the long run."""
        return self.per_step("f")

    @property
    def energy(self) -> np.ndarray:
        """Energy of the particles at the ends of cycles [J], mean."""
        return self.mean_of("energy")

    @property
    def impedance(self) -> np.ndarray:
        """Of the filling, -F / V = c + i w m [N s/m]; NaN where the container does not move."""
        force, speed = self.harmonic("f"), self.harmonic("v")
        still = speed == 0.0
        # A scene that diverged is NaN.
        with np.errstate(invalid="ignore"):
            return np.where(still, _NOT_A_NUMBER, 0.0 - force / np.where(still, 1.0, speed))

    @property
    def apparent_mass(self) -> np.ndarray:
        """Mass that the container feels at this frequency beside its own [kg]."""
        return self.impedance.imag / self.omega

    @property
    def apparent_damping(self) -> np.ndarray:
        """Damping coefficient that the filling adds [N s/m]."""
        return self.impedance.real

    @property
    def complex_power(self) -> np.ndarray:
        """Mean power that the filling takes [W], and i times its reactive power."""
        return -0.5 * self.harmonic("f") * np.conj(self.harmonic("v"))

    def loss_factor(self, mass: FloatOrArray) -> np.ndarray:
        """Energy that the filling takes in a radian over the energy in motion, c / (w (M + m)).

        Parameters
        ----------
        mass : float or ndarray
            Mass M of the container [kg], (scenes,) or one for all.

        Returns
        -------
        ndarray
            Loss factor [-]; 0 for a rigid mass.

        Notes
        -----
        The energy in motion is that of the container and the apparent mass m at the largest speed.
        """
        mass = real_numbers("mass", mass, 0.0)
        return self.apparent_damping / (self.omega * (mass + self.apparent_mass))

    def damping_ratio(
        self, mass: FloatOrArray, stiffness: FloatOrArray, damping: FloatOrArray
    ) -> np.ndarray:
        """Effective share of critical damping, (C + c) / (2 sqrt(K (M + m))).

        Parameters
        ----------
        mass : float or ndarray
            Mass M of the container [kg].
        stiffness : float or ndarray
            Stiffness K of the primary structure [N/m].
        damping : float or ndarray
            Damping C of the primary structure [N s/m].

        Returns
        -------
        ndarray
            Damping ratio [-].
        """
        mass, stiffness = real_numbers("mass", mass, 0.0), real_numbers("stiffness", stiffness, 0.0)
        critical = 2.0 * np.sqrt(stiffness * (mass + self.apparent_mass))
        return (real_numbers("damping", damping, 0.0) + self.apparent_damping) / critical


def first_harmonic(phase: ArrayLike, values: ArrayLike) -> tuple[float, float]:
    """Amplitude of a quantity over a cycle, and its lag [degrees] behind sin(2 pi phase)."""
    # Least squares, so that phases need no even spacing.
    angle = 2.0 * np.pi * np.asarray(phase)
    columns = np.column_stack([np.ones_like(angle), np.sin(angle), np.cos(angle)])
    _, sine, cosine = np.linalg.lstsq(columns, np.asarray(values), rcond=None)[0]
    return float(np.hypot(sine, cosine)), float(np.degrees(np.arctan2(-cosine, sine)))


def peak(frequency_ratio: ArrayLike, response: ArrayLike) -> tuple[float, float]:
    """Where a response curve peaks and how high it is there: (ratio, response), floats."""
    # A parabola of 1 / response^2 over ratio^2 is exact for a linear oscillator up to (2 damping
    # ratio)^2. If it misses the next points it goes through noise: then one of the response itself.
    x, y = np.asarray(frequency_ratio, dtype=float), np.asarray(response, dtype=float)
    k = -1 if np.isnan(y).all() else int(np.nanargmax(y))
    if not 0 < k < len(y) - 1 or not (y[k] > 0.0 and y[k - 1] == y[k - 1] and y[k + 1] == y[k + 1]):
        return np.nan, np.nan
    # Relative to the highest point, so that no square leaves the range of numbers.
    with np.errstate(divide="ignore", over="ignore"):
        low = (y[k] / y) ** 2
    near = slice(k - 1, k + 2)
    square, lowest = vertex(x[near] ** 2, low[near])
    if not lowest > 0.0 or (lowest < _FAR_ABOVE and _misses(x**2, low, k)):
        # No resonance between the points; the curve itself is the smoother one.
        square, height = vertex(x[near] ** 2, -y[near])
        return float(np.sqrt(square)), float(-height)
    return float(np.sqrt(square)), float(y[k] / np.sqrt(lowest))


def _misses(x, low, k):
    """Whether the parabola about point k is off by a factor at a point next to the three."""
    x0, x1, x2 = x[k - 1 : k + 2]
    left = (low[k] - low[k - 1]) / (x1 - x0)
    bend = ((low[k + 1] - low[k]) / (x2 - x1) - left) / (x2 - x0)
    beyond = [j for j in (k - 2, k + 2) if 0 <= j < len(x) and np.isfinite(low[j])]
    misses = [(low[k - 1] + (x[j] - x0) * (left + bend * (x[j] - x1))) / low[j] for j in beyond]
    return any(not 1.0 / _OFF < share < _OFF for share in misses)


def vertex(x: ArrayLike, y: ArrayLike) -> tuple[float, float]:
    """Lowest point (x, y) of the parabola through three points, the second of them the lowest."""
    (x0, x1, x2), (y0, y1, y2) = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    left, right = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    bend = (right - left) / (x2 - x0)
    if not 0.0 < bend < np.inf:
        return float(x1), float(y1)
    # Newton's form through the first two: slope left + bend (2 x - x0 - x1) is zero at the top.
    top = 0.5 * (x0 + x1 - left / bend)
    return float(top), float(y1 + (top - x1) * (left + bend * (top - x0)))
