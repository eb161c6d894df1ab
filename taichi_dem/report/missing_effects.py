"""Effects that a scene left out and that would have acted in the run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Optional, Union

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.mesh.contact_spheres import ContactSpheres, spheres_of_faces
from taichi_dem.mesh.tetrahedra import penetration
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.creep import Creep
from taichi_dem.report.readings import Readings
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.scene import REMEDY, remedy
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.timeline import NEVER
from taichi_dem.step.schedule import Schedule

_EPSILON = np.finfo(np.float64).eps
#: Roundings of a coordinate by which two bodies side by side may seem to overlap.
_ROUNDINGS = 16.0
#: Overlap of two spheres, as a share of the distance at which they touch, below which they count
#: as apart: coordinates of a mesh file may be rounded to seven digits.
LEAST_OVERLAP = 1e-4
#: Divisions of faces, for spheres of bodies in a scene without contact.
_DIVISIONS = 5
#: Pairs of which spheres are compared at a recording, those that share most first.
_MOST_PAIRS = 2000
#: Way of a body between two looks, as a share of its radius, that may hide a passage.
_LEAP = 1.0


def bond_rounding(model: Model, state: State, substeps: int) -> np.ndarray:
    """Heat that rounding alone may leave in each bond's dashpots [J], (bond_count,).

    A bond's opening is the difference of its bodies' coordinates of up to X [m], known to eps X. In
    every substep rounding may thus put into the bond the energy of such an opening,
    A (k_n + k_s) (eps X)^2 / 2, which its dashpots then take.
    """
    corners = np.abs(model.mesh.points[model.mesh.tetrahedra]).max(axis=(1, 2))
    places = np.abs(values(state.position, slice(model.body_count))).max(axis=1)
    far = np.maximum(corners, places)
    reach = np.maximum(far[model.topology.master], far[model.topology.slave])
    area = 3.0 * model.bonds["area"]
    stiffness = model.bond_stiffness.sum(axis=1)
    return 0.5 * substeps * area * stiffness * (_EPSILON * reach) ** 2


@dataclass
class MissingEffect:
    """A need that no listed effect serves.

    effect: the effect to list. what: the finding in words. count: number of places. where: first
    such bond or body, as unit says; place_m: the middle of its face, or of the body, in the mesh
    [m]. first_s: time at which it was first found [s]. is_chosen: whether the user listed the
    effect in a form that leaves it out.
    """

    effect: str
    what: str
    count: int = 0
    where: int = -1
    place_m: tuple = ()
    first_s: float = 0.0
    unit: str = "bond"
    is_chosen: bool = False

    def see(self, places: Union[Sequence[int], np.ndarray], time_s: float) -> None:
        """Take in the places of a recording at a time [s], numbers of bonds or bodies."""
        if len(places) and not self.count:
            self.where, self.first_s = int(places[0]), time_s
        self.count = max(self.count, len(places))

    def __str__(self):
        place = ", ".join(f"{x:.3g}" for x in self.place_m)
        return (
            f"{self.effect} is left out, but {self.what}: {self.count}, first {self.unit} "
            f"{self.where} at {place} m, t = {self.first_s:.4g} s"
        )


#: Needs by role: the effect that serves it, the finding in words, and where it is found.
_NEEDS = {
    "tension": ("Softening", "bonds are stretched past their tensile strength", "bond"),
    "shear": ("ShearSlip", "bonds are sheared past their Coulomb limit", "bond"),
    "dashpot": ("BondDamping", "the material has damping and bonds are strained", "bond"),
    "contact": ("SphereContact", "bodies overlap where a bond has been released", "bond"),
    "friction": ("Friction", "the material has friction and bodies press on each other", "body"),
    # The words tell the figures, once they are known.
    "creep": ("StickingFriction", "", "body"),
    "bodies": ("SphereContact", "pairs of bodies are within each other", "body"),
    "bare": (
        REMEDY,
        "pairs of bodies are within each other at outer faces without spheres",
        "body",
    ),
}


def unserved(model: Model) -> dict[str, MissingEffect]:
    """An empty ``MissingEffect`` for every need that no effect of a model serves."""
    roles = {effect.role for effect in model.effects if effect.name}
    material = model.materials
    listed = {
        "tension": "tension" not in roles,
        "shear": "shear" not in roles,
        "dashpot": "dashpot" not in roles and material.has_bond_damping,
        "contact": "contact" not in roles,
        "friction": "contact" in roles and "friction" not in roles and material.friction > 0.0,
        "creep": any(material.friction > 0.0 and not e.remembers for e in _friction(model)),
        "bodies": "contact" not in roles,
        "bare": "contact" in roles and not model.contact.outer_faces,
    }
    found = {
        name: MissingEffect(effect, what, unit=unit)
        for name, (effect, what, unit) in _NEEDS.items()
        if listed[name]
    }
    if "bare" in found:
        found["bare"].effect, found["bare"].is_chosen = remedy(model.contact), True
    if "friction" in found and not material.friction_has_dashpots:
        # Friction is a dashpot's force up to a limit: without a dashpot springs alone hold.
        found["friction"].effect = "StickingFriction"
    return found


def _friction(model):
    """The law of friction of a model, if one is listed."""
    return [effect for effect in model.effects if effect.name and effect.role == "friction"]


class MissingEffects:
    """Finds where an absent effect would have acted.

    Limits of bonds are watched at every step, all else at recording times.
    strain: largest strain energy of each bond at one of them [J], where dashpots are missing.
    leap: longest way of a body between two comparisons of bodies, as a share of its radius.
    """

    def __init__(
        self,
        model: Model,
        state: State,
        readings: Readings,
        volume: SharedVolume,
        schedule: Schedule,
    ):
        self.model, self.state, self.readings = model, state, readings
        self.volume, self.schedule, self.last_s = volume, schedule, -1.0
        self.needed = unserved(model)
        self.creep = Creep(model, state, readings) if "creep" in self.needed else None
        self.strain, self.leap = np.zeros(model.bond_count), 0.0

    def sample(self, time_s: float) -> None:
        """Update the findings at a recording time [s]."""
        if time_s == self.last_s:
            return
        self.last_s = time_s
        self.leap = max(self.leap, self.volume.way())
        if self.volume.sample(time_s):
            self._see_bodies(self.needed, self.volume, time_s)
        if self.model.bond_count and "contact" in self.needed:
            self.needed["contact"].see(self._pressed(), time_s)
        if self.model.bond_count and "dashpot" in self.needed:
            self.strain = np.maximum(self.strain, self.readings.bonds()[:, 0])
        if "friction" in self.needed:
            active = values(self.state.active_effects, slice(self.model.body_count))
            self.needed["friction"].see(np.flatnonzero(active & CONTACT), time_s)

        if self.creep is not None:
            self.needed["creep"].see(self.creep.sample(time_s), time_s)

    def _pressed(self):
        """Released bonds whose bodies are within each other, by more than rounding."""
        top, (place, turn) = self.model.topology, self.volume.now()
        bonds = np.flatnonzero(self.state.broken())
        ends = top.master[bonds], top.slave[bonds]
        depth = penetration(*(self.volume.corners(place, turn, bodies) for bodies in ends))
        reach = np.abs(place).max() + self.model.body_radius.max()
        return bonds[depth > _ROUNDINGS * _EPSILON * reach]

    def _see_bodies(self, needed, volume, time_s):
        """Take in the bodies within each other of a look."""
        for name in {"bodies", "bare"} & set(needed):
            needed[name].see(self._overlapping(volume, name == "bare"), time_s)

    def _overlapping(self, volume, bare):
        """First bodies of pairs near each other whose spheres would touch.

        volume: what has looked for them. bare: whether only pairs count of which a touching sphere
        is on a bare outer face.
        """
        pairs = volume.near_pairs[:_MOST_PAIRS]
        broken = self.state.broken()
        bonds = self.model.topology.body_bond
        # Bond -1 stands for an outer face, which is as free as a broken one.
        free, outer = np.append(broken, True)[bonds], bonds < 0
        able = free.any(axis=1)[pairs].all(axis=1)
        if bare:
            able &= outer.any(axis=1)[pairs].any(axis=1)
        pairs = pairs[able]
        if not len(pairs):
            return pairs[:, 0]
        spheres = self.spheres
        place, turn = volume.seen
        side = []
        for bodies in pairs.T:
            local = spheres.centre[bodies].reshape(len(pairs), -1, 3)
            centre = np.einsum("nij,nsj->nsi", turn[bodies], local) + place[bodies][:, None]
            marks = [np.repeat(of[bodies], spheres.radius.shape[2], axis=1) for of in (free, outer)]
            side.append((centre, spheres.radius[bodies].reshape(len(pairs), -1), *marks))
        (centre, radius, open_one, outer_one), (other, radius_other, open_two, outer_two) = side
        reach = radius[:, :, None] + radius_other[:, None]
        x, y, z = (centre[:, :, None, k] - other[:, None, :, k] for k in range(3))
        hit = np.sqrt(x * x + y * y + z * z) < (1.0 - LEAST_OVERLAP) * reach
        hit &= open_one[:, :, None] & open_two[:, None]
        if bare:
            hit &= outer_one[:, :, None] | outer_two[:, None]
        return pairs[hit.any(axis=(1, 2)), 0]

    @cached_property
    def spheres(self) -> ContactSpheres:
        """Spheres of all faces, those of the scene or, without contact, the paper's."""
        if self.model.has_contact:
            return self.model.spheres
        return spheres_of_faces(self.model.mesh, self.model.centre, _DIVISIONS)

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        rows = [[m.count, m.where, m.first_s] for m in self.needed.values()]
        return {
            "needed": np.array(rows, dtype=np.float64).reshape(-1, 3),
            "looks": np.array([self.last_s, self.leap]),
            "strain": self.strain.copy(),
            **(self.creep.saved() if self.creep is not None else {}),
        }

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        for finding, row in zip(self.needed.values(), saved["needed"].tolist()):
            finding.count, finding.where, finding.first_s = int(row[0]), int(row[1]), row[2]
        self.last_s, self.leap = saved["looks"].tolist()
        self.strain = saved["strain"].copy()
        if self.creep is not None:
            self.creep.resume(saved)

    def findings(self, volume: Optional[SharedVolume] = None) -> tuple[MissingEffect, ...]:
        """A ``MissingEffect`` for each effect that would have acted; a tuple, empty for none.

        volume: a look at the end, which also finds bodies that have moved by little; the last look
        by default.
        """
        needed = {name: replace(finding) for name, finding in self.needed.items()}
        volume = self.volume if volume is None else volume
        self._see_bodies(needed, volume, self.schedule.time_s)
        ticks = values(self.state.passed, slice(self.model.bond_count))
        for column, name in enumerate(("tension", "shear")):
            if name in needed:
                self._see_passed(needed[name], ticks[:, column])
        if "dashpot" in needed:
            substeps = int(values(self.schedule.evaluations)[0])
            rounding = bond_rounding(self.model, self.state, substeps)
            needed["dashpot"].see(np.flatnonzero(self.strain > rounding), self.last_s)
        if self.creep is not None:
            needed["creep"].what = self.creep.words()
        found = [finding for finding in needed.values() if finding.count]
        return tuple(replace(one, place_m=self._position_of(one)) for one in found)

    def _see_passed(self, finding, ticks):
        """Take in the ticks at which bonds first exceeded a limit."""
        places = np.flatnonzero(ticks != NEVER)
        order = places[np.argsort(ticks[places], kind="stable")]
        first = float(ticks[order[0]]) if len(order) else 0.0
        finding.see(order, first * self.schedule.tick_seconds)

    def unseen(self) -> tuple[str, ...]:
        """A sentence where bodies may have passed through each other between two recordings."""
        open_roles = {"bodies", "bare"} & set(self.needed)
        leap = max(self.leap, self.volume.way())
        if not open_roles or leap <= _LEAP or self.volume.fragments() == 1:
            return ()
        return (
            f"bodies without contact spheres moved up to {leap:.2g} times their radius "
            f"between two samples: whether they passed through each other was not seen",
        )

    def _position_of(self, finding):
        if finding.unit == "body":
            return tuple(self.model.centre[finding.where].tolist())
        corners = self.model.topology.vertices[finding.where]
        return tuple(self.model.mesh.points[corners].mean(axis=0).tolist())
