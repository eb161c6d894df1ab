"""The impact damper in closed form: one grain that meets floor and ceiling in turn.

Source: Masri, J. Acoust. Soc. Am. 47 (1970) 229; Bapat and Sankar, J. Sound Vib. 99 (1985) 85. No
gravity, sudden blows, and two symmetric ones in a cycle of the base.

The motion turns over in half a cycle, x(t + T/2) = -x(t), and obeys the linear equation of the
empty container but for the impulses +J at t = 0 (ceiling) and -J at T/2 (floor).

Response to the impulses: x = J q(t), free motion with q'(0+) = q'(0-) + 1 / M, q(T/2) = -q(0) and
q'(T/2) = -q'(0-): two linear equations for q(0) and q'(0+). The grain, of mass m, leaves the
ceiling at -u and the floor at u, so J = 2 m u. It meets the ceiling at x0 = x(0) and the floor at
-x0, the clearance D lower: u T / 2 = D + 2 x0. With v = x'(0-), restitution asks for
(v + J / M) + u = e (u - v), so v = u (e - 1 - 2 m / M) / (1 + e). Of the forced motion
X sin(w t + phase) it follows that X sin(phase) = x0 - J q(0) and w X cos(phase) = v - J q'(0-);
squares add up to X^2: a quadratic equation for u.

Small changes of a motion follow the Jacobian of its map from impact to impact, of the place x and
speed v of the container, the velocity p of the grain, and the time t of the blow. At T/2 those of x
and v have grown to free(T/2) (dx - x' dt, dv - v' dt), that of the grain's place to
dx + dp T/2 + u dt. The next blow is later by their gap over the speed at which they meet.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ca_damper.oscillator import Oscillator
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import LARGEST, between, instance, plain_fields, positive, told_apart

#: Points of half a cycle: an odd number, for Simpson's rule.
_POINTS = 401
_ROUNDING = 1e-12


@dataclass(frozen=True)
class ImpactDamper:
    """A grain between the floor and the ceiling of a container that is shaken by a sine.

    Methods take the speed u of the grain [m/s], one of ``speeds``.

    Parameters
    ----------
    oscillator : Oscillator
        Container on its spring.
    particle_mass : float
        Mass of the grain [kg].
    restitution : float
        Restitution coefficient of its impacts, from 0 to 1.
    clearance : float
        Distance that it can move between floor and ceiling [m].
    frequency : float
        Frequency of the base [Hz].

    References
    ----------
    Masri, J. Acoust. Soc. Am. 47 (1970) 229; Bapat and Sankar, J. Sound Vib. 99 (1985) 85.

    Examples
    --------
    >>> damper = ImpactDamper(Oscillator(), 8e-3, 0.75, 0.012, frequency=6.0)
    >>> [(round(float(u), 3), damper.is_stable(u)) for u in damper.speeds]
    [(0.192, True)]
    """

    oscillator: Oscillator
    particle_mass: float
    restitution: float
    clearance: float
    frequency: float

    def __post_init__(self) -> None:
        plain_fields(self)
        for name in ("particle_mass", "clearance", "frequency"):
            positive(name, getattr(self, name))
        between("restitution", self.restitution, 0.0, 1.0)
        instance("oscillator", self.oscillator, Oscillator)
        ratio = self.oscillator.damping_ratio
        if not ratio < 1.0:
            got, bound = told_apart(ratio, 1.0)
            raise InputError(f"damping_ratio of the oscillator must be below {bound}, got {got}")

    @property
    def mass_ratio(self) -> float:
        """Ratio of the mass of the grain to that of the container."""
        return self.particle_mass / self.oscillator.mass

    @property
    def half_cycle(self) -> float:
        """Half a cycle of the base [s]."""
        return 0.5 / self.frequency

    @property
    def omega(self) -> float:
        """Angular frequency of the base [rad/s]."""
        return 2.0 * math.pi * self.frequency

    @cached_property
    def speeds(self) -> tuple[float, ...]:
        """Speeds between the impacts [m/s] of all such motions; none if there is no motion."""
        (a, b), (c, d) = self._forced
        size = self.oscillator.base_amplitude * abs(self.oscillator.transfer(self.frequency))
        square = [a * a + c * c, 2.0 * (a * b + c * d), b * b + d * d - size * size]
        return tuple(r.real for r in np.roots(square) if abs(r.imag) < _ROUNDING and r.real > 0.0)

    @cached_property
    def _after(self) -> np.ndarray:
        """(q, q') after the blow on the ceiling, for a unit impulse."""
        turned = self.free(self.half_cycle) + np.eye(2)
        return np.linalg.solve(turned, [0.0, 1.0 / self.oscillator.mass])

    @cached_property
    def approach(self) -> float:
        """Ratio of the container's velocity before the ceiling's impact to the grain's speed."""
        return (self.restitution - 1.0 - 2.0 * self.mass_ratio) / (1.0 + self.restitution)

    @cached_property
    def _forced(self) -> np.ndarray:
        """X sin(phase) and X cos(phase) of the forced motion [m]: factors of u, and constants."""
        place, speed = self._after - [0.0, 1.0 / self.oscillator.mass]
        a = 0.5 * self.half_cycle - 2.0 * self.particle_mass * place
        b = (self.approach - 2.0 * self.particle_mass * speed) / self.omega
        return np.array([[a, -0.5 * self.clearance], [b, 0.0]])

    def free(self, t: float) -> np.ndarray:
        """Matrix (2, 2) that takes (x [m], v [m/s]) of the free container on by a time.

        Parameters
        ----------
        t : float
            Time [s].
        """
        own = self.oscillator
        decay, square = 0.5 * own.damping / own.mass, own.stiffness / own.mass
        turn = math.sqrt(square - decay * decay)
        t = between("t", t, -LARGEST, LARGEST)
        c, s = math.cos(turn * t), math.sin(turn * t) / turn
        return math.exp(-decay * t) * np.array([[c + decay * s, s], [-square * s, c - decay * s]])

    def motion(self, u: float, t: float) -> np.ndarray:
        """Displacement [m] and velocity [m/s] of the container, a time after a blow on the ceiling.

        Parameters
        ----------
        u : float
            Speed of the grain [m/s].
        t : float
            Time, from 0 to half a cycle [s].
        """
        u, t = between("u", u, -LARGEST, LARGEST), between("t", t, -LARGEST, LARGEST)
        free = 2.0 * self.particle_mass * u * self.free(t) @ self._after
        return self._forced_motion(u, t) + free

    def _forced_motion(self, u, t):
        """Forced part of the container's displacement [m] and velocity [m/s]."""
        sine, cosine = self._forced @ [u, 1.0]
        c, s = math.cos(self.omega * t), math.sin(self.omega * t)
        return np.array([sine * c + cosine * s, self.omega * (cosine * c - sine * s)])

    def position(self, u: float, t: float) -> float:
        """Position of the grain at that time [m], from where the middle of the box is at x = 0.

        Parameters
        ----------
        u : float
            Speed of the grain [m/s].
        t : float
            Time since the impact on the ceiling [s].
        """
        u, t = between("u", u, -LARGEST, LARGEST), between("t", t, -LARGEST, LARGEST)
        return 0.5 * u * self.half_cycle - u * t

    def start(self, u: float) -> Any:
        """(x [m], v [m/s]) of container and grain as the base passes zero upwards, shape (2, 2).

        Parameters
        ----------
        u : float
            Speed of the grain [m/s].

        Notes
        -----
        The phase of the forced motion is then that of the transfer function.
        """
        sine, cosine = self._forced @ [between("u", u, -LARGEST, LARGEST), 1.0]
        turn = np.angle(self.oscillator.transfer(self.frequency)) - math.atan2(sine, cosine)
        since = turn / self.omega
        t = since % self.half_cycle
        sign = 1.0 if round((since - t) / self.half_cycle) % 2 == 0 else -1.0
        return sign * np.array([self.motion(u, t), [self.position(u, t), -u]])

    def multipliers(self, u: float) -> np.ndarray:
        """Complex factors by which small changes grow between impacts, the largest first."""
        multipliers = np.linalg.eigvals(self._jacobian(u))
        return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]

    def is_stable(self, u: float) -> bool:
        """Whether small changes of the motion die away: all ``multipliers`` in the unit circle.

        Parameters
        ----------
        u : float
            Speed of the grain [m/s].
        """
        return bool(np.abs(self.multipliers(u)).max() < 1.0)

    def _jacobian(self, u):
        """Jacobian (4, 4) of the map from blow to blow, of x, v, p and t as at the top."""
        half, x, v, p, t = self.half_cycle, *np.eye(4)
        left, arrived = (np.array([self.motion(u, at)[1], self._pull(u, at)]) for at in (0.0, half))
        place, speed = self.free(half) @ (np.array([x, v]) - np.outer(left, t))
        meeting = -u - arrived[0]
        later = (place - (x + half * p + u * t)) / meeting
        place, speed = place + arrived[0] * later, speed + arrived[1] * later
        blow = (1.0 + self.restitution) * (p - speed) / (1.0 + self.mass_ratio)
        return np.array([-place, -speed - self.mass_ratio * blow, blow - p, later])

    def _pull(self, u, t):
        """Acceleration of the container [m/s^2], between the blows."""
        own, forced = self.oscillator, self._forced_motion(u, t)
        x, v = self.motion(u, t) - forced
        free = -(own.stiffness * x + own.damping * v) / own.mass
        return float(free - self.omega**2 * forced[0])

    def rms(self, u: float) -> float:
        """RMS displacement of the container over a cycle [m], by Simpson's rule.

        Parameters
        ----------
        u : float
            Speed of the grain [m/s].
        """
        times = np.linspace(0.0, self.half_cycle, _POINTS)
        squares = np.array([self.motion(u, t)[0] ** 2 for t in times])
        inner = 4.0 * squares[1::2].sum() + 2.0 * squares[2:-1:2].sum()
        return math.sqrt((inner + squares[0] + squares[-1]) / (3.0 * (_POINTS - 1)))
