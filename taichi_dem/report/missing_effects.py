"""Effects that a scene left out and that would have acted in the run."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.mesh.tetrahedra import penetration
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.readings import Kept, Run
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.state.model import Model
from taichi_dem.state.timeline import NEVER

_EPSILON = np.finfo(np.float64).eps
#: Roundings of a coordinate by which two bodies side by side may seem to overlap.
_ROUNDINGS = 16.0


def bond_rounding(run: Run) -> np.ndarray:
    """Heat that rounding alone may have left in each bond's dashpots [J], (bond_count,)."""
    model, substeps = run.model, int(values(run.schedule.evaluations)[0])
    corners = np.abs(model.mesh.points[model.mesh.tetrahedra]).max(axis=(1, 2))
    places = np.abs(values(run.state.position, slice(model.body_count))).max(axis=1)
    far = np.maximum(corners, places)
    reach = np.maximum(far[model.topology.master], far[model.topology.slave])
    area = 3.0 * model.bonds["area"]
    stiffness = model.bond_stiffness.sum(axis=1)
    return 0.5 * substeps * area * stiffness * (_EPSILON * reach) ** 2


@dataclass(frozen=True)
class MissingEffect:
    """An effect that the scene needs and does not list.

    effect: the effect to list. what: the finding in words. count: number of places. where: first
    such bond or body, as unit says; place_m: the middle of its face, or of the body, in the mesh
    [m]. first_s: time at which it was first found [s].
    """

    effect: str
    what: str
    unit: str = "bond"
    count: int = 0
    where: int = -1
    first_s: float = 0.0
    place_m: tuple = ()

    @property
    def row(self) -> dict[str, Any]:
        """What it adds to the table of effects."""
        place = {"since_s": self.first_s, "where": f"{self.unit} {self.where}"}
        said = {"events": self.count, "advice": "list it", "reason": self.what}
        return {"effect": self.effect, **said, **place}

    @property
    def place(self) -> str:
        """Coordinates [m] in words."""
        return ", ".join(f"{x:.3g}" for x in self.place_m)

    def __str__(self):
        return (
            f"{self.effect} is left out, but {self.what}: {self.count}, first {self.unit} "
            f"{self.where} at {self.place} m, t = {self.first_s:.4g} s"
        )


def unserved(model: Model) -> dict[str, MissingEffect]:
    """By name, all effects that a model leaves out, with nothing found yet."""
    roles = {effect.role for effect in model.effects if effect.name}
    material, touch = model.materials, "contact" in roles
    rubs, damps = material.friction > 0.0, material.has_bond_damping
    stretched = "bonds are stretched past their tensile strength"
    sheared = "bonds are sheared past their Coulomb limit"
    strained = "the material has damping and bonds are strained"
    overlap = "bodies overlap where a bond has been released"
    press = "the material has friction and bodies press on each other"
    within = "pairs of bodies are within each other"
    needs: dict[str, tuple[Any, ...]] = {
        "tension": (roles.isdisjoint(("bond", "tension")), "Softening", stretched),
        "shear": (roles.isdisjoint(("bond", "shear")), "ShearSlip", sheared),
        "dashpot": (damps and "dashpot" not in roles, "BondDamping", strained),
        "contact": (not touch, "BodyContact", overlap),
        "friction": (touch and rubs and "friction" not in roles, "StickingFriction", press, "body"),
        "bodies": (not touch, "BodyContact", within, "body"),
    }
    return {name: MissingEffect(*need) for name, (missed, *need) in needs.items() if missed}


