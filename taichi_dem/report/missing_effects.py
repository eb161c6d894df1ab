"""Effects that a scene left out and that would have acted in the run; bodies that creep.

Friction without springs is a drag up to Coulomb's limit: below it bodies creep, also on a slope
flatter than the friction angle. Creep differs from a collision in its duration and in the impulse
of the drag: pressed bodies separate within damping over stiffness, and sliding pieces stop once the
drag has taken their momentum. Pieces that still slide as fast after many times that impulse are
pushed by a load.
"""

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

#: Share of its limit below which friction would hold; a contact near it may slide next.
_HELD = 0.98
#: Impulse of the drag over the momentum of the sliding, and time of the sliding over that of a
#: collision, from which on a load must push.
_PUSHED = 10.0
#: Ratio of two speeds, or of two lengths, up to which they are about equal.
_ALIKE = 2.0
#: What is known of a pair: friction [N], speed [m/s], impulse [N s] and way [m] since it began to
#: slide, largest speed, when it began [s], and where the second body was then from the first [m].
_FORCE, _SPEED, _IMPULSE, _WAY, _FASTEST, _SINCE, _OFFSET = range(7)
_EPSILON = np.finfo(np.float64).eps
#: Roundings of a coordinate by which two bodies side by side may seem to overlap.
_ROUNDINGS = 16.0


class Creep(Kept):
    """Follows pairs of bodies that slide below the limit of friction, at recording times.

    speed: largest of a creep so far [m/s]. share: of its limit that friction took then.
    """

    kept = "time_s", "speed", "share", "code", "table"
    grows = "code", "table"

    def __init__(self, run: Run):
        self.run, self.time_s, self.speed, self.share = run, 0.0, 0.0, 0.0
        self.code, self.table = np.zeros(0, dtype=np.int64), np.zeros((0, 9))
        law, model = run.model.contact, run.model
        self.softest, self.parting_s = np.inf, 0.0
        if law is not None:
            stiffness, damping = law.strongest(model.mesh, model.materials)
            self.softest = float(np.min(stiffness))
            self.parting_s = float(np.max(damping)) / self.softest

    def sample(self, time_s: float) -> np.ndarray:
        """Bodies that creep at a recording time [s]."""
        count = self.run.model.body_count
        found = self.run.readings.contacts_now()
        force, bound, power = (found[name] for name in ("rub", "bound", "rub_power"))
        bodies = self.run.contacts.store.near_table()[0]
        slides = (force > 0.0) & (force < _HELD * bound)
        bodies, force, bound = bodies[slides], force[slides], bound[slides]
        place = values(self.run.state.position, slice(count))
        offset, speed = place[bodies[:, 1]] - place[bodies[:, 0]], power[slides] / force
        code, rest = bodies[:, 0].astype(np.int64) * count + bodies[:, 1], np.zeros_like(force)
        table = np.column_stack([force, speed, rest, rest, speed, rest + time_s, offset])
        self._go_on(code, table, time_s - self.time_s)
        self.code, self.table, self.time_s = code, table, time_s
        lasts = time_s - table[:, _SINCE] > _PUSHED * self.parting_s
        places = np.flatnonzero(lasts & _goes_far(table, offset, bound / self.softest))
        if len(places):
            places = places[self._is_pushed(bodies[places], table[places])]
        if len(places):
            self.speed = max(self.speed, float(speed[places].max()))
            self.share = float(force[places].sum() / bound[places].sum())
        return np.unique(bodies[places])

    def _go_on(self, code, table, elapsed):
        """Add what pairs have done since the last look, where they slide on as fast as before."""
        _, now, then = np.intersect1d(code, self.code, assume_unique=True, return_indices=True)
        before, after = self.table[then], table[now]
        fastest = np.maximum(before[:, _FASTEST], after[:, _SPEED])
        steady = _ALIKE * after[:, _SPEED] >= fastest
        now, before, after = now[steady], before[steady], after[steady]
        mean = 0.5 * elapsed * (before[:, :2] + after[:, :2])
        table[now, _IMPULSE : _WAY + 1] = before[:, _IMPULSE : _WAY + 1] + mean
        table[now, _FASTEST] = fastest[steady]
        table[now, _SINCE:] = before[:, _SINCE:]

    def _is_pushed(self, bodies, table):
        """Whether the drag between two pieces would have stopped them many times over."""
        model = self.run.model
        piece = model.pieces(self.run.state.broken())
        mass = np.bincount(piece, model.body_mass, minlength=model.body_count)
        ends = np.sort(piece[bodies], axis=1)
        _, group = np.unique(ends, axis=0, return_inverse=True)
        group = group.reshape(-1)  # NumPy 2.0 returns a column
        impulse = np.bincount(group, table[:, _IMPULSE])[group]
        fastest = np.zeros(group.max() + 1)
        np.maximum.at(fastest, group, table[:, _FASTEST])
        lighter = mass[ends].min(axis=1)
        return (ends[:, 0] != ends[:, 1]) & (impulse > _PUSHED * lighter * fastest[group])

    def words(self) -> str:
        """The finding in words."""
        return (
            f"bodies in contact creep under a steady load, at up to {1e3 * self.speed:.2g} mm/s, "
            f"though this takes {100.0 * self.share:.2g} % of the friction that could hold them"
        )


def _goes_far(table, offset, least):
    """Whether pairs have moved as far as they have slid, farther than a spring would let them."""
    way = table[:, _WAY]
    moved = np.linalg.norm(offset - table[:, _OFFSET:], axis=1)
    return (way > least) & (_ALIKE * moved > way) & (moved < _ALIKE * way)


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
    sticking = "StickingFriction"
    drags = any(e.role == "friction" and e.name and not e.remembers for e in model.effects)
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
        "friction": (touch and rubs and "friction" not in roles, sticking, press, "body"),
        # The words tell the figures, once they are known.
        "creep": (rubs and drags, sticking, "", "body"),
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
        self.run, self.volume, self.creep = run, volume, Creep(run)
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
            "creep": lambda: self.creep.sample(time_s),
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
            self._told(name, need, *row)
            for (name, need), row in zip(self.needs.items(), found.tolist())
            if row[0]
        )

    def _told(self, name, need, count, where, first_s):
        model, where = self.run.model, int(where)
        what = self.creep.words() if name == "creep" else need.what
        place = model.centre[where] if need.unit == "body" else middle_of_bond(model, where)
        figures = {"count": int(count), "where": where, "first_s": first_s}
        return replace(need, what=what, place_m=tuple(place.tolist()), **figures)


def middle_of_bond(model: Model, bond: int) -> np.ndarray:
    """Middle of a bond's face in the mesh [m], (3,)."""
    return model.mesh.points[model.topology.vertices[bond]].mean(axis=0)


def _passed(ticks, schedule):
    """Bonds that exceeded a limit, in the order of time, and when the first did [s]."""
    places = np.flatnonzero(ticks != NEVER)
    order = places[np.argsort(ticks[places], kind="stable")]
    first = float(ticks[order[0]]) if len(order) else 0.0
    return order, first * schedule.tick_seconds
