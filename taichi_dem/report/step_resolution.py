"""Bonds and contacts for which the step of a run was too long: stable, but not accurate."""

from collections.abc import Mapping
from typing import Optional

import numpy as np

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import values
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.timeline import MAX_LEVEL
from taichi_dem.step.advance import Advance
from taichi_dem.step.schedule import Schedule

#: Least share of its coefficient at which a limited dashpot still represents the material.
LEAST_SHARE = 0.5
#: A bond open by this many failure openings when it fails has failed too late: its dashpots,
#: far stronger than its springs, have acted too long.
MOST_OPENING = 1.25
#: Sphere dashpots of a pair take c n dt / m of the speed at which the bodies part or meet; above 1
#: they reverse it, and throw apart bodies that the springs should part gently.
MOST_TAKEN = 1.0
_KEPT = ("share", "pair_share", "taken", "step", "lightest")


class StepResolution:
    """Checks of the time step: shares of dashpots at recording times, bond failures at the end.

    share: least share of its dashpots that each bond kept while it held, (bond_count,). step:
    shortest step of each body [s]; lightest: mass of the lightest body near it [kg]; pair_share:
    least recorded share of its contacts; taken: largest part of a speed that they take in a step;
    all (body_count,).
    """

    def __init__(
        self,
        model: Model,
        state: State,
        readings: Readings,
        contacts: Optional[Contacts],
        schedule: Schedule,
        advance: Advance,
    ):
        self.model, self.state, self.readings, self.contacts = model, state, readings, contacts
        self.schedule, self.solves, self.limited = schedule, advance.solves, advance.limited
        self.has_dashpot, self.solver = advance.has_dashpot, advance.solver
        self.share = np.ones(model.bond_count)
        self.pair_share, self.taken = np.ones(model.body_count), np.zeros(model.body_count)
        self.step = np.full(model.body_count, np.inf)
        self.lightest = model.body_mass.copy()

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {name: getattr(self, name) for name in _KEPT}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        for name in _KEPT:
            setattr(self, name, saved[name].copy())

    def sample(self) -> None:
        """Update the figures at a recording time; not for dashpots that are solved."""
        if self.solves:
            return
        if self.limited and self.has_dashpot and self.model.bond_count:
            self.readings.bond_shares(self.share)
        if self.contacts is not None and values(self.contacts.store.near_count):
            if self.limited:
                self._note_partners()
            self.readings.contact_shares(self.pair_share, self.taken)

    def _note_partners(self):
        """Remember steps and light partners: few contacts last until a recording."""
        mass, level = self.model.body_mass, values(self.state.level, slice(self.model.body_count))
        self.step = np.minimum(self.step, self.schedule.dt0 / 2.0**level)
        pairs, _, _ = self.contacts.store.near_table()
        for one, other in (pairs.T, pairs.T[::-1]):
            np.minimum.at(self.lightest, one, mass[other])

    def findings(self, bodies: Optional[np.ndarray] = None) -> tuple[str, ...]:
        """Sentences about dashpots and failures that the step did not resolve; may be empty.

        bodies: which to judge, booleans (body_count,), all by default.
        """
        bodies = np.ones(self.model.body_count, dtype=bool) if bodies is None else bodies
        bonds = self._bonds(bodies[self.model.topology.master])
        return (*bonds, *self._pairs(bodies), *self._sweeps(), *self._levels())

    def _levels(self):
        if not values(self.schedule.undivided):
            return ()
        least = self.schedule.dt0 / 2.0**MAX_LEVEL
        return (
            f"the shortest step of all, {least:.3g} s or 2^-{MAX_LEVEL} of the largest, was "
            "reached: steps are not divided further; take a shorter largest step",
        )

    @property
    def unconverged(self) -> tuple[int, float]:
        """Steps whose sweeps ended before impulses agreed, and the worst residual.

        The residual is a share of the fastest body's speed.
        """
        if self.solver is None:
            return 0, 0.0
        return int(values(self.solver.unconverged)), float(values(self.solver.worst))

    def _sweeps(self):
        steps, worst = self.unconverged
        if not steps:
            return ()
        allowed = float(values(self.solver.tolerance))
        return (
            f"the dashpots of {steps} steps were not solved: sweeps ended with changes of up to "
            f"{100 * worst:.2g} % of the largest speed, where {100 * allowed:.2g} % is asked; "
            f"allow more sweeps than {int(values(self.solver.bounds)[1])}, or take a shorter step",
        )

    def _bonds(self, inside):
        share = np.where(inside, self.share, 1.0)
        found = []
        if (share < LEAST_SHARE).any():
            worst = int(np.argmin(share))
            found.append(
                f"the step is too long for the dashpots of {(share < LEAST_SHARE).sum()} bonds, "
                f"and limits them to less than half, bond {worst} to {100 * share[worst]:.2g} %: "
                f"these bonds give way too fast"
            )
        late = np.where(inside, self._openings_at_failure(), 0.0)
        if (late > MOST_OPENING).any():
            worst = int(np.argmax(late))
            found.append(
                f"the step is too long for {(late > MOST_OPENING).sum()} bonds that failed late, "
                f"bond {worst} at {late[worst]:.2g} times its failure opening: their dashpots took "
                f"energy for too long"
            )
        return found

    def _pairs(self, bodies):
        share = np.where(bodies, self._contact_shares(), 1.0)
        taken = np.where(bodies, self.taken, 0.0)
        found = []
        if (share < LEAST_SHARE).any():
            worst = int(np.argmin(share))
            found.append(
                f"the step is too long for the sphere dashpots of {(share < LEAST_SHARE).sum()} "
                f"bodies, and limits them to less than half, those of body {worst} to "
                f"{100 * share[worst]:.2g} %: what is pressed together parts too fast"
            )
        if (taken > MOST_TAKEN).any():
            worst = int(np.argmax(taken))
            found.append(
                f"the step is too long for the sphere dashpots of {(taken > MOST_TAKEN).sum()} "
                f"bodies: those of body {worst} take {taken[worst]:.2g} of a speed in one step, "
                f"and throw bodies apart that they should stop"
            )
        return found

    def _contact_shares(self):
        """Largest share that limited sphere dashpots can have had where they acted, (body_count,).

        The recorded share, or that of a single contact, 1 / X with X = 2 c dt / m; see
        ``stability/body_limits.py``. Contacts that took energy have acted; it is booked to the
        first body of a pair.
        """
        damping = self.model.materials.of_contacts("contact_damping")
        if self.contacts is None or not self.limited or not np.any(damping):
            return self.pair_share
        heat = values(self.state.contact_heat, slice(self.model.body_count))
        acted = heat[:, :2].sum(axis=1) > 0.0
        x = 2.0 * damping * self.step / self.lightest
        return np.minimum(self.pair_share, np.where(acted, 1.0 / np.maximum(1.0, x), 1.0))

    def _openings_at_failure(self):
        """Largest opening of the units of every bond that failed over the failure opening, (b,)."""
        bonds = self.model.bond_count
        units = self.state.fields().get("softening_unit")
        if units is None:
            return np.zeros(bonds)
        widest = values(units, slice(3 * bonds))[:, 0].reshape(bonds, 3).max(axis=1)
        opening = self.model.of_bonds(lambda material: material.failure_opening)
        return np.where(self.state.broken(), widest / opening, 0.0)
