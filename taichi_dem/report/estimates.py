"""Is an effect needed? Estimates from the numbers of a scene, before a run and after it.

A dimensionless group compares the effect with what it acts beside. Far below one it is negligible,
far above it is needed, and between it is unclear: stresses concentrate at holes and notches by a
factor of a few, which no such estimate knows.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any, Optional

import numpy as np

from taichi_dem.mesh.parts import parts_of
from taichi_dem.report.part_scales import WEIGHT, PartScales
from taichi_dem.state.model import Model

NEGLIGIBLE, NEEDED, UNCLEAR = "negligible", "needed", "unclear"
#: Groups below which an effect is negligible, and from which on it is needed.
_LOW, _HIGH = 0.05, 2.0
#: Density of air [kg/m^3].
AIR = 1.2
#: Groups in words.
_OPENS = "stress over strength, as contact needs free faces"
_BENDS = "stress of the weight over tensile strength, at most"
_SHARE = "share of the energy put in, at most"


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
    model: Model,
    until: float,
    velocity: Optional[np.ndarray] = None,
    meet: bool = False,
) -> tuple[Estimate, ...]:
    """Estimates of all effects of a scene before a run, by dimensionless groups.

    model: the scene's arrays. until: end of the run [s]. velocity: of the bodies at the start
    [m/s], (body_count, 3), None at rest. meet: whether parts may meet. Each connected part is
    judged by its own numbers, and the one that needs an effect most decides. The stress is that of
    the loads and supports on a part (``Effect.stress``) and of the motion at the start, of all
    parts where they may meet; the speed is that of a wave of this stress, stress / (density wave
    speed), or the largest at the start, of the part alone. Of several materials in a part the least
    strengths and the largest friction count.
    """
    part = parts_of(model.mesh)
    scales, drives = PartScales(model, part), (*model.loads, *model.supports)
    beside, rim, fastest = _speeds(model, velocity, part)
    # An unknown load is NaN, and with it all that follows.
    own = scales.stress(drives, scales.size, False)
    speed = np.maximum(
        own / (scales.density * scales.wave) + beside + rim**2 / scales.wave, fastest
    )
    if meet:
        whole = np.full(scales.count, float(np.ptp(model.mesh.points, axis=0).max()))
        own = scales.stress(drives, whole, True)
        shared = _speeds(model, velocity, np.zeros_like(part))
        beside, rim = (np.maximum(one, other).max() for one, other in zip((beside, rim), shared))
    stress = own + scales.density * (scales.wave * beside + rim**2)
    softening = stress / scales.of_materials("tensile_strength", np.minimum)
    shear = stress / np.maximum(scales.of_materials("cohesion", np.minimum), 1e-300)
    breaks = np.maximum(softening, shear)
    rubs = scales.of_materials("friction", np.maximum) * breaks
    worst = _Worst(scales)
    drag = _drag(scales.density, speed, until, scales.spacing)
    return (
        worst("softening", (softening, "stress over tensile strength")),
        worst("slip", (shear, "stress over cohesion")),
        _contact(worst("contact", (breaks, _OPENS)), scales.count if meet else 0),
        worst("friction", (rubs, "friction times stress over strength")),
        worst("bond damping", (scales.damping, "share of a bond's vibration lost in a cycle")),
        worst("gravity", *_weight_before(scales, speed, until, meet)),
        worst("air drag", (drag, "share of momentum lost to air")),
    )


class _Worst:
    """Estimate of the part that needs an effect most."""

    def __init__(self, scales: PartScales):
        self.scales = scales

    def __call__(self, effect, *groups):
        """groups: pairs of a group of each part, and what it is in words."""
        values = np.stack([value for value, _ in groups])
        known = np.where(np.isnan(values), -1.0, values)
        k, p = np.unravel_index(int(np.argmax(known)), known.shape)
        if known[k, p] < _HIGH and np.isnan(values).any():
            k, p = np.argwhere(np.isnan(values))[0]
        words = groups[k][1]
        if self.scales.count > 1:
            words = f"part of body {self.scales.first[p]}: {words}"
        return _judged(effect, float(values[k, p]), words)


def _weight_before(scales, speed, until, meet):
    """Groups of weight: its fall beside what else moves a part, its stress where a part is borne.

    A part that is borne does not fall; one that others may reach may be moved by these, unknown.
    """
    borne = scales.under((*scales.model.supports, *scales.model.ground))
    fall = WEIGHT * until / np.maximum(speed, 1e-300)
    still = speed == 0.0
    fall = np.where(still & borne, 0.0, np.where(still & meet, np.nan, fall))
    return (fall, "speed of a fall over that given"), _bent(scales, until, borne | meet)


def _bent(scales, until, borne):
    """Group of the stress of weight in bonded parts that something bears."""
    stress = np.where(borne & scales.is_bonded, scales.weight_stress(until), 0.0)
    return stress / scales.of_materials("tensile_strength", np.minimum), _BENDS


def _contact(breaks, meeting):
    """Estimate of contact: parts that meet touch from the start, others where they break."""
    if meeting and not breaks.group >= meeting:
        return _judged("contact", float(meeting), "number of parts that may meet")
    return breaks


def _speeds(model, velocity, group):
    """Speeds of groups of bodies at the start: beside a rigid motion of each, of its rim, largest.

    Three arrays, an entry a group. A front that stops a speed v has the stress density wave v, a
    rim of speed v density v^2.
    """
    count = int(group.max()) + 1
    if velocity is None:
        return np.zeros((3, count))

    def total(rows):
        flat = rows.reshape(len(rows), -1)
        sums = [np.bincount(group, column, minlength=count) for column in flat.T]
        return np.stack(sums, axis=1).reshape(count, *rows.shape[1:])

    mass = model.body_mass[:, None]
    arm = model.centre - (total(mass * model.centre) / total(mass))[group]
    mean = (total(mass * velocity) / total(mass))[group]
    momentum = total(mass * np.cross(arm, velocity))
    squares = mass[:, :, None] * arm[:, :, None] * arm[:, None]
    second = total(squares)
    inertia = np.eye(3) * np.trace(second, axis1=1, axis2=2)[:, None, None] - second
    rate = np.einsum("pij,pj->pi", np.linalg.pinv(inertia, hermitian=True), momentum)
    rim = np.cross(rate[group], arm)
    found = np.zeros((3, count))
    for row, one in zip(found, (velocity - mean - rim, rim, velocity)):
        np.maximum.at(row, group, np.linalg.norm(one, axis=1))
    # Rounding of a rigid motion strains nothing.
    found[0][found[0] <= 1e-9 * found[2]] = 0.0
    return found


def _drag(density, speed, until, spacing):
    return AIR * speed * until / (density * spacing)


def _judged(effect, group, words):
    if math.isnan(group):
        return Estimate(effect, group, words, UNCLEAR)
    verdict = NEGLIGIBLE if group < _LOW else NEEDED if group >= _HIGH else UNCLEAR
    return Estimate(effect, float(group), words, verdict)


def estimates_after(
    scales: PartScales,
    displacement: np.ndarray,
    speed: np.ndarray,
    until: float,
    energy: np.ndarray,
    borne: np.ndarray,
) -> tuple[Estimate, ...]:
    """Estimates of what no law of a scene serves, from where a run has brought the bodies.

    displacement (n, 3) [m] and speed (n,) [m/s]: of the bodies. energy: that each part got [J],
    (part_count,), 0 where nothing moved it; borne: whether a support, ground or contact bears it.
    Shares of this energy: work of the weight along the way and its fall, and of the drag of air on
    balls of the bodies' size at their present speed. Where a part is borne, weight strains it too.
    """
    way, worst, found = np.linalg.norm(displacement, axis=1), _Worst(scales), []
    model = scales.model
    if not any(effect.name == "gravity" for effect in model.loads):
        fall = WEIGHT * until
        work = model.body_mass * (WEIGHT * way + fall * speed + 0.5 * fall**2)
        share = _share(scales.sum(work), energy)
        # What is borne and not moved at all does not fall.
        share = np.where(borne & (energy == 0.0), 0.0, share)
        found.append(worst("gravity", (share, _SHARE), _bent(scales, until, borne)))
    drag = 0.5 * AIR * math.pi * model.body_radius**2 * speed**2
    found.append(worst("air drag", (_share(scales.sum(drag * way), energy), _SHARE)))
    return tuple(found)


def _share(work, energy):
    """Share of an energy; not known where there is none."""
    none = np.where(work > 0.0, np.nan, 0.0)
    return np.where(energy > 0.0, work / np.where(energy > 0.0, energy, 1.0), none)
