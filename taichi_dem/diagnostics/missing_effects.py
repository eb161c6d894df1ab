"""Effects that a scene left out and the run needs, found at recording times."""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Optional, Union

import numpy as np

from taichi_dem.contact_search.contacts import Contacts
from taichi_dem.diagnostics.outer_faces import OuterFaces, OuterOverlaps
from taichi_dem.diagnostics.part_overlaps import PartOverlaps
from taichi_dem.diagnostics.readings import Readings
from taichi_dem.mesh.parts import parts_of
from taichi_dem.scene import REMEDY

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.state import State


@dataclass
class MissingEffect:
    """A need that no listed effect serves.

    effect: the effect to list. what: the finding in words. times: recordings with the finding, of
    ``looks``. most: largest number of places in one of them. where: first such bond or body, as
    unit says; place_m: the middle of its face, or of the body, in the mesh [m]. first_s: time of
    the first [s].
    """

    effect: str
    what: str
    times: int = 0
    looks: int = 0
    most: int = 0
    where: int = -1
    place_m: tuple = ()
    first_s: float = 0.0
    unit: str = "bond"

    def see(
        self,
        places: Union[Sequence[int], np.ndarray],
        time_s: float,
        middle: Callable[[int], tuple[float, ...]],
    ) -> None:
        """Add the findings of a recording at a time [s].

        places: numbers of the bonds or bodies, one for every sight. middle: function of such a
        number, its place in the mesh [m].
        """
        if not len(places):
            return
        if self.times == 0:
            self.where, self.first_s = int(places[0]), time_s
            self.place_m = middle(self.where)
        self.times += 1
        self.most = max(self.most, len(places))

    def __str__(self):
        place = ", ".join(f"{x:.3g}" for x in self.place_m)
        return (
            f"{self.effect} is left out, but {self.what}: up to {self.most} at a time, first at "
            f"t = {self.first_s:.4g} s ({self.unit} {self.where} at {place} m), seen at "
            f"{self.times} of {self.looks} recordings"
        )


_NEEDS = (
    ("tension", "Softening", "bonds are stretched past their tensile strength"),
    ("shear", "ShearSlip", "bonds are sheared past their Coulomb limit"),
    ("contact", "SphereContact", "bodies overlap where a bond has been released"),
)
_OVERLAP = "pairs of bodies overlap at outer faces, which carry no contact spheres"


def _outer_faces(model, state, outer_overlaps):
    """Detector of bodies that overlap at outer faces without spheres; None where none can.

    Without contact a solid in one piece can only meet its own fragments, which is found at its
    released bonds.
    """
    if model.has_contact:
        return None if model.contact.outer_faces else OuterFaces(model, state, outer_overlaps)
    part = parts_of(model.mesh)
    return PartOverlaps(model, state, part) if part.any() else None


def unserved(roles: Container[str]) -> dict[str, MissingEffect]:
    """An empty ``MissingEffect`` by role, for every need that no effect of these roles serves."""
    return {role: MissingEffect(effect, what) for role, effect, what in _NEEDS if role not in roles}


class MissingEffects:
    """Counts the places where an absent effect would have acted, at recording times.

    touching: most pairs of bodies in contact at one of them.
    """

    def __init__(
        self,
        model: "Model",
        state: "State",
        readings: Readings,
        contacts: Optional[Contacts],
        outer_overlaps: Optional[OuterOverlaps] = None,
    ):
        self.model, self.state, self.readings = model, state, readings
        self.contacts = contacts
        self.touching = self.looks = 0
        self.last_s = -1.0
        self.needed = unserved({effect.role for effect in model.effects if effect.name})
        self.outer_faces = _outer_faces(model, state, outer_overlaps)
        self.outer = MissingEffect(REMEDY, _OVERLAP, unit="body")
        material = model.material
        self.limits = material.tensile_strength, material.cohesion, material.friction

    def sample(self, time_s: float) -> None:
        """Update the findings at a recording time [s]."""
        if time_s == self.last_s:
            return
        self.looks, self.last_s = self.looks + 1, time_s
        self._count_touching()
        if self.outer_faces is not None:
            later = self.outer_faces.overlaps()
            pairs = np.repeat(np.arange(len(later)), later)
            self.outer.see(pairs, time_s, self._centre)
        if not self.needed or self.model.bond_count == 0:
            return
        marks = np.zeros((self.model.bond_count, 3), dtype=np.int32)
        self.readings.beyond_limits(*self.limits, marks)
        for column, (role, _, _) in enumerate(_NEEDS):
            if role in self.needed:
                self.needed[role].see(np.flatnonzero(marks[:, column]), time_s, self._middle)

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        rows = [[m.times, m.most, m.where, m.first_s] for m in self._all()]
        return {
            "needed": np.array(rows, dtype=np.float64),
            "looks": np.array([self.looks, self.touching, self.last_s]),
        }

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        for finding, row in zip(self._all(), saved["needed"].tolist()):
            finding.times, finding.most, finding.where = (int(value) for value in row[:3])
            finding.first_s = row[3]
            if finding.times:
                finding.place_m = self._position_of(finding)
        looks, touching, self.last_s = saved["looks"].tolist()
        self.looks, self.touching = int(looks), int(touching)

    def _count_touching(self):
        contacts = self.contacts
        if contacts is not None:
            _, _, deepest = contacts.store.near_table()
            self.touching = max(self.touching, int((deepest > 0.0).sum()))

    def _all(self):
        return (*self.needed.values(), self.outer)

    def _position_of(self, finding):
        return (self._centre if finding is self.outer else self._middle)(finding.where)

    def _centre(self, body):
        return tuple(self.model.centre[body].tolist())

    def _middle(self, bond):
        corners = self.model.topology.vertices[bond]
        return tuple(self.model.mesh.points[corners].mean(axis=0).tolist())

    def findings(self) -> tuple[MissingEffect, ...]:
        """A ``MissingEffect`` for each effect that was needed, an empty tuple where none was."""
        found = [finding for finding in self._all() if finding.times]
        return tuple(replace(finding, looks=self.looks) for finding in found)
