"""Detect diverged runs: tell where and why, and advise a shorter step or other constants."""

import math
import time

import numpy as np

from taichi_dem.contact.contacts import FARTHEST
from taichi_dem.kit.allocation import values
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.physics.sphere_pair import CONTACT, DEEPEST_SHARE, SUNK
from taichi_dem.report.energy_balance import EnergyBalance, unexplained_share
from taichi_dem.report.readings import Run
from taichi_dem.report.resolution import ROUNDING, is_bounded, limits_of, present_steps, way_of
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.step.drivers import CALL_SECONDS

#: Unexplained energy beyond which a run counts as diverged, as a share of the energy present.
ENERGY_FROM_NOWHERE = 0.5
#: Overlap of two contact spheres beyond recovery, as a share of the distance at which they touch:
#: their centres are about to pass each other. A small sphere may be inside a large one.
DEEPEST_OVERLAP = 0.95
#: Share of the time that a hurried check may take: it reads every bond, a tenth of a call of the
#: driver at 100,000 bodies.
SHARE = 0.02
#: Share of all energy that an account may leave unexplained while the step is not to blame. Steps
#: at half of their limits, those that are advised, leave some per cent.
CLOSED = 0.1
#: Factor by which a bound or a stiffness that is not the step's is raised at a time.
RAISED = 10.0
#: Criteria of a step in words.
_PARTS = {"stiffness": "springs", "dashpot": "dashpots"}


