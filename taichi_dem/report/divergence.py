"""Detect diverged runs, and describe where and why."""

import math
import time
from typing import Optional

import numpy as np

from taichi_dem.contact.contacts import FARTHEST, Contacts
from taichi_dem.kit.allocation import values
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.report.energy_balance import EnergyBalance
from taichi_dem.report.remedy import Remedies, Remedy, shorter_step
from taichi_dem.report.shared_volume import SharedVolume
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.step.drivers import CALL_SECONDS
from taichi_dem.step.schedule import Schedule

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
        model: Model,
        state: State,
        schedule: Schedule,
        contacts: Optional[Contacts],
        energy_balance: EnergyBalance,
        solves: bool = False,
    ):
        self.model, self.state, self.schedule = model, state, schedule
        self.remedies = Remedies(model, state, schedule, contacts, energy_balance, solves)
        self.contacts, self.energy_balance = contacts, energy_balance
        self.rounded_once = self._rounded_once()
        self.rest_until = self.last_spent = 0.0

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
            # A check that compiles, as the first with contacts does, is longer than its neighbours:
            # the shorter of two is a measure. One that takes no more than its share of a call is
            # never skipped, so not in small scenes.
            spent = now - started
            self.rest_until = now + min(spent, self.last_spent) / SHARE - CALL_SECONDS
            self.last_spent = spent

    def _check_speed(self):
        body = int(values(self.state.bad_body))
        if body < self.model.body_count:
            motion = self.state.motion()
            speed = math.hypot(*motion["velocity"][body])
            words = f"moves at {speed:.3g} m/s"
            links = self._links(body)
            if speed < float(values(self.state.max_speed2)) ** 0.5 and self.contacts is not None:
                extent = float(self.model.spheres.extent[body])
                whole = speed + math.hypot(*motion["spin"][body]) * extent
                words += ", too far in a step for its contacts to be followed"
                allowed = FARTHEST * extent / whole
                remedy = shorter_step(0.5 * allowed, f"contacts allow {allowed:.3g} s")
                raise self._exception(body, motion, words, links, remedy)
            remedy = self.remedies.of_speed(body, _partners(links), speed)
            raise self._exception(body, motion, words, links, remedy)

    def _check_overlap(self):
        if self.contacts is None or not values(self.contacts.store.near_count):
            return
        bodies, _, deepest = self.contacts.store.near_table()
        pair = int(deepest.argmax())
        if deepest[pair] > DEEPEST_OVERLAP:
            body, other = bodies[pair].tolist()
            inside, size = f"one of body {other}", "their radii"
            if self.contacts.law.meets_faces:
                inside, size = f"body {other}", "its radius"
            share = f"{100 * deepest[pair]:.0f} % of {size}"
            self._raise_overlap(body, f"has a contact sphere inside {inside} ({share})")

    def check_shared(self, volume: SharedVolume) -> None:
        """Raise SimulationDiverged where contact of all faces has not kept two bodies apart."""
        contact = self.model.contact
        if contact is None or not contact.outer_faces or not len(volume.share):
            return
        place = int(volume.share.argmax())
        if volume.share[place] > DEEPEST_SHARE:
            body, other = volume.pairs[place].tolist()
            share = f"{100 * volume.share[place]:.0f} %"
            self._raise_overlap(body, f"shares {share} of its volume with body {other}")

    def _raise_overlap(self, body, what):
        links = self._links(body)
        remedy = self.remedies.of_overlap(body, _partners(links))
        raise self._exception(body, self.state.motion(), what, links, remedy)

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
            links = self._links(body)
            remedy = self.remedies.of_energy(body, _partners(links))
            raise self._exception(body, motion, what, links, remedy)

    def round_off(self) -> float:
        """Bound of the energy [J] that rounding of positions has put into the bonds so far."""
        return max(1, int(values(self.schedule.evaluations)[0])) * self.rounded_once

    def _rounded_once(self):
        """Energy [J] of springs whose ends are known to a few units in the last place."""
        area = 3.0 * self.model.bonds["area"]
        stiffness = self.model.bond_stiffness.max(axis=1, initial=0.0)
        place = 4.0 * np.finfo(float).eps * np.abs(self.model.mesh.points).max()
        return max(0.5 * float(np.sum(area * stiffness)) * place**2, 1e-300)

    def _exception(self, body, motion, what, links, remedy: Remedy):
        """SimulationDiverged that says what is wrong with a body, and what to change."""
        level = int(motion["level"][body])
        time_s = self.schedule.time_s
        step = self.schedule.dt0 / 2.0**level
        error = SimulationDiverged(
            f"diverged at t = {time_s:.6g} s: body {body} {what}; "
            f"{_partner(body, motion, links)}; its step was {step:.3g} s (level {level}), "
            f"{remedy.words}"
        )
        error.advice = remedy.advice
        return error

    def _links(self, body):
        """Bodies that a body is tied to or near, and how, as pairs."""
        top = self.model.topology
        intact = ~self.state.broken()
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


def _partners(links):
    """Bodies of the links."""
    return [other for other, _ in links]


def _partner(body, motion, links):
    """The neighbour that moves fastest against a body, and how they are tied."""
    if not links:
        return "it touches nothing"
    velocity = motion["velocity"]
    apart = [math.hypot(*(velocity[other] - velocity[body])) for other, _ in links]
    other, tie = links[int(np.nanargmax(np.nan_to_num(apart, nan=np.inf)))]
    return f"the fastest against it is {tie} {other}"
