"""Activity of the effects of the spheres.

How much they did is sampled when a scene is checked for divergence: to ask in every step would
cost a fifth of it. When each acted for the first time is noted in the step itself.
"""

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_usage import EffectUse

vec2 = ti.types.vector(2, ti.f64)

#: What is noted when it happens first: two spheres touch, one touches a wall, friction acts.
PAIRS, WALLS, FRICTION = range(3)
#: Those by which each effect acts.
_BY = {"normal contact": (PAIRS, WALLS), "friction": (FRICTION,), "rotation": (FRICTION,)}
_NEVER = -1

#: Reason why an unseen effect may have acted: an impact is shorter than the time between checks.
_UNSEEN = "touches between two looks leave no trace"


@ti.data_oriented
class EffectActivity:
    """Sums over the checks since the reset, by scene.

    touches: of two spheres, or of a sphere and a wall. power: into dashpots and into friction of
    sphere on sphere [W]. motion: energy of going and of turning [J]. first: step in which each of
    PAIRS, WALLS and FRICTION first happened, or -1.
    """

    def __init__(self, table: SceneFields):
        self.table = table
        self.touches = table.field(ti.i64)
        self.power = table.vector(2, ti.f64)
        self.motion = table.vector(2, ti.f64)
        self.first = table.field(ti.i32, FRICTION + 1)

    @ti.func
    def clear(self, s):
        """Nothing has been seen yet."""
        self.touches[s] = ti.cast(0, ti.i64)
        self.power[s], self.motion[s] = vec2(0.0), vec2(0.0)
        for kind in range(FRICTION + 1):
            self.first[s, kind] = _NEVER

    @ti.func
    def is_new(self, s, kind):
        """Whether something has not happened yet."""
        return self.first[s, kind] == _NEVER

    @ti.func
    def note(self, s, kind, step, count):
        """Note how often something happens in a step."""
        if count > 0 and self.is_new(s, kind):
            self.first[s, kind] = step

    @ti.func
    def note_contact(self, s, dragged, rubbed):
        """Note two spheres that touch: power into their dashpot and into friction [W]."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.touches[s] = self.touches[s] + 1
        self.power[s] = self.power[s] + vec2(dragged, rubbed)

    @ti.func
    def note_power(self, s, rubbed):
        """Note the power into the friction of spheres on each other [W]."""
        self.power[s] = self.power[s] + vec2(0.0, rubbed)

    @ti.func
    def note_sphere(self, s, at_wall, going, turning):
        """Note a sphere: whether it is at a wall, and the energy of its motion [J]."""
        self.touches[s] = self.touches[s] + at_wall
        self.motion[s] = self.motion[s] + vec2(going, turning)

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each of the named effects first acted, infinite if never, (scenes,)."""
        first = self.table.in_use(self.first).astype(np.float64)
        first[first == _NEVER] = np.inf
        return {name: first[:, list(_BY[name])].min(axis=1) for name in effects}

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """An EffectUse for each of the named effects, over all scenes."""
        power, motion = (
            self.table.in_use(field).sum(axis=0) for field in (self.power, self.motion)
        )
        touches = int(self.table.in_use(self.touches).sum())
        # Spheres keep their spin: where none turns at any check, none has been turned.
        turned = touches if motion[1] > 0.0 else 0
        unseen = "" if touches else _UNSEEN
        found = {
            "normal contact": (touches, _share(power, 0), "what contacts took", True, unseen),
            "friction": (touches, _share(power, 1), "what contacts took", False, unseen),
            "rotation": (
                *(turned, _share(motion, 1), "the energy of motion", False),
                unseen if motion[1] > 0.0 else "",
            ),
        }
        return tuple(_use(name, *found[name]) for name in effects)


def _use(
    name: str, touches: int, share: float | None, whole: str, steers: bool, kept: str
) -> EffectUse:
    return EffectUse(
        name, "touches seen", touches, share=share, whole=whole, steers=steers, kept=kept
    )


def _share(sums: np.ndarray, which: int) -> float | None:
    """None for no part at all: spheres may rub on walls alone, which is not seen."""
    return float(sums[which] / sums.sum()) if sums[which] > 0.0 else None
