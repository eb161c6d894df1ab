"""A checked question to ``solve_response``, and the start of its runs."""

import math
from dataclasses import dataclass
from typing import Any

from ca_damper.fixed_mass import Empty, RigidMass
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.spheres.options import Spheres
from taichi_dem.kit.bars.chance import LEAST_SEEDS

# First coarse step by the filling's own and by its bound, which is that of safe runs.
_OF_DEFAULT, _OF_BOUND = 1.5, 1.4
# Seeds to begin with: so many particles in all, as few of them often have several steady motions.
# Fewer than LEAST_SEEDS may agree by luck where there are two motions: three do in one of four.
_MANY_SEEDS, _PARTICLES = 8, 80
# Cycles of the steady part of a scene, at least.
_LEAST_WINDOW = 32
# Range of a search by the peak of the rigid mass and by the natural frequency.
_BELOW, _ABOVE = 0.95, 1.04


@dataclass(frozen=True)
class Stage:
    """Which runs make an estimate."""

    dt: float
    seeds: tuple[int, ...]
    window: int = _LEAST_WINDOW
    has_between: bool = False
    margin: int = 0
    level: int = 0


@dataclass(frozen=True)
class Job:
    """A checked question. span: range of ratios or None. fixed: seeds, or None for ours."""

    filling: Any
    particles: int
    oscillator: Oscillator
    goals: tuple[Goal, ...] = ()
    tolerance: float = 0.01
    confidence: float = 0.95
    budget_s: float = math.inf
    span: tuple[float, float] | None = None
    fixed: tuple[int, ...] | None = None
    listener: Any = None

    def first_step(self) -> float:
        """Coarse step to begin with [s]."""
        return min(_OF_DEFAULT * self.filling.default_dt, self.longest_step())

    def longest_step(self) -> float:
        """Longest step to be told anything by [s]."""
        bound = self.filling.step_bound
        return math.inf if bound is None else _OF_BOUND * bound[0]

    def first_stage(self, coarse: float) -> Stage:
        """Stage to begin at, half a coarse step [s]."""
        return Stage(coarse / 2.0, self._first_seeds())

    def _first_seeds(self):
        """Seeds to begin with; one of a filling that draws nothing."""
        if self.fixed is not None:
            return self.fixed
        if not self.is_drawn:
            return (1,)
        several = math.ceil(_PARTICLES / self.particles)
        return tuple(range(1, 1 + min(_MANY_SEEDS, max(LEAST_SEEDS, several))))

    @property
    def is_drawn(self) -> bool:
        """Whether seeds make a difference."""
        if isinstance(self.filling, Spheres):
            # Only the places of spheres, and who has which size, are drawn.
            return self.particles > 0 and (self.filling.start is None or bool(self.filling.sizes))
        return self.particles > 0 and not isinstance(self.filling, (Empty, RigidMass))

    @property
    def follows_peak(self) -> bool:
        """Whether a goal lies on the peak, which is to be found."""
        return not all(goal.ratios for goal in self.goals)

    def search_range(self) -> tuple[float, float]:
        """Range in which to look for a peak first."""
        if self.span is not None:
            return self.span
        o = self.oscillator
        return _BELOW * o.peak(self.particles * self.filling.particle_mass)[0], _ABOVE
