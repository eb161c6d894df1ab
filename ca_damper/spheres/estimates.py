"""Estimates of what effects on the spheres would do, from numbers of the scene before a run.

Rotation: a blow at 45 degrees with friction f and restitution e changes the tangential speed v by
f (1 + e) v as long as it slides, and by 2/7 v at most, when it sticks. A tangential impulse J gives
a solid sphere the energy 5/4 J^2 / m of turning. For a small f this adds up from blow to blow: it
is called negligible only if a thousand blows that all turn the sphere the same way leave it so.

Air: a sphere that crosses the box displaces air of its cross-section times the way; at Reynolds
numbers of some hundreds its drag coefficient is below 1.
"""

import math
from typing import TYPE_CHECKING

from taichi_dem.kit.certificate import Estimate

if TYPE_CHECKING:
    from ca_damper.spheres.options import Spheres

# Blows that may all turn a sphere the same way.
_BLOWS = 1000
_AIR_DENSITY = 1.2
# Shares below which an effect is negligible, and from which on it is needed.
_LIMITS = (1e-3, 1e-2)


def rotation_estimate(spheres: "Spheres", particles: int) -> Estimate:
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


def air_estimate(spheres: "Spheres") -> Estimate:
    """Share of its energy that a sphere loses to the air from floor to lid; never computed."""
    air = _AIR_DENSITY * math.pi * min(spheres.radii) ** 2 * spheres.height
    words = "share of the energy of a flight at a drag coefficient of 1, at most"
    return Estimate("air drag", min(1.0, air / min(spheres.masses)), words, _LIMITS)
