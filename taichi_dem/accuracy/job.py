"""What is asked of a scene, and by which method and steps it is answered."""

import math
from dataclasses import dataclass, replace
from typing import Any

from taichi_dem.goals import Goal
from taichi_dem.methods import ImplicitDashpots, Uniform
from taichi_dem.scene import Scene
from taichi_dem.stability.step_report import step_report

#: Fewest steps of a run.
_FEWEST = 8
#: Sweeps of a step at most, and by how much better they agree to see their error.
_MOST_SWEEPS, _TIGHT = 1000, 8


@dataclass(frozen=True)
class Job:
    """A question. until: end of the run [s]. tolerance: error that is allowed, a share."""

    scene: Scene
    until: float
    goal: Goal
    tolerance: float
    confidence: float

    def methods(self) -> "Methods":
        """The method for this scene, at any step."""
        scene = self.scene
        damped = any(effect.role == "dashpot" for effect in scene.effects if effect.name)
        damped &= scene.material.normal_damping + scene.material.shear_damping > 0.0
        touching = any(effect.role == "contact" for effect in scene.effects if effect.name)
        damped |= touching and scene.material.contact_damping > 0.0
        make = ImplicitDashpots if damped else Uniform
        report = step_report(scene)
        step = report.borne("solved" if damped else "full").min()
        return Methods(make, self.until, max(_FEWEST, math.ceil(self.until / step)))


@dataclass(frozen=True)
class Methods:
    """A method at falling steps: at level k the longest stable one, over 2^k.

    make: of a step [s]. until: of the run [s]. steps: at level 0, the fewest that are stable.
    """

    make: Any
    until: float
    steps: int
    declared: float = 2.0

    @property
    def solves(self) -> bool:
        """Whether dashpots are solved together, in sweeps."""
        return self.make is ImplicitDashpots

    def at(self, level: int, tight: bool = False) -> Any:
        """Method at a level; tight: whether its sweeps must agree 8 times as well.

        Sweeps end at differences that fall with the step: one family goes to the exact solution.
        """
        method = self.make(self.until / (self.steps * 2**level))
        if not self.solves:
            return method
        finer = 2**level * (_TIGHT if tight else 1)
        fewest, most = method.sweeps
        sweeps = fewest, min(_MOST_SWEEPS, most * finer)
        return replace(method, tolerance=method.tolerance / finer, sweeps=sweeps)

    def in_words(self, level: int) -> str:
        """Method and step in words."""
        name = "solved dashpots" if self.solves else "one explicit step for all"
        return f"{name}, {self.at(level).dt0:.2g} s"
