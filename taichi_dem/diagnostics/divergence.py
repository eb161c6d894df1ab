"""Detect diverged runs, and describe where and why."""

import time
from typing import TYPE_CHECKING, Optional

import numpy as np

from taichi_dem.contact_search.contacts import FARTHEST, Contacts
from taichi_dem.diagnostics.energy_balance import EnergyBalance
from taichi_dem.diagnostics.shared_volume import SharedVolume
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.stability.contact_limits import contact_rates
from taichi_dem.stability.quality import quality_report
from taichi_dem.stability.stable_step import dashpot_step, spring_step
from taichi_dem.step.drivers import CALL_SECONDS
from taichi_dem.step.schedule import Schedule

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model
    from taichi_dem.engine.state import State

#: Unexplained energy beyond which a run counts as diverged, as a share of the energy present.
ENERGY_FROM_NOWHERE = 0.5
#: Share of the smaller body at which two bodies, whose faces all carry spheres, count as one
#: within the other.
DEEPEST_SHARE = 0.5
#: Overlap of two contact spheres beyond recovery, as a share of the distance at which they touch:
#: their centres are about to pass each other. A small sphere may be inside a large one.
DEEPEST_OVERLAP = 0.95
#: Share of the time that a hurried check may take: it reads every bond, a tenth of a call of the
#: driver at 100,000 bodies.
SHARE = 0.02


