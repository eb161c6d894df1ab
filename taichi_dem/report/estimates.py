"""Estimates of effects that a scene may need, from its numbers, before a run and after it."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_table import LIMITS, Estimate
from taichi_dem.kit.validation import instance, positive
from taichi_dem.loads.pressure import Gravity
from taichi_dem.mesh.topology import may_meet, part_boxes, parts_of, parts_under
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.readings import Run
from taichi_dem.scene import Scene
from taichi_dem.state.model import Model, centres, sums

#: Density of air [kg/m^3], and standard weight [m/s^2].
_AIR, _WEIGHT = 1.2, 9.80665
#: Groups in words.
_OPENS = "faces must open first; stress over strength"
_BENDS = "stress of the weight over tensile strength, at most"
_SHARE = "share of the energy put in, at most"


class PartScales:
    """Numbers of connected parts, arrays (count,)."""

    def __init__(self, model: Model, part: np.ndarray):
        self.model, self.part = model, part
        self.first = np.unique(part, return_index=True)[1]
        self.count, self.of_bonds = len(self.first), part[model.topology.master]
        self.bodies, self.mass = np.bincount(part), self.sum(model.body_mass)
        corners = model.mesh.points[model.mesh.tetrahedra]
        low, high = part_boxes(corners, part)
        edges = corners[:, 1:] - corners[:, :1]
        self.density = self.mass / self.sum(np.abs(np.linalg.det(edges)) / 6.0)
        self.size = (high - low).max(axis=1)
        self.spacing = 2.0 * self.sum(model.body_radius) / self.bodies
        self._join()

    def sum(self, values: np.ndarray) -> np.ndarray:
        """Sum of a number of each body over every part."""
        return np.bincount(self.part, values, minlength=self.count)

    def sum_of_bonds(self, values: np.ndarray) -> np.ndarray:
        """Sum of a number of each bond over every part."""
        return np.bincount(self.of_bonds, values, minlength=self.count)

    def _join(self):
        """Stiffness and damping of the bonds of each part: medians, where bonds differ."""
        model = self.model
        self.is_bonded = np.bincount(self.of_bonds, minlength=self.count) > 0
        stiffness, damping = model.bond_stiffness[:, 0], model.bond_damping[:, 0]
        # The stiffness per area [Pa/m] where a part has no bond; NaN where only bonds have one.
        given = model.material.normal_stiffness
        usual = given if isinstance(given, (int, float)) else math.nan
        normal = np.full(self.count, np.median(stiffness) if model.bond_count else float(usual))
        self.damping = np.zeros(self.count)
        area, pair = 3.0 * model.bonds["area"], 0.5 * self.mass / self.bodies
        order = np.argsort(self.of_bonds, kind="stable")
        parts, begin = np.unique(self.of_bonds[order], return_index=True)
        for p, own in zip(parts, np.split(order, begin[1:])):
            normal[p] = np.median(stiffness[own])
            rate = float(area[own].mean()) / (normal[p] * pair[p])
            self.damping[p] = 2.0 * math.pi * np.median(damping[own]) * math.sqrt(rate)
        self.wave = np.sqrt(normal * self.spacing / self.density)

    def of_materials(self, name: str, choose: Any) -> np.ndarray:
        """A constant of each part: the least or largest of its bodies, as ``choose`` says."""
        materials = self.model.materials
        values = np.array(
            [getattr(material, name) for material in materials.materials], dtype=np.float64
        )
        own = values[materials.of_body[self.first]]
        choose.at(own, self.part, values[materials.of_body])
        return own

    def under(self, effects: Iterable[Any]) -> np.ndarray:
        """Whether any of some effects acts on each part."""
        marks = [parts_under(self.model.mesh, effect, self.part) for effect in effects]
        return np.any([np.zeros(self.count, dtype=bool), *marks], axis=0)

    def stress(self, size: np.ndarray, everywhere: bool) -> np.ndarray:
        """Sum of the stresses of loads and supports [Pa]; NaN where it is not known."""
        of_body, materials = self.model.materials.of_body, self.model.materials.materials
        present = np.zeros((self.count, len(materials)), dtype=bool)
        present[self.part, of_body] = True
        total = np.zeros(self.count)
        for effect in (*self.model.loads, *self.model.supports):
            acts = parts_under(self.model.mesh, effect, self.part) | everywhere
            for p in np.flatnonzero(acts):
                own = [material for material, here in zip(materials, present[p]) if here]
                total[p] += max(effect.stress(material, float(size[p])) for material in own)
        return total

    def bent(self, until: float, borne: np.ndarray) -> np.ndarray:
        """Largest stress of weight in bonded parts that are borne, over the tensile strength."""
        long, thin = self._extents()
        bent = 6.0 * _WEIGHT * long**2 / thin
        most = self.density * np.minimum(bent, math.sqrt(3.0) * self.wave * _WEIGHT * until)
        stress = np.where(borne & self.is_bonded, most, 0.0)
        return stress / self.of_materials("tensile_strength", np.minimum)

    def _extents(self):
        """Longest and shortest side [m] of the box with the second moments of each part."""
        mass, inertia = self.model.body_mass, self.model.body_inertia
        arm = self.model.centre - centres(self.part, mass, self.model.centre)[self.part]
        own = 0.5 * np.trace(inertia, axis1=1, axis2=2)[:, None, None] * np.eye(3) - inertia
        second = sums(self.part, own + mass[:, None, None] * arm[:, :, None] * arm[:, None])
        squares = np.linalg.eigvalsh(second / self.mass[:, None, None])
        sides = np.sqrt(12.0 * np.maximum(squares, 0.0))
        return sides[:, 2], sides[:, 0]

    def worst(self, effect: str, *groups: tuple[np.ndarray, str]) -> Estimate:
        """Estimate of the part that needs an effect most; groups: of each part, and in words."""
        values = np.stack([value for value, _ in groups])
        known = np.where(np.isnan(values), -1.0, values)
        k, p = np.unravel_index(int(np.argmax(known)), known.shape)
        if known[k, p] < LIMITS[1] and np.isnan(values).any():
            k, p = np.argwhere(np.isnan(values))[0]
        part = f"part of body {self.first[p]}: " if self.count > 1 else ""
        return Estimate(effect, float(values[k, p]), part + groups[k][1])


def estimated_effects(scene: Scene, until: float) -> tuple[Estimate, ...]:
    """Estimates of which effects a scene needs, before a run.

    Parameters
    ----------
    scene : Scene
        Scene.
    until : float
        End of the run [s].

    Returns
    -------
    tuple of Estimate
        For each effect a dimensionless group, and negligible, needed or unclear. Print them.

    Raises
    ------
    InputError
        The argument is no Scene, or the time is not positive.

    Notes
    -----
    The stress is that of the loads and supports on a part (``BodyEffect.stress``) and of the motion
    at the start, of all parts where they may meet; the speed is that of a wave of this stress,
    stress / (density wave speed), or the largest at the start, of the part alone. Of several
    materials the least strengths and the largest friction count.
    """
    instance("scene", scene, Scene)
    until, part = positive("until", until), parts_of(scene.mesh)
    model = scene.model()
    velocity, meet = scene.initial_motion.get("velocity"), may_meet(scene, part)
    scales = PartScales(model, part)
    beside, rim, fastest = _speeds(model, velocity, part)
    # An unknown load is NaN, and with it all that follows.
    own = scales.stress(scales.size, False)
    speed = own / (scales.density * scales.wave) + beside + rim**2 / scales.wave
    speed = np.maximum(speed, fastest)
    if meet:
        whole = np.full(scales.count, float(np.ptp(model.mesh.points, axis=0).max()))
        own = scales.stress(whole, True)
        shared = _speeds(model, velocity, np.zeros_like(part))
        beside, rim = (
            np.maximum(inner, outer).max() for inner, outer in zip((beside, rim), shared)
        )
    stress = own + scales.density * (scales.wave * beside + rim**2)
    softening = stress / scales.of_materials("tensile_strength", np.minimum)
    shear = stress / np.maximum(scales.of_materials("cohesion", np.minimum), 1e-300)
    breaks = np.maximum(softening, shear)
    rubs = scales.of_materials("friction", np.maximum) * breaks
    contact, worst = scales.worst("contact", (breaks, _OPENS)), scales.worst
    # Parts that meet touch from the start, others where they break.
    if meet and not contact.group >= scales.count:
        contact = Estimate("contact", float(scales.count), "number of parts that may meet")
    # A part that is borne does not fall; what may hit one at rest is not known.
    borne = scales.under((*model.supports, *model.ground))
    fall = _WEIGHT * until / np.maximum(speed, 1e-300)
    fall = np.where(speed == 0.0, np.where(borne, 0.0, np.nan if meet else fall), fall)
    bends = scales.bent(until, borne | meet), _BENDS
    drag = _AIR * speed * until / (scales.density * scales.spacing)
    return (
        worst("softening", (softening, "stress over tensile strength")),
        worst("slip", (shear, "stress over cohesion")),
        contact,
        worst("friction", (rubs, "friction times stress over strength")),
        worst("bond damping", (scales.damping, "share of a bond's vibration lost in a cycle")),
        worst("gravity", (fall, "speed of a fall over that given"), bends),
        worst("air drag", (drag, "share of momentum lost to air")),
    )


def _speeds(model, velocity, group):
    """Speeds of groups of bodies at the start: beside a rigid motion, of its rim, and largest."""
    speeds = np.zeros((3, int(group.max()) + 1))
    if velocity is None:
        return speeds
    mass = model.body_mass[:, None]
    mean = centres(group, model.body_mass, velocity)[group]
    arm = model.centre - centres(group, model.body_mass, model.centre)[group]
    momentum = sums(group, mass * np.cross(arm, velocity))
    second = sums(group, mass[:, :, None] * arm[:, :, None] * arm[:, None])
    inertia = np.eye(3) * np.trace(second, axis1=1, axis2=2)[:, None, None] - second
    rate = np.einsum("pij,pj->pi", np.linalg.pinv(inertia, hermitian=True), momentum)
    rim = np.cross(rate[group], arm)
    for row, each in zip(speeds, (velocity - mean - rim, rim, velocity)):
        np.maximum.at(row, group, np.linalg.norm(each, axis=1))
    # Rounding of a rigid motion strains nothing.
    speeds[0][speeds[0] <= 1e-9 * speeds[2]] = 0.0
    return speeds


def not_served(
    run: Run, scales: PartScales, energy: np.ndarray, way: np.ndarray
) -> tuple[Estimate, ...]:
    """Estimates of what no law serves, from the ways [m] and energies [J] of bodies and parts."""
    model, lacking, until = run.model, [], run.schedule.time_s
    speed = np.linalg.norm(run.readings.motion()[:, :3], axis=1)
    if not any(isinstance(effect, Gravity) for effect in model.loads):
        active = values(run.state.active_effects, slice(model.body_count))
        borne = scales.under((*model.supports, *model.ground))
        borne |= scales.sum(active & np.int64(CONTACT)) > 0
        fall = _WEIGHT * until
        work = model.body_mass * (_WEIGHT * way + fall * speed + 0.5 * fall**2)
        share = _share(scales.sum(work), energy)
        # What is borne and not moved at all does not fall.
        share = np.where(borne & (energy == 0.0), 0.0, share)
        groups = (share, _SHARE), (scales.bent(until, borne), _BENDS)
        lacking.append(scales.worst("gravity", *groups))
    drag = 0.5 * _AIR * math.pi * model.body_radius**2 * speed**2
    return (*lacking, scales.worst("air drag", (_share(scales.sum(drag * way), energy), _SHARE)))


def _share(work, energy):
    """Share of an energy; not known where there is none."""
    none = np.where(work > 0.0, np.nan, 0.0)
    return np.where(energy > 0.0, work / np.where(energy > 0.0, energy, 1.0), none)
