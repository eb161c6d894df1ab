"""Steps of the runs of a scene by level, each half of the one before."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

from taichi_dem.elasticity.rates import largest_bond_rate, springs_of
from taichi_dem.goals import Goal
from taichi_dem.laws.contracts import BodyEffect
from taichi_dem.mesh.topology import topology_of
from taichi_dem.methods import ImplicitDashpots, Method, Uniform
from taichi_dem.scene import Scene
from taichi_dem.stability.body_limits import spring_step
from taichi_dem.stability.step_report import step_report

#: Fewest steps of a run, and how many times shorter than springs bear they begin at most where the
#: history of a load or support is to be resolved.
_FEWEST, _MOST_TIMES = 8, 64
#: By how many more steps a smooth run is made again, as a share and at least: of few steps the
#: error has not its order yet.
_MORE, _LEAST_MORE = 0.1, 16
#: Less than a whole step more, by which last bits of the longest step make none.
_LESS = 1.0 - 1e-9
#: Sweeps of a step at most, and by how much better they agree to see their error.
_MOST_SWEEPS, _TIGHT = 1000, 8
#: Rows of the time series of the coarsest run in which an extreme is looked for, of any run, and of
#: one without an extreme whose report is read: it finds at them what is missing.
_ROWS, _MOST_ROWS, _LOOKS = 100, 6400, 2
#: How many more steps a twin makes at most, as a share, and which part of these each: what breaks
#: by the luck of when a step ends breaks otherwise, and shares of the golden ratio lie far apart.
_MORE_STEPS, _GOLDEN = 0.3, 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class Levels:
    """Steps of the runs of a scene, by level. until: end of a run [s]."""

    scene: Scene
    until: float
    goal: Goal

    @cached_property
    def solves(self) -> bool:
        """Whether dashpots are solved together, in sweeps."""
        return self.scene.damped()

    @cached_property
    def _coarsest(self):
        """Steps at level 0, the fewest that are stable, and order of the error from there on."""
        drives = (effect for effect in self.scene.effects if isinstance(effect, BodyEffect))
        change = min((effect.change_time() for effect in drives), default=math.inf)
        longest = self._longest_step()
        step = max(min(longest, change), longest / _MOST_TIMES)
        # A pulse within a step is a kick, which lies between the steps of two levels by chance.
        return max(_FEWEST, math.ceil(_LESS * self.until / step)), 2.0 if step <= change else 1.0

    @property
    def declared(self) -> float:
        """Order of the error of a smooth run."""
        return self._coarsest[1]

    def nearby(self, level: float) -> float:
        """Level at which a smooth run is made again, with little more steps than at a level."""
        more = max(_MORE, _LEAST_MORE / (self._coarsest[0] * 2.0**level))
        return level + min(1.0, math.log2(1.0 + more))

    def _longest_step(self):
        """Longest step that all springs bear [s]: solved dashpots leave no other limit."""
        # Solved dashpots limit no step. Without bonds, springs of contacts do.
        mesh, material = self.scene.mesh, self.scene.body_materials
        given = mesh, topology_of(mesh), material.density, springs_of(material)
        step = float(spring_step(largest_bond_rate(*given)))
        if math.isinf(step):
            step = float(step_report(self.scene).borne("solved", "contact").min())
        return step

    def method(self, level: float, tight: bool = False, twin: int = 0) -> Method:
        """Method at a level, of the longest stable step over 2^level."""
        # Sweeps end at differences that fall with the step: one family converges to the exact
        # solution.
        more = 1.0 + _MORE_STEPS * math.fmod(twin * _GOLDEN, 1.0)
        step = self.until / round(self._coarsest[0] * 2.0**level * more)
        if not self.solves:
            return Uniform(step)
        finer, coarse = 2.0**level * (_TIGHT if tight else 1), ImplicitDashpots(step)
        fewest, most = coarse.sweeps
        sweeps = fewest, min(_MOST_SWEEPS, math.ceil(most * finer))
        return replace(coarse, tolerance=coarse.tolerance / finer, sweeps=sweeps)

    def in_words(self, level: float) -> str:
        """Method and step in words."""
        name = "solved dashpots" if self.solves else "one explicit step for all"
        return f"{name}, {self.method(level).dt0:.2g} s"

    def rows(self, level: float, brief: bool = False) -> int:
        """Rows of the time series of a run at a level, of which an extreme needs ever more."""
        if self.goal.kind != "extreme":
            return 1 if brief else _LOOKS
        return min(_MOST_ROWS, round(_ROWS * 2.0**level))
