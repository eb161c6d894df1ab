"""Plan of an answer, from which a later question may begin."""

from dataclasses import dataclass
from typing import Any

from taichi_dem.kit.bars.answer import Plan
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown


@dataclass(frozen=True)
class DamperPlan(Plan):
    """Plan of ``solve_response``; another question of the same filling may begin where it ended.

    filling, particles: that it is of. dt: finest step [s]. seeds: number of them. window: steady
    cycles of each scene. has_between: whether it took steps between dt and 4 dt. margin: further
    frequencies on either side of a peak.
    """

    filling: Any = None
    particles: int = 0
    dt: float = 0.0
    seeds: int = 1
    window: int = 0
    has_between: bool = False
    margin: int = 0


def checked_plan(plan: Any, filling: Any, particles: int) -> Any:
    """Return a plan, or None for none; InputError for one of something else."""
    if plan is None:
        return None
    if not isinstance(plan, DamperPlan):
        raise InputError(f"plan must be that of an answer of solve_response, got {shown(plan)}")
    if (plan.filling, plan.particles) != (filling, particles):
        raise InputError(
            "plan must be of the same filling and particles, "
            f"{shown(filling)} and {particles}, got {shown(plan.filling)} and {plan.particles}"
        )
    return plan
