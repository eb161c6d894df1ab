"""Rules for the step of a body, evaluated by the schedule at the body's own times."""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.types import real
from taichi_dem.kit.validation import between, plain_fields, whole
from taichi_dem.state.timeline import MAX_LEVEL

#: Criteria that may bound the step of a body; the state holds an index into this tuple for each.
CRITERIA = (
    "largest_step",
    "displacement",
    "rotation",
    "bond_stiffness",
    "bond_dashpot",
    "contact_stiffness",
    "contact_dashpot",
    "load",
    "neighbour",
)
LARGEST, DISPLACEMENT, ROTATION, BOND_K, BOND_C, CONTACT_K, CONTACT_C, LOAD, NEIGHBOUR = range(9)


@dataclass(frozen=True)
class StepControl:
    """Limits of a body's step beside the displacement limit.

    Parameters
    ----------
    safety : float, default 0.25
        Share of each stability limit that a step may take, above 0 and at most 1.
    angle : float, default 0.02
        Largest rotation in a step [rad].
    level_jump : int or None, default 2
        Levels by which a body may be coarser than one that it touches; None for any number.
    ahead : float, default 2.0
        Number of steps of the finer of two bodies by which their contacts count before they could
        touch, at least 1, so that a coarse body is woken before a collision.
    dashpot_floor : float, default 0.0
        With dashpot ``"limited"``, the shortest step that dashpots require [s]; where they need a
        shorter one they are limited instead. 0: they are never limited.

    Notes
    -----
    Stability allows 0.8 of the limits, accuracy less: a dashpot takes the velocity of half a step
    ago, and a held neighbour is up to a step behind, both errors of first order. In the paper's
    block (dt0 8e-8 s, largest error of a body at the hole at 7e-5 s) they are 0.9 % at 0.8 and 0.4
    % at 0.4. One bond there opens to within 0.2 % of its failure and releases two bodies of the
    hole's wall: at 0.5 it still held, and the mean displacement of the hole was 2.4 % short.
    """

    safety: float = 0.25
    angle: float = 0.02
    level_jump: int | None = 2
    ahead: float = 2.0
    dashpot_floor: float = 0.0

    def __post_init__(self):
        plain_fields(self)
        for name in ("safety", "angle"):
            between(name, getattr(self, name), 1e-6, 1.0)
        between("ahead", self.ahead, 1.0, 100.0)
        between("dashpot_floor", self.dashpot_floor, 0.0, 1.0)
        if self.level_jump is not None:
            whole("level_jump", self.level_jump, 0, MAX_LEVEL)


@ti.data_oriented
class FixedStep:
    """Every body keeps the largest step."""

    @ti.func
    def wanted(self, level, speed2, low):
        """Level 0, always."""
        return 0


@ti.data_oriented
class Displacement:
    """No body moves by more than a given distance in a step (Konno et al., 3.1).

    The level is the lowest k with rate (dt0 / 2^k)^power <= distance; power: 1 for a speed, 2 for
    an acceleration. A distance is an angle [rad] for a body that turns.
    """

    constant_fields = ("rate2",)

    def __init__(self, power: int = 1):
        self.power = power
        self.rate2 = ti.field(real, shape=MAX_LEVEL + 2)

    def upload(self, distance: float, dt0: float) -> None:
        """Upload a distance and the step of level 0 [s]."""
        steps = dt0 / 2.0 ** np.arange(MAX_LEVEL + 1)
        assign(self.rate2, np.append((distance / steps**self.power) ** 2, np.inf))

    @ti.func
    def finer(self, level, rate2):
        """Lowest level, from ``level`` on, for a squared rate, [m^2/s^2] for a speed."""
        k = level
        while rate2 > self.rate2[k] and k < MAX_LEVEL:
            k += 1
        return k

    @ti.func
    def wanted(self, level, speed2, low):
        """Level for a body now on a level, of squared speed [m^2/s^2]; low: coarsest allowed."""
        k = self.finer(level, speed2)
        while k > low and speed2 <= self.rate2[ti.max(k - 1, 0)]:
            k -= 1
        return k


@ti.func
def level_of(step, dt0):
    """Lowest level k whose step dt0 / 2^k is no longer than a step [s], and is allowed."""
    k = 0
    length = dt0
    while length > step and k < MAX_LEVEL:
        k += 1
        length *= 0.5
    return k


@ti.func
def finer(level, bound, other, criterion):
    """The finer of two levels, with its criterion."""
    if other > level:
        level, bound = other, criterion
    return level, bound
