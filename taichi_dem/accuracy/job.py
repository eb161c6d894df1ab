"""What is asked of a scene, and by which method and steps it is answered."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

from taichi_dem.elasticity.rates import bond_rates, springs_of
from taichi_dem.goals import Goal
from taichi_dem.mesh.topology import topology_of
from taichi_dem.methods import ImplicitDashpots, Method, Uniform
from taichi_dem.scene import Scene
from taichi_dem.stability.body_limits import spring_step
from taichi_dem.stability.step_report import step_report

#: Fewest steps of a run, and how many times shorter than springs bear they begin at most where the
#: history of a load or support is to be resolved.
_FEWEST, _MOST_TIMES = 8, 64
#: Sweeps of a step at most, and by how much better they agree to see their error.
_MOST_SWEEPS, _TIGHT = 1000, 8
#: Rows of the time series of the coarsest run in which an extreme is looked for, of any run, and of
#: one without an extreme: its report finds at them what is missing or creeps.
_ROWS, _MOST_ROWS, _LOOKS = 100, 6400, 4


@dataclass(frozen=True)
class Job:
    """A question. until: end of the run [s]. tolerance: error that is allowed, a share."""

    scene: Scene
    until: float
    goal: Goal
    tolerance: float
    confidence: float

    @cached_property
    def solves(self) -> bool:
        """Whether dashpots are solved together, in sweeps."""
        return self.scene.damped()

    @cached_property
    def _coarsest(self):
        """Steps at level 0, the fewest that are stable, and order of the error from there on."""
        change = min((effect.change_time() for effect in self.scene.effects), default=math.inf)
        longest = self._longest_step()
        step = max(min(longest, change), longest / _MOST_TIMES)
        # A pulse within a step is a kick, which lies between the steps of two levels by chance.
        return max(_FEWEST, math.ceil(self.until / step)), 2.0 if step <= change else 1.0

    @property
    def declared(self) -> float:
        """Order of the error of a smooth run."""
        return self._coarsest[1]

    def _longest_step(self):
        """Longest step that all springs bear [s]: solved dashpots leave no other limit.

        Without bonds that of contacts, which is not needed where no whole face ever touches.
        """
        mesh, material = self.scene.mesh, self.scene.body_materials
        rates = bond_rates(mesh, topology_of(mesh), material.density, springs_of(material))
        step = float(spring_step(rates).min())
        if math.isinf(step):
            step = float(step_report(self.scene).borne("solved", "contact").min())
        return step

    def method(self, level: int, tight: bool = False) -> Method:
        """Method at a level, of the longest stable step over 2^level.

        tight: whether its sweeps must agree 8 times as well. Sweeps end at differences that fall
        with the step: one family goes to the exact solution.
        """
        step = self.until / (self._coarsest[0] * 2**level)
        if not self.solves:
            return Uniform(step)
        finer, coarse = 2**level * (_TIGHT if tight else 1), ImplicitDashpots(step)
        fewest, most = coarse.sweeps
        sweeps = fewest, min(_MOST_SWEEPS, most * finer)
        return replace(coarse, tolerance=coarse.tolerance / finer, sweeps=sweeps)

    def in_words(self, level: int) -> str:
        """Method and step in words."""
        name = "solved dashpots" if self.solves else "one explicit step for all"
        return f"{name}, {self.method(level).dt0:.2g} s"

    def rows(self, level: int) -> int:
        """Rows of the time series of a run at a level, of which an extreme needs ever more."""
        return min(_MOST_ROWS, _ROWS * 2**level) if self.goal.kind == "extreme" else _LOOKS