class DivergenceCheck:
    """Checks a run after every call of the driver; raises SimulationDiverged with the place.

    solves: whether the method solves dashpots implicitly, so that only springs limit the step.
    """

    def __init__(
        self,
        model: "Model",
        state: "State",
        schedule: Schedule,
        contacts: Optional[Contacts],
        energy_balance: EnergyBalance,
        solves: bool = False,
    ):
        self.model, self.state, self.schedule, self.solves = model, state, schedule, solves
        self.limited = schedule.has_limits and schedule.limits.limited
        self.contacts, self.energy_balance = contacts, energy_balance
        self.rounded_once = self._rounded_once()
        self.rest_until = 0.0

    def check(self, hurried: bool = False) -> None:
        """Raise SimulationDiverged for a runaway body, extreme overlap, or unexplained energy.

        hurried: check for runaways only, as long as the rest would take more than SHARE of the
        time.
        """
        self._check_speed()
        started = time.process_time()
        if hurried and started < self.rest_until:
            return
        self._check_overlap()
        self._check_energy()
        now = time.process_time()
        if hurried:
            # The first check, which is not hurried, compiles: its time is no measure. A check that
            # takes no more than its share of a call is never skipped, so not in small scenes.
            self.rest_until = now + (now - started) / SHARE - CALL_SECONDS

    def _check_speed(self):
        body = self.state.bad_body[None]
        if body < self.model.body_count:
            motion = self.state.motion()
            speed = np.linalg.norm(motion["velocity"][body])
            words = f"moves at {speed:.3g} m/s"
            if speed < self.state.max_speed2[None] ** 0.5 and self.contacts is not None:
                extent = float(self.model.spheres.extent[body])
                whole = speed + np.linalg.norm(motion["spin"][body]) * extent
                words += ", too far in a step for its contacts to be followed"
                advice = f"try a step of {0.5 * FARTHEST * extent / whole:.2g} s"
                raise SimulationDiverged(self._sentence(body, motion, words, advice))
            raise SimulationDiverged(self._sentence(body, motion, words))

    def _check_overlap(self):
        if self.contacts is None or not self.contacts.store.near_count[None]:
            return
        bodies, _, deepest = self.contacts.store.near_table()
        pair = int(deepest.argmax())
        if deepest[pair] > DEEPEST_OVERLAP:
            body, other = bodies[pair].tolist()
            inside, size = f"one of body {other}", "their radii"
            if self.contacts.law.meets_faces:
                inside, size = f"body {other}", "its radius"
            share = f"{100 * deepest[pair]:.0f} % of {size}"
            what = f"has a contact sphere inside {inside} ({share})"
            raise SimulationDiverged(self._sentence(body, self.state.motion(), what))

    def check_shared(self, volume: SharedVolume) -> None:
        """Raise SimulationDiverged where contact of all faces has not kept two bodies apart."""
        contact = self.model.contact
        if contact is None or not contact.outer_faces or not len(volume.share):
            return
        place = int(volume.share.argmax())
        if volume.share[place] > DEEPEST_SHARE:
            body, other = volume.pairs[place].tolist()
            what = f"shares {100 * volume.share[place]:.0f} % of its volume with body {other}"
            raise SimulationDiverged(self._sentence(body, self.state.motion(), what))

    def _check_energy(self):
        account = self.energy_balance.account()
        present = account["kinetic"] + account["bond_strain"] + account["sphere_strain"]
        given = (
            self.energy_balance.start_energy
            + abs(account["load_work"])
            + abs(account["support_work"])
        )
        bound = ENERGY_FROM_NOWHERE * max(given, self.round_off())
        if -account["residual"] > bound and present > given:
            motion = self.state.motion()
            body = int(np.linalg.norm(motion["velocity"], axis=1).argmax())
            what = f"is the fastest while {-account['residual']:.3g} J came from nowhere"
            raise SimulationDiverged(self._sentence(body, motion, what))

    def round_off(self) -> float:
        """Bound of the energy [J] that rounding of positions has put into the bonds so far."""
        return max(1, int(self.schedule.evaluations[0])) * self.rounded_once

    def _rounded_once(self):
        """Energy [J] of springs whose ends are known to a few units in the last place."""
        area = 3.0 * self.model.bonds["area"]
        stiffness = self.model.bond_stiffness.max(axis=1, initial=0.0)
        place = 4.0 * np.finfo(float).eps * np.abs(self.model.mesh.points).max()
        return max(0.5 * float(np.sum(area * stiffness)) * place**2, 1e-300)

    def _sentence(self, body, motion, what, advice=""):
        level = int(motion["level"][body])
        time_s = self.state.tick[None] * self.schedule.tick_seconds
        step = self.schedule.dt0 / 2.0**level
        links = self._links(body)
        return (
            f"diverged at t = {time_s:.6g} s: body {body} {what}; "
            f"{_partner(body, motion, links)}; its step was {step:.3g} s (level {level}), "
            f"{advice or self._advice(body, links)}"
        )

    def _links(self, body):
        """Bodies that a body is tied to or near, and how, as pairs."""
        top = self.model.topology
        intact = self.state.broken_tick.to_numpy() < 0
        links = [
            (int(top.master[b] + top.slave[b] - body), f"bond {b} to body")
            for b in top.body_bond[body]
            if b >= 0 and intact[b]
        ]
        for first, second in self._pairs():
            if body in (first, second):
                links.append((int(first + second - body), "contact with body"))
        return links

    def _pairs(self):
        if self.contacts is None:
            return np.zeros((0, 2), dtype=int)
        return self.contacts.store.near_table()[0]

    def _advice(self, body, links):
        """Criterion that limits the step near a body, and a step that meets it.

        Runaways are often thrown by a neighbour of a shorter step, so the tightest limit counts.
        """
        limits = self._limits()
        near = [body, *(other for other, _ in links)]
        limit, cause, tight = min((limits[name][k], name, k) for name in limits for k in near)
        if not np.isfinite(limit):
            return "which nothing near it limits"
        whose = f"its {cause}" if tight == body else f"the {cause} of body {tight} beside it"
        return f"{whose} allow {limit:.3g} s: try a step of {0.5 * limit:.2g} s"

    def _limits(self):
        """Largest stable explicit steps [s] by criterion, arrays (body_count,).

        Dashpots that are solved or limited set none.
        """
        steps = quality_report(self.model.mesh, self.model.material)
        limits = {"bond springs": steps.spring_step_s}
        tame = self.solves or self.limited
        if self.model.by_role["dashpot"] and not tame:
            limits["bond dashpots"] = steps.dashpot_step_s
        if self.contacts is not None:
            material = self.model.material
            pairs, counts, _ = self.contacts.store.near_table()
            rates = contact_rates(pairs, counts, self.model.body_mass)
            limits["contact springs"] = spring_step(material.contact_stiffness * rates)
            if not tame:
                limits["sphere dashpots"] = dashpot_step(material.contact_damping * rates)
        return limits


def _partner(body, motion, links):
    """The neighbour that moves fastest against a body, and how they are tied."""
    if not links:
        return "it touches nothing"
    velocity = motion["velocity"]
    apart = [np.linalg.norm(velocity[other] - velocity[body]) for other, _ in links]
    other, tie = links[int(np.nanargmax(np.nan_to_num(apart, nan=np.inf)))]
    return f"the fastest against it is {tie} {other}"
