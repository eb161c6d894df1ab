"""Is an effect needed? Estimates from the numbers of a scene, before a run and after it.

A dimensionless group compares the effect with what it acts beside. Far below one it is negligible,
far above it is needed, and between it is unclear: stresses concentrate at holes and notches by a
factor of a few, which no such estimate knows.
"""

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from taichi_dem.mesh.topology import mean_density

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model

NEGLIGIBLE, NEEDED, UNCLEAR = "negligible", "needed", "unclear"
#: Groups below which an effect is negligible, and from which on it is needed.
_LOW, _HIGH = 0.05, 2.0
#: Standard weight [m/s^2] and density of air [kg/m^3].
WEIGHT, AIR = 9.80665, 1.2


@dataclass(frozen=True)
class Estimate:
    """Dimensionless group by which an effect is judged before a run.

    Parameters
    ----------
    effect : str
        Name of the effect.
    group : float
        Value of the group [-]; NaN where it is not known.
    words : str
        The group in words.
    verdict : str
        ``"negligible"``, ``"needed"`` or ``"unclear"``.
    """

    effect: str
    group: float
    words: str
    verdict: str

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file; a group that is not known is None.

        Returns
        -------
        dict
            Figures by name; a group that is not known is None.
        """
        return {**asdict(self), "group": None if math.isnan(self.group) else self.group}

    def __str__(self):
        value = "not known" if math.isnan(self.group) else f"{self.group:.2g}"
        return f"{self.effect}: {self.verdict} ({self.words} {value})"


def estimates_before(
    model: "Model", until: float, velocity: Optional[np.ndarray] = None, meeting: int = 0
) -> tuple[Estimate, ...]:
    """Estimates of all effects of a scene before a run, by dimensionless groups.

    model: the scene's arrays. until: end of the run [s]. velocity: of the bodies at the start
    [m/s], (body_count, 3), None at rest. meeting: number of parts that no bond joins, where they
    may meet, else 0. The stress is that of the loads and supports (``Effect.stress``) and of the
    motion at the start, the speed that of a wave of this stress, stress / (density wave speed), or
    the largest at the start. Of several materials the least strengths, the largest friction and
    the mean density count.
    """
    materials, size = model.materials, float(np.ptp(model.mesh.points, axis=0).max())
    density = mean_density(model.mesh, materials.density)
    given = [
        max(effect.stress(material, size) for material in materials.materials)
        for effect in (*model.loads, *model.supports)
    ]
    # An unknown load is NaN, and with it all that follows.
    spacing = float(2.0 * model.body_radius.mean())
    wave = math.sqrt(_normal_stiffness(model) * spacing / density)
    beside, rim, fastest = _speeds(model, velocity)
    stress = float(sum(given)) + density * (wave * beside + rim**2)
    speed = np.maximum(stress / (density * wave), fastest)
    softening = stress / materials.least("tensile_strength")
    shear = stress / max(materials.least("cohesion"), 1e-300)
    breaks = max(softening, shear)
    return (
        _judged("softening", softening, "stress over tensile strength"),
        _judged("slip", shear, "stress over cohesion"),
        _contact(breaks, meeting),
        _judged("friction", materials.friction * breaks, "friction times stress over strength"),
        _judged("bond damping", _damping(model), "share of a bond's vibration lost in a cycle"),
        _judged("gravity", WEIGHT * until / max(speed, 1e-300), "speed of a fall over that given"),
        _judged("air drag", _drag(density, speed, until, spacing), "share of momentum lost to air"),
    )


def _contact(breaks, meeting):
    """Estimate of contact: parts that meet touch from the start, others where they break."""
    if meeting and not breaks >= meeting:
        return _judged("contact", float(meeting), "number of parts that may meet")
    return _judged("contact", breaks, "stress over strength, as contact needs free faces")


def _speeds(model, velocity):
    """Speeds at the start: largest beside a rigid motion of all, of its rim, and largest of all.

    A front that stops a speed v has the stress density wave v, a rim of speed v density v^2.
    """
    if velocity is None:
        return 0.0, 0.0, 0.0
    mass = model.body_mass[:, None]
    arm = model.centre - (mass * model.centre).sum(axis=0) / mass.sum()
    mean = (mass * velocity).sum(axis=0) / mass.sum()
    momentum = (mass * np.cross(arm, velocity)).sum(axis=0)
    inertia = np.eye(3) * (mass * arm**2).sum() - (mass * arm).T @ arm
    rim = np.cross(np.linalg.pinv(inertia) @ momentum, arm)
    speeds = (velocity - mean - rim, rim, velocity)
    beside, turning, fastest = (float(np.linalg.norm(one, axis=1).max()) for one in speeds)
    # Rounding of a rigid motion strains nothing.
    return beside if beside > 1e-9 * fastest else 0.0, turning, fastest


def _damping(model):
    """Share of its energy that a bond between two bodies of mean size loses in a cycle."""
    area = 3.0 * float(model.bonds["area"].mean())
    pair = 0.5 * float(model.body_mass.mean())
    damping = float(np.median(model.bond_damping[:, 0]))
    ratio = 0.5 * damping * math.sqrt(area / (_normal_stiffness(model) * pair))
    return 4.0 * math.pi * ratio


def _normal_stiffness(model):
    """Normal stiffness of a bond per area [Pa/m], the median where bonds differ."""
    if not model.bond_count:
        return float(model.material.normal_stiffness)
    return float(np.median(model.bond_stiffness[:, 0]))


def _drag(density, speed, until, spacing):
    return AIR * speed * until / (density * spacing)


def _judged(effect, group, words):
    if math.isnan(group):
        return Estimate(effect, group, words, UNCLEAR)
    verdict = NEGLIGIBLE if group < _LOW else NEEDED if group >= _HIGH else UNCLEAR
    return Estimate(effect, float(group), words, verdict)


def estimates_after(
    model: "Model", displacement: np.ndarray, speed: np.ndarray, until: float, energy: float
) -> tuple[Estimate, ...]:
    """Estimates of what no law of a scene serves, from where a run has brought the bodies.

    displacement (n, 3) [m] and speed (n,) [m/s]: of the bodies. energy: put in [J]. Shares of this
    energy: work of the weight along the way and its fall, and of the drag of air on balls of the
    bodies' size at their present speed.
    """
    way = np.linalg.norm(displacement, axis=1)
    found = []
    if not any(effect.name == "gravity" for effect in model.loads):
        fall = WEIGHT * until
        work = float((model.body_mass * (WEIGHT * way + fall * speed + 0.5 * fall**2)).sum())
        found.append(_share("gravity", work, energy))
    drag = 0.5 * AIR * math.pi * model.body_radius**2 * speed**2
    found.append(_share("air drag", float((drag * way).sum()), energy))
    return tuple(found)


def _share(effect, work, energy):
    share = work / energy if energy > 0.0 else math.nan
    return _judged(effect, share, "share of the energy put in, at most")
