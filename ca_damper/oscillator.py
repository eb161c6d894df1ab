"""The primary structure: one degree of freedom on a moving base (Komatsuzaki et al., 4.1, Table 1).

M x'' + C x' + K x = K y + C y' + f_p with y = y0 sin(2 pi f t), x up positive. The paper prints no
y0; 0.6 mm lets the empty container peak at 24.4 mm, near the +-25 mm of its Figs 9 and 10.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.types import FloatOrArray
from taichi_dem.kit.validation import plain_fields, positive, real_numbers

#: Ratio x / y beyond which nothing but rounding bounds the motion.
UNBOUNDED = 1e13


def check_steady(what: str, ratio: Any, frequency: ArrayLike) -> None:
    """Raise InputError where nothing bounds the motion at one of the frequencies [Hz]."""
    unheld = ~(np.abs(ratio) < UNBOUNDED)
    if unheld.any():
        at = np.broadcast_to(frequency, unheld.shape)[unheld][0]
        raise InputError(
            f"{what} without damping has no steady state at its natural frequency, got "
            f"{at:.6g} Hz: give it damping, or take another frequency"
        )


@dataclass(frozen=True)
class Oscillator:
    """Container on a spring and dashpot, whose base moves as y0 sin(2 pi f t) (section 4.1).

    Parameters
    ----------
    mass : float, default 0.086
        Mass M of the empty container [kg].
    stiffness : float, default 123.4
        Stiffness K [N/m].
    damping : float, default 0.08
        Damping C [N s/m].
    base_amplitude : float, default 0.0006
        Amplitude y0 of the base [m]. The paper prints none; 0.6 mm lets the empty container peak at
        24.4 mm, near the +-25 mm of its Figs 9 and 10.
    """

    mass: float = 0.086
    stiffness: float = 123.4
    damping: float = 0.08
    base_amplitude: float = 0.6e-3

    def __post_init__(self):
        plain_fields(self)
        positive("mass", self.mass)
        positive("stiffness", self.stiffness)
        positive("damping", self.damping, zero_allowed=True)
        positive("base_amplitude", self.base_amplitude, zero_allowed=True)

    @property
    def natural_frequency(self) -> float:
        """Undamped natural frequency with the container empty [Hz]."""
        return math.sqrt(self.stiffness / self.mass) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """Share of critical damping, with the container empty."""
        return self.damping / (2.0 * math.sqrt(self.stiffness * self.mass))

    def transfer(self, frequency: ArrayLike, added_mass: FloatOrArray = 0.0) -> Any:
        """Complex ratio x / y [-] of the steady state.

        Parameters
        ----------
        frequency : array_like
            Frequency of the base [Hz].
        added_mass : float or ndarray, default 0.0
            Mass that moves with the container [kg].

        Raises
        ------
        InputError
            There is no steady state: at the natural frequency without damping.
        """
        ratio = self._ratio(frequency, added_mass)
        check_steady("an oscillator", ratio, frequency)
        return ratio

    def _ratio(self, frequency: ArrayLike, added_mass: FloatOrArray) -> Any:
        """The same, no finite number where there is no steady state."""
        omega = 2.0 * np.pi * real_numbers("frequency", frequency)
        held = self.stiffness + 1j * omega * self.damping
        free = held - (self.mass + real_numbers("added_mass", added_mass)) * omega**2
        if np.ndim(free) == 0 and free == 0.0:
            # Python divides plain numbers, and refuses.
            return complex(np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            return held / free

    def scaled(self, mass: float, base_amplitude: float) -> "Oscillator":
        """Return an oscillator of the same frequency and damping ratio.

        Parameters
        ----------
        mass : float
            Its mass [kg].
        base_amplitude : float
            Its amplitude of the base [m].
        """
        share = positive("mass", mass) / self.mass
        return Oscillator(mass, share * self.stiffness, share * self.damping, base_amplitude)

    def peak(self, added_mass: float = 0.0) -> tuple[float, float]:
        """Peak of the steady state over frequency.

        Parameters
        ----------
        added_mass : float, default 0.0
            Mass that moves with the container [kg].

        Returns
        -------
        tuple of (float, float)
            Frequency ratio [-] and RMS displacement [m], infinite without damping.

        Notes
        -----
        For a damping ratio z, the peak lies at r with r^2 = (sqrt(1 + 8 z^2) - 1) / (4 z^2).
        """
        mass = self.mass + positive("added_mass", added_mass, zero_allowed=True)
        square = self.damping**2 / (4.0 * self.stiffness * mass)
        # The same without a difference of equals, and without a division by zero damping.
        own = math.sqrt(2.0 / (math.sqrt(1.0 + 8.0 * square) + 1.0))
        ratio = own * math.sqrt(self.mass / mass)
        return ratio, float(self.rms(ratio * self.natural_frequency, added_mass))

    def rms(self, frequency: ArrayLike, added_mass: FloatOrArray = 0.0) -> Any:
        """RMS displacement [m] of the steady state; infinite at resonance without damping.

        Parameters
        ----------
        frequency : array_like
            Frequency of the base [Hz].
        added_mass : float or ndarray, default 0.0
            Mass that moves with the container [kg].
        """
        gain = abs(self._ratio(frequency, added_mass))
        gain = np.where(gain < UNBOUNDED, gain, np.inf)[()]
        return self.base_amplitude * gain / np.sqrt(2.0)

    def right_hand_side(self, frequency: float) -> Callable[[float, Any], np.ndarray]:
        """d(x, v)/dt of the empty container, for ``scipy.integrate.solve_ivp``.

        Parameters
        ----------
        frequency : float
            Frequency of the base [Hz].

        Returns
        -------
        callable
            Function of time [s] and state (x [m], v [m/s]).
        """
        omega = 2.0 * np.pi * positive("frequency", frequency, zero_allowed=True)

        def slope(t: float, state: Any) -> np.ndarray:
            y, rate = np.sin(omega * t), omega * np.cos(omega * t)
            push = self.base_amplitude * (self.stiffness * y + self.damping * rate)
            pull = push - self.stiffness * state[0] - self.damping * state[1]
            return np.array([state[1], pull / self.mass])

        return slope

    def steady_state(
        self, frequency: ArrayLike, added_mass: FloatOrArray = 0.0, gravity: float = 0.0
    ) -> tuple[Any, Any]:
        """State (x [m], v [m/s]) of the steady motion when the base passes upwards through zero.

        Parameters
        ----------
        frequency : array_like
            Frequency of the base [Hz].
        added_mass : float or ndarray, default 0.0
            Mass that moves with the container and hangs on the spring by its weight [kg].
        gravity : float, default 0.0
            Gravity, downwards [m/s^2].
        """
        x = self.base_amplitude * self.transfer(frequency, added_mass)
        sag = real_numbers("gravity", gravity) * np.asarray(added_mass) / self.stiffness
        return x.imag - sag, 2.0 * np.pi * np.asarray(frequency) * x.real