class DivergenceCheck:
    """Checks a run after every call of the driver; raises SimulationDiverged with the place."""

    def __init__(self, run: Run, energy_balance: EnergyBalance):
        self.run, self.energy_balance = run, energy_balance
        # Energy [J] of springs whose ends are known to a few units in the last place.
        model, area = run.model, 3.0 * run.model.bonds["area"]
        place = 4.0 * np.finfo(float).eps * np.abs(model.mesh.points).max()
        stiffness = model.bond_stiffness.max(axis=1, initial=0.0)
        self.rounded_once = max(0.5 * float(np.sum(area * stiffness)) * place**2, 1e-300)
        self.rest_until = self.last_spent = 0.0

    def check(self, hurried: bool = False) -> None:
        """Raise SimulationDiverged for a runaway body, extreme overlap, or unexplained energy."""
        self._check_speed()
        # The system takes its time to tell the time of all threads.
        started = time.process_time() if hurried else 0.0
        if hurried and started < self.rest_until:
            return
        self._check_overlap()
        self._check_energy()
        if hurried:
            now = time.process_time()
            # A check that compiles, as the first with contacts does, is longer than its neighbours:
            # the shorter of two is a measure. One that takes no more than its share of a call is
            # never skipped, so not in small scenes.
            spent = now - started
            self.rest_until = now + min(spent, self.last_spent) / SHARE - CALL_SECONDS
            self.last_spent = spent

    def _check_speed(self):
        run, body = self.run, int(values(self.run.state.bad_body))
        if body >= run.model.body_count:
            return
        motion = run.state.motion()
        speed = math.hypot(*motion["velocity"][body])
        what = f"moves at {speed:.3g} m/s"
        # A speed that is no number is beyond every bound.
        if run.contacts is None or not speed < values(run.state.max_speed2) ** 0.5:
            why = "loads or the start gave it this energy"
            faster = _to_try(why, "max_speed", RAISED * speed, "m/s")
            raise self._error(body, what, self._shorter_step(body) or faster)
        extent = float(run.model.geometry.extents(run.model)[body])
        allowed = FARTHEST * extent / (speed + math.hypot(*motion["spin"][body]) * extent)
        shorter = _to_try(f"contacts allow {allowed:.3g} s", "step", 0.5 * allowed, "s")
        what += ", too far in a step to follow its contacts"
        raise self._error(body, what, shorter)

    def _check_overlap(self):
        contacts = self.run.contacts
        if contacts is None:
            return
        if values(contacts.store.near_count):
            self._check_pairs(contacts)
        marks = values(self.run.state.active_effects, slice(self.run.model.body_count))
        sunk = np.flatnonzero(marks & np.int64(SUNK))
        if len(sunk):
            whom = f"body {sunk[1]}" if len(sunk) == 2 else "another one"
            share = f"more than {100 * DEEPEST_SHARE:g} % of its volume"
            raise self._too_deep(int(sunk[0]), f"has shared {share} with {whom}")

    def _check_pairs(self, contacts):
        bodies, _, deepest = contacts.store.near_table()
        pair = int(deepest.argmax())
        if not contacts.geometry.by_face:
            if deepest[pair] > DEEPEST_SHARE:
                self._shares(*bodies[pair].tolist(), deepest[pair])
        elif deepest[pair] > DEEPEST_OVERLAP:
            body, other = bodies[pair].tolist()
            share = f"{100 * deepest[pair]:.0f} % of their radii"
            raise self._too_deep(body, f"has a contact sphere inside one of body {other} ({share})")

    @property
    def keeps_bodies_apart(self) -> bool:
        """Whether contact of all faces is to keep bodies apart."""
        contact = self.run.model.contact
        return contact is not None and bool(contact.geometry.outer_faces)

    def check_shared(self, volume: SharedVolume) -> None:
        """Raise SimulationDiverged where contact of all faces has not kept two bodies apart."""
        if not self.keeps_bodies_apart or not len(volume.share):
            return
        place = int(volume.share.argmax())
        if volume.share[place] > DEEPEST_SHARE:
            self._shares(*volume.pairs[place].tolist(), volume.share[place])

    def _shares(self, body, other, share):
        what = f"shares {100 * share:.0f} % of its volume with body {other}"
        raise self._too_deep(body, what)

    def _check_energy(self):
        account = self.energy_balance.account()
        present = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
        given = self.energy_balance.start_energy + abs(account["load_work"])
        given += abs(account["support_work"])
        bound = ENERGY_FROM_NOWHERE * max(given, self.round_off())
        if -account["residual"] > bound and present > given:
            velocity = self.run.state.motion()["velocity"]
            body = int(np.linalg.norm(velocity, axis=1).argmax())
            what = f"is the fastest while {-account['residual']:.3g} J of energy are unexplained"
            shorter = self._shorter_step(body, to_blame=True)
            raise self._error(body, what, shorter or ("which nothing limits", {}))

    def round_off(self) -> float:
        """Bound of the energy [J] that rounding of positions has put into the bonds so far."""
        return max(1, int(values(self.run.schedule.evaluations)[0])) * self.rounded_once

    def _error(self, body, what, remedy):
        """SimulationDiverged that says what is wrong with a body, and what to change."""
        schedule, own = self.run.schedule, present_steps(self.run)[body]
        step = f"its step was {own:.3g} s (level {math.log2(schedule.dt0 / own):.0f})"
        words, advice = f"body {body} {what}; {step}, {remedy[0]}", remedy[1]
        above = self._above_limit() if values(self.run.state.tick) else None
        if above:
            limit, (shorter, advised) = above
            more = "" if "step" in advice else f"; {step}, {remedy[0]}"
            words, advice = f"{limit}{shorter}; body {body} {what}{more}", {**advice, **advised}
        error = SimulationDiverged(f"diverged at t = {schedule.time_s:.6g} s: {words}")
        error.advice = advice
        return error

    def _above_limit(self):
        """The body whose step is farthest above its limit, in words; a shorter step as remedy."""
        if not is_bounded(self.run):
            return None
        limits, present = self._limits(), present_steps(self.run)
        steps = np.stack([*limits.values()])
        over = present / steps
        k, body = np.unravel_index(int(over.argmax()), over.shape)
        if over[k, body] <= 1.0 + ROUNDING:
            return None
        count = counted(int((over > 1.0 + ROUNDING).any(axis=0).sum()), "body")
        words = (
            f"the step of {count} was above its limit (body {body} took {present[body]:.3g} s, "
            f"its {[*limits][k]} allow {steps[k, body]:.3g} s)"
        )
        return words, _to_try("", "step", 0.5 * float(steps.min()), "s")

    def _too_deep(self, body, what):
        """SimulationDiverged of a body that has sunk too deep into another."""
        if not values(self.run.state.tick):
            words = "and the scene starts so: move the bodies apart"
            return self._error(body, what, (words, {}))
        law = self.run.model.contact
        stiffness = law.firmness(self.run.model.mesh, self.run.model.materials)
        firm = RAISED * float(np.broadcast_to(stiffness, self.run.model.body_count)[body])
        firmer = law.firmer.format(law=type(law).__name__, value=firm)
        firmer = f"its contacts are too soft: try {firmer}", {law.knob: float(f"{firm:.2g}")}
        return self._error(body, what, self._shorter_step(body) or firmer)

    def _beside(self, body):
        """Bodies that a body is tied to or near."""
        model, contacts = self.run.model, self.run.contacts
        holds = ~np.append(self.run.state.broken(), True)[model.topology.body_bond[body]]
        pairs = contacts.store.near_table()[0] if contacts is not None else np.zeros((0, 2), int)
        near = pairs[(pairs == body).any(axis=1)].sum(axis=1) - body
        return [*model.neighbours[body][holds].tolist(), *near.tolist()]

    def _shorter_step(self, body, to_blame=False):
        """A shorter step as a remedy, or None where the step is not to blame."""
        limits, near = self._limits(), [body, *self._beside(body)]
        taken = self._taken()[near].min()
        limit, cause, tight = min((limits[name][k], name, k) for name in limits for k in near)
        whose = f"its {cause}" if tight == body else f"the {cause} of body {tight} beside it"
        bounded = np.isfinite(limit)
        words = f"{whose} allow {limit:.3g} s" if bounded else "which nothing near it limits"
        if bounded and taken > 0.5 * limit:
            return _to_try(words, "step", 0.5 * limit, "s")
        if to_blame or unexplained_share(self.energy_balance.account()) > CLOSED:
            words += ", but the energy balance does not close"
            return _to_try(words, "step", 0.5 * min(taken, limit), "s")
        return None

    def _taken(self):
        """Largest steps [s] that each body may have taken of late, (body_count,)."""
        present, schedule = present_steps(self.run), self.run.schedule
        return present if schedule.has_limits else np.full_like(present, schedule.dt0)

    def _limits(self):
        """Largest stable explicit steps [s] by criterion, arrays (body_count,)."""
        marks = values(self.run.state.active_effects, slice(self.run.model.body_count))
        touched = marks & np.int64(CONTACT) > 0
        limits = {}
        for name, own in limits_of(self.run).items():
            link, part = name.split("_")
            if part == "stiffness" or way_of(self.run) == "full":
                acts = touched | (link == "bond")
                limits[f"{link} {_PARTS[part]}"] = np.where(acts, own, np.inf)
        return limits


def _to_try(why, name, value, unit):
    """To try a number, as the end of a sentence that says why, and by its name."""
    return f"{why}: try a {name} of {value:.2g} {unit}", {name: float(f"{value:.2g}")}
