"""Effects of the spheres: their activity in a run, and estimates before it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import taichi as ti

from ca_damper.engine.recorder import EventCounts
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_table import EffectUse, Estimate

vec2 = ti.types.vector(2, ti.f64)

#: What is noted when it happens first: two spheres touch, one touches a wall, friction acts.
PAIRS, WALLS, FRICTION = range(3)
#: Those by which each effect acts.
_BY = {
    "normal contact": (PAIRS, WALLS),
    "friction": (FRICTION,),
    "rotation": (FRICTION,),
}

#: Reason why an unseen effect may have acted: an impact is shorter than the time between checks.
_UNSEEN = "contacts between two samples are not counted"

# Blows that may all turn a sphere the same way.
_BLOWS = 1000
_AIR_DENSITY = 1.2
# Shares below which an effect is negligible, and from which on it is needed.
_LIMITS = (1e-3, 1e-2)


@ti.data_oriented
class EffectActivity(EventCounts):
    """Sums over the checks since the reset, by scene."""

    def __init__(self, table: SceneFields):
        super().__init__(table, len(_BY), _BY)
        self.touches = table.field(ti.i64)
        self.power, self.motion = table.vector(2, ti.f64), table.vector(2, ti.f64)

    @ti.func
    def reset(self, s):
        """Nothing has been seen yet."""
        self.clear(s)
        self.touches[s] = ti.cast(0, ti.i64)
        self.power[s], self.motion[s] = vec2(0.0), vec2(0.0)

    @ti.func
    def note_contact(self, s, dragged, rubbed):
        """Note two spheres that touch: power into their dashpot and into friction [W]."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.touches[s] = self.touches[s] + 1
        self.power[s] = self.power[s] + vec2(dragged, rubbed)

    @ti.func
    def note_sphere(self, s, at_wall, going, turning):
        """Note a sphere: whether it is at a wall, and the energy of its motion [J]."""
        self.touches[s] = self.touches[s] + at_wall
        self.motion[s] = self.motion[s] + vec2(going, turning)

    def uses(self, effects: tuple[str, ...], skipped: int) -> tuple[EffectUse, ...]:
        """An EffectUse for each of the named effects, over all scenes; skipped: tests."""
        power, motion = (
            self.table.in_use(field).sum(axis=0) for field in (self.power, self.motion)
        )
        touches = int(self.table.in_use(self.touches).sum())
        # Spheres keep their spin: where none turns at any check, none has been turned.
        turn, unseen = motion[1] > 0.0, "" if touches else _UNSEEN
        contact = EffectUse("normal contact", "contacts seen", touches, whole="what contacts took")
        turning = replace(contact, effect="rotation", events=touches if turn else 0)
        found = (
            replace(contact, share=_share(power, 0), steers=True, kept=unseen, skipped=skipped),
            replace(contact, effect="friction", share=_share(power, 1), kept=unseen),
            replace(
                turning,
                share=_share(motion, 1),
                whole="the energy of motion",
                kept=unseen if turn else "",
            ),
        )
        return tuple(use for name in effects for use in found if use.effect == name)


def _share(sums: np.ndarray, which: int) -> float | None:
    """None for no part at all: spheres may rub on walls alone, which is not seen."""
    return float(sums[which] / sums.sum()) if sums[which] > 0.0 else None


def rotation_estimate(spheres: Any, particles: int) -> Estimate:
    """Share of the energy in motion that rotation takes; exactly none without friction."""
    meets = spheres.wall_friction > 0.0 or (particles > 1 and spheres.friction > 0.0)
    if not meets or particles == 0:
        why = "no friction turns a sphere" if particles else "there is no sphere"
        return Estimate("rotation", 0.0, f"share of the energy in motion, as {why}:", _LIMITS)
    friction = max(spheres.friction, spheres.wall_friction)
    restitution = max(spheres.restitution, spheres.wall_restitution)
    slides, sticks = friction * (1.0 + restitution), 2.0 / 7.0
    change = math.sqrt(0.5) * min(_BLOWS * slides, sticks)
    words = (
        f"share of the energy in motion after {_BLOWS} blows at 45 degrees that all turn a sphere "
        f"the same way, friction {friction:g}, at most"
    )
    return Estimate("rotation", 2.5 * change * change, words, _LIMITS)


def air_estimate(spheres: Any) -> Estimate:
    """Share of its energy that a sphere loses to the air from floor to lid; never computed."""
    air = _AIR_DENSITY * math.pi * min(spheres.radii) ** 2 * spheres.height
    words = "share of the energy of a flight at a drag coefficient of 1, at most"
    return Estimate("air drag", min(1.0, air / min(spheres.masses)), words, _LIMITS)
