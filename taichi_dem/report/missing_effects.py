"""Effects that a scene left out and that would have acted in the run."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.laws.contracts import PARTS_OF_BOND
from taichi_dem.laws.roles import usual_laws
from taichi_dem.mesh.tetrahedra import penetration
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.readings import Kept, Run
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.state.model import Model
from taichi_dem.state.timeline import NEVER

_EPSILON = np.finfo(np.float64).eps
#: Roundings of a coordinate by which two bodies side by side may seem to overlap.
_ROUNDINGS = 16.0
_WITHIN = "pairs of bodies overlap"
#: By role, why a scene needs the usual law that it lacks.
_FOUND = {
    "tension": "bonds are stretched past their tensile strength",
    "shear": "bonds are sheared past their Coulomb limit",
    "dashpot": "the material has damping and bonds are strained",
    "contact": "bodies overlap where a bond has been released",
    "friction": "the material has friction and bodies press on each other",
}


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
    such bond or body; place_m: middle of its face, or of the body [m]. first_s: time of it [s].
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
            f"{self.effect} is left out, but {self.what}: {self.count} in all, first {self.unit} "
            f"{self.where} at {self.place} m, t = {self.first_s:.4g} s"
        )


def unserved(model: Model) -> dict[str, MissingEffect]:
    """Usual laws that a model leaves out, by role, with nothing found yet; "bodies" beside them.

    Without contact, pairs of bodies may be within each other wherever they are.
    """
    roles = {effect.role for effect in model.effects if effect.name}
    laws = {law.role: law for law in usual_laws(model.mesh, model.materials, roles)}
    if "bond" in laws:
        # Its limits are watched apart.
        laws |= dict.fromkeys(PARTS_OF_BOND, laws.pop("bond"))
    if "contact" in laws:
        laws.pop("friction", None)
    needs = {role: MissingEffect(type(law).__name__, _FOUND[role]) for role, law in laws.items()}
    if "contact" in needs:
        needs["bodies"] = replace(needs["contact"], what=_WITHIN, unit="body")
    elif "friction" in needs:
        needs["friction"] = replace(needs["friction"], unit="body")
    return needs


class MissingEffects(Kept):
    """Finds where an absent effect would have acted.

    Limits of bonds are watched at every step, all else at recording times. found: a row for each
    need: number of places, the first, and when [s]. strain: largest of each bond, for dashpots [J].
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
        findings, schedule, model = self.found.copy(), self.run.schedule, self.run.model
        ticks = values(self.run.state.passed, slice(model.bond_count))
        looks = {
            "bodies": (self._within(volume), schedule.time_s),
            "tension": _passed(ticks[:, 0], schedule),
            "shear": _passed(ticks[:, 1], schedule),
            "dashpot": (np.flatnonzero(self.strain > bond_rounding(self.run)), self.last_s),
        }
        for name in looks.keys() & self.needs.keys():
            self._see(findings, name, *looks[name])
        rows = zip(self.needs.values(), findings.tolist())
        return tuple(placed(need, model, *row) for need, row in rows if row[0])


def placed(found: Any, model: Model, count: float, where: float, first_s: float) -> Any:
    """A ``MissingEffect`` with how often, where and when [s] it was found."""
    if found.unit == "body":
        place = model.centre[int(where)]
    else:
        place = model.mesh.points[model.topology.vertices[int(where)]].mean(axis=0)
    figures = {"count": int(count), "where": int(where), "first_s": first_s}
    return replace(found, place_m=tuple(place.tolist()), **figures)


def _passed(ticks, schedule):
    """Bonds that exceeded a limit, in the order of time, and when the first did [s]."""
    places = np.flatnonzero(ticks != NEVER)
    order = places[np.argsort(ticks[places], kind="stable")]
    first = float(ticks[order[0]]) if len(order) else 0.0
    return order, first * schedule.tick_seconds