class MissingEffects(Kept):
    """Finds where an absent effect would have acted.

    Limits of bonds are watched at every step, all else at recording times. found: a row for each
    need: number of places, the first one, and when [s]. strain: largest strain energy of each bond
    at a recording [J], where dashpots are missing.
    """

    kept = "last_s", "found", "strain"

    def __init__(self, run: Run, volume: SharedVolume):
        self.run, self.volume = run, volume
        self.needs, self.last_s = unserved(run.model), -1.0
        self.found = np.tile([0.0, -1.0, 0.0], (len(self.needs), 1))
        self.strain = np.zeros(run.model.bond_count)

    def sample(self, time_s: float) -> None:
        """Update the findings at a recording time [s]."""
        if time_s == self.last_s:
            return
        self.last_s = time_s
        self.volume.sample(time_s)
        if "dashpot" in self.needs and len(self.strain):
            self.strain = np.maximum(self.strain, self.run.readings.bonds()[:, 0])
        looks = {
            "contact": self._pressed,
            "friction": self._touching,
            "bodies": lambda: self._within(self.volume),
        }
        for name in looks.keys() & self.needs.keys():
            self._see(self.found, name, looks[name](), time_s)

    def _see(self, found, name, places, time_s):
        """Take in the places of a need at a time [s]."""
        row = found[[*self.needs].index(name)]
        if len(places) and not row[0]:
            row[1:] = places[0], time_s
        row[0] = max(row[0], len(places))

    def _pressed(self):
        """Released bonds whose bodies are within each other, by more than rounding."""
        model, bonds = self.run.model, np.flatnonzero(self.run.state.broken())
        if not len(bonds):
            return bonds
        ends = model.topology.master[bonds], model.topology.slave[bonds]
        depth = penetration(*map(self.volume.corners, ends))
        place = values(self.run.state.position, slice(model.body_count))
        reach = np.abs(place).max() + model.body_radius.max()
        return bonds[depth > _ROUNDINGS * _EPSILON * reach]

    def _within(self, volume):
        """First bodies of pairs of two pieces within each other, those that share most first."""
        pairs = volume.pairs[np.argsort(-volume.share, kind="stable")]
        if len(pairs):
            piece = self.run.model.pieces(self.run.state.broken())
            pairs = pairs[np.diff(piece[pairs], axis=1)[:, 0] != 0]
        return pairs[:, 0]

    def _touching(self):
        active = values(self.run.state.active_effects, slice(self.run.model.body_count))
        return np.flatnonzero(active & CONTACT)

    def findings(self, volume: SharedVolume) -> tuple[MissingEffect, ...]:
        """A ``MissingEffect`` for each effect that would have acted; a tuple, empty for none."""
        found, schedule, model = self.found.copy(), self.run.schedule, self.run.model
        now_s = schedule.time_s
        ticks = values(self.run.state.passed, slice(model.bond_count))
        looks = {
            "bodies": (self._within(volume), now_s),
            "tension": _passed(ticks[:, 0], schedule),
            "shear": _passed(ticks[:, 1], schedule),
            "dashpot": (np.flatnonzero(self.strain > bond_rounding(self.run)), self.last_s),
        }
        for name in looks.keys() & self.needs.keys():
            self._see(found, name, *looks[name])
        return tuple(
            self._told(need, *row)
            for need, row in zip(self.needs.values(), found.tolist())
            if row[0]
        )

    def _told(self, need, count, where, first_s):
        model, where = self.run.model, int(where)
        place = model.centre[where] if need.unit == "body" else middle_of_bond(model, where)
        figures = {"count": int(count), "where": where, "first_s": first_s}
        return replace(need, place_m=tuple(place.tolist()), **figures)


def middle_of_bond(model: Model, bond: int) -> np.ndarray:
    """Middle of a bond's face in the mesh [m], (3,)."""
    return model.mesh.points[model.topology.vertices[bond]].mean(axis=0)


def _passed(ticks, schedule):
    """Bonds that exceeded a limit, in the order of time, and when the first did [s]."""
    places = np.flatnonzero(ticks != NEVER)
    order = places[np.argsort(ticks[places], kind="stable")]
    first = float(ticks[order[0]]) if len(order) else 0.0
    return order, first * schedule.tick_seconds
