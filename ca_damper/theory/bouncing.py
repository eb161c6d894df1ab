"""A particle that falls and bounces on a floor at rest: the closed form, and a recorded fall."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Fall:
    """Fall from a height [m] at rest, with rebounds of one restitution, in closed form."""

    height: float
    restitution: float
    gravity: float

    @property
    def first_s(self) -> float:
        """Time of the first impact [s]."""
        return math.sqrt(2.0 * self.height / self.gravity)

    def impact_s(self, k: int) -> float:
        """Time of impact k = 1, 2, ... [s]: the flight after impact j lasts 2 e^j t_1."""
        e = self.restitution
        return self.first_s * (1.0 + 2.0 * sum(e**j for j in range(1, k)))

    def apex_m(self, k: int) -> float:
        """Height reached after impact k [m]."""
        return self.height * self.restitution ** (2 * k)

    def heights(self, time_s: np.ndarray) -> np.ndarray:
        """Height [m] at ascending times [s], (n,)."""
        starts, k = [-self.first_s], 1
        while self.impact_s(k) < time_s[-1]:
            starts.append(self.impact_s(k))
            k += 1
        passed = np.searchsorted(starts, time_s, side="right") - 1
        since = time_s - np.array(starts)[passed]
        rise = self.gravity * self.first_s * self.restitution**passed
        return since * (rise - 0.5 * self.gravity * since)


@dataclass(frozen=True, eq=False)
class RecordedFall:
    """A particle that fell: samples while it flew, its impacts [s] and apexes after them [m]."""

    fall: Fall
    time_s: np.ndarray
    height_m: np.ndarray
    impacts_s: np.ndarray
    apexes_m: np.ndarray

    @classmethod
    def of(cls, history: Mapping[str, np.ndarray], fall: Fall, mass: float) -> "RecordedFall":
        """From the history of a ``film`` of one particle; mass: of it [kg]."""
        # Height and velocity follow from energy and momentum; the parabolas before and after an
        # impact, of equal gravity, cross where the particle turned.
        free = history["force"] == 0.0
        time, velocity = history["time_s"][free], history["momentum"][free] / mass
        height = history["energy"][free] / (mass * fall.gravity) - 0.5 * velocity**2 / fall.gravity
        # Over where the particle lies on the floor.
        height = height - height[0] + fall.height
        before = np.flatnonzero((velocity[:-1] < 0.0) & (velocity[1:] > 0.0))
        gap, h, v = np.diff(time)[before], height, velocity
        lost = h[before + 1] - h[before] - gap * (v[before + 1] + 0.5 * fall.gravity * gap)
        impacts = time[before] + lost / (v[before] - v[before + 1] - fall.gravity * gap)
        apexes = [part.max() for part in np.split(height, before + 1)[1:]]
        return cls(fall, time, height, impacts, np.array(apexes))

    def errors(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Errors of the first impacts [s] and of apexes after them [m], as many as there are."""
        first = range(1, 1 + min(count, len(self.impacts_s)))
        late = self.impacts_s[: len(first)] - [self.fall.impact_s(k) for k in first]
        high = self.apexes_m[: len(first)] - [self.fall.apex_m(k) for k in first]
        return late, high
