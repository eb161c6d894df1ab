"""Limits of mesh and step in a run: slip of unbroken bonds, dashpots, late failures."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from taichi_dem.elasticity.rates import (
    bond_bounds,
    bond_rates,
    contact_bounds,
    contact_eigenvalues,
)
from taichi_dem.kit.allocation import values
from taichi_dem.kit.display import counted
from taichi_dem.laws.contracts import UnitLaw
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.missing_effects import MissingEffect, placed
from taichi_dem.report.readings import Kept, Run
from taichi_dem.stability.step_report import stable_steps, step_limits
from taichi_dem.state.timeline import MAX_LEVEL

#: Largest slip over the shortest edge at which a bond still represents its face. Of a triangle that
#: has slid by a share s of an edge along it, (1 - s)^2 still lies on the other: at 5 % a tenth of
#: the area that the bond acts on is gone, more than an error that a user would accept.
MOST_SLIP = 0.05
_SLIPPED = f"intact bonds have slid by over {100 * MOST_SLIP:g} % of a face edge"
_FULL = "keep full cohesion", "SlipWeakening in place of ShearSlip avoids this"
_WEAKENED = "keep friction on the whole face", "compare with a coarser mesh"
#: Least share of its coefficient at which a limited dashpot still represents the material.
LEAST_SHARE = 0.5
#: A bond open by this many failure openings when it fails has failed too late: its dashpots,
#: far stronger than its springs, have acted too long.
MOST_OPENING = 1.25
#: Contact dashpots of a pair take c n dt / m of the speed at which the bodies part or meet; above
#: 1 they reverse it, and throw apart bodies that the springs should part gently.
MOST_TAKEN = 1.0
#: Largest values for which the step is short enough, with their sentences: less shares of bonds,
#: openings at failure, less shares of contact dashpots, and parts of a speed that these take.
_ALLOWED = -LEAST_SHARE, MOST_OPENING, -LEAST_SHARE, MOST_TAKEN
_TOO_LONG = (
    "the dashpots of {count} bonds, which it weakens to less than half (bond {worst} to "
    "{percent:.2g} %): these bonds yield too fast",
    "{count} bonds, which failed late (bond {worst} at {value:.2g} times its failure opening): "
    "their dashpots took energy for too long",
    "the contact dashpots of {count} bodies, which it weakens to less than half (body {worst} "
    "to {percent:.2g} %): pressed bodies separate too fast",
    "the contact dashpots of {count} bodies: in one step those of body {worst} take {value:.2g} "
    "times its speed, and push bodies apart that they should stop",
)


#: What limits a step, and the share of a limit within which a step is at it.
_LINKS, ROUNDING = ("bonds", "contact"), 1e-6


def limits_of(run: Run, *bodies: np.ndarray) -> dict[str, np.ndarray]:
    """Largest stable steps [s] by criterion, see ``StepReport``; but for last bits.

    bodies: those that are asked for in bonds and in contact; others have infinite steps.
    """
    kinds: tuple[Any, Any] = bond_rates, contact_eigenvalues
    asked = bodies or (None, None)
    return _limits(run, *(partial(of, multiply=np.matmul, bodies=b) for of, b in zip(kinds, asked)))


def _limits(run, *rates):
    model = run.model
    dashpot, friction, contact = (
        next((effect for effect in model.by_role[role] if effect.name), None)
        for role in ("dashpot", "friction", "contact")
    )
    if way_of(run) == "solved":
        dashpot = None
    return step_limits(model.mesh, model.materials, dashpot, friction, contact, *rates)


def longest_steps(run: Run) -> np.ndarray:
    """Largest stable step of each body in bonds and in contact [s], (2, n).

    Infinite where bounds of the rates, which cost little, show that no step of the run exceeds it.
    """
    sure = _by_link(run, _limits(run, bond_bounds, contact_bounds))
    short = sure < run.schedule.dt0
    if not short.any():
        return np.full_like(sure, np.inf)
    return _by_link(run, limits_of(run, *map(np.flatnonzero, short)))


def _by_link(run, limits):
    return np.array([stable_steps(limits, way_of(run), link) for link in ("bond", "contact")])


def way_of(run: Run) -> str:
    """How the method of a run takes dashpots, a key of ``step_report.METHODS``."""
    return "solved" if run.step.solver else "limited" if run.step.bonds.limited else "full"


def present_steps(run: Run) -> np.ndarray:
    """Step of every body now [s], (body_count,)."""
    return run.schedule.dt0 / 2.0 ** values(run.state.level, slice(run.model.body_count))


def is_bounded(run: Run) -> bool:
    """Whether the limits of stability of its steps are known, and no control keeps below them."""
    controlled = run.schedule.has_limits and run.schedule.limits.controlled
    return not controlled and type(run.step).__module__.startswith("taichi_dem.step.")


@dataclass(frozen=True)
class BondSlip(MissingEffect):
    """Largest residual slip of a bond that held, at the recording times of a run."""

    share: float = 0.0
    weakens: bool = False

    @property
    def figure(self) -> str:
        """The share and the bond in words."""
        return f"{100 * self.share:.3g} % of the shortest edge of its face (bond {self.where})"

    def __str__(self):
        kept, advice = _WEAKENED if self.weakens else _FULL
        return (
            f"{self.count} {self.what} but {kept}, so the body may be too strong (bond "
            f"{self.where} at {self.place} m slid by {100 * self.share:.3g} % at t = "
            f"{self.first_s:.4g} s): {advice}"
        )


class StepResolution(Kept):
    """Follows at recording times what mesh and step do not resolve."""

    kept = "slip", "share", "pair_share", "taken", "step", "fastest", "over"

    def __init__(self, run: Run):
        self.run, bodies = run, run.model.body_count
        self.longest = longest_steps(run) if is_bounded(run) else np.full((2, bodies), np.inf)
        self.over = np.zeros_like(self.longest)
        self.slip = np.array([0.0, -1.0, 0.0, 0.0])
        self.share, self.pair_share = np.ones(run.model.bond_count), np.ones(bodies)
        self.taken, self.step = np.zeros(bodies), np.full(bodies, np.inf)
        contact, self.rate = run.model.contact, np.zeros(bodies)
        if contact is not None:
            _, damping = contact.strongest(run.model.mesh, run.model.materials)
            self.rate = damping / run.model.body_mass
        self.fastest = self.rate.copy()
        corners = run.model.mesh.points[run.model.topology.vertices]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
        by_role = run.model.by_role
        self.shortest, (law,) = edges.min(axis=1), by_role["bond"] or by_role["shear"] or (None,)
        self.slips = len(edges) > 0 and law is not None
        self.weakens = law is not None and type(law).failed is not UnitLaw.failed

    def sample(self, time_s: float) -> None:
        """Update the figures at a recording time [s]; not those of dashpots that are solved."""
        step, readings, contacts = self.run.step, self.run.readings, self.run.contacts
        self.over = np.maximum(self.over, np.where(self._linked(), self._over_now(), 0.0))
        if self.slips:
            share = readings.residual_slip() / self.shortest
            if share.max() > self.slip[0]:
                self.slip[:3] = share.max(), share.argmax(), time_s
            self.slip[3] = max(self.slip[3], (share > MOST_SLIP).sum())
        if step.solver is not None:
            return
        if step.bonds.limited and step.bonds.has_dashpot and self.run.model.bond_count:
            readings.bond_shares(self.share)
        if contacts is not None and values(contacts.store.near_count):
            if step.bonds.limited:
                self._note_partners(contacts)
            readings.contact_shares(self.pair_share, self.taken)

    def _over_now(self):
        """Present steps over the longest ones that are stable, (2, body_count)."""
        return present_steps(self.run) / self.longest

    def _linked(self):
        """Whether a bond of each body holds, and whether it ever touched, (2, body_count)."""
        model, state = self.run.model, self.run.state
        # Bond -1 stands for an outer face.
        holds = ~np.append(state.broken(), True)[model.topology.body_bond]
        active = values(state.active_effects, slice(model.body_count))
        return np.stack([holds.any(axis=1), active & CONTACT > 0])

    def at_start(self) -> tuple[str, ...]:
        """Sentences about steps above their limits in bonds and in contact; or none."""
        return self._unstable(self._over_now())

    def _unstable(self, over):
        """The same of steps over their limits, (2, body_count)."""
        unstable = []
        for link, own, longest in zip(_LINKS, over, self.longest):
            count, worst = int((own > 1.0 + ROUNDING).sum()), int(own.argmax())
            if count:
                unstable.append(
                    f"the step of {counted(count, 'body')} is above the longest that is stable for "
                    f"sure in {link} (body {worst} takes {own[worst]:.3g} times "
                    f"{longest[worst]:.3g} s): energy may come from nowhere, take a shorter step "
                    "(step_report)"
                )
        return tuple(unstable)

    def bond_slip(self) -> tuple[BondSlip, ...]:
        """The ``BondSlip`` of the run so far, or nothing where no bond slipped."""
        share, bond, time_s, count = self.slip.tolist()
        if bond < 0:
            return ()
        slip = BondSlip("SlipWeakening", _SLIPPED, share=share, weakens=self.weakens)
        return (placed(slip, self.run.model, count, bond, time_s),)

    def _note_partners(self, contacts):
        """Remember steps and light partners: few contacts last until a recording."""
        self.step = np.minimum(self.step, present_steps(self.run))
        pairs, _, _ = contacts.store.near_table()
        for body, other in (pairs.T, pairs.T[::-1]):
            np.maximum.at(self.fastest, body, self.rate[other])

    def findings(self) -> tuple[str, ...]:
        """Sentences about dashpots and failures that the step did not resolve; may be empty."""
        late = np.where(self.run.state.broken(), self.run.readings.reach(), 0.0)
        worse = -self.share, late, -self._contact_shares(), self.taken
        findings = (_too_long(*look) for look in zip(worse, _ALLOWED, _TOO_LONG))
        unstable = self._unstable(self.over)
        return tuple(filter(None, (*unstable, *findings, self._sweeps(), self._levels())))

    def _levels(self):
        if not values(self.run.schedule.undivided):
            return ""
        least = self.run.schedule.dt0 / 2.0**MAX_LEVEL
        return (
            f"bodies need a step shorter than {least:.3g} s, 2^-{MAX_LEVEL} of the largest: "
            "steps are not divided further, take a shorter largest step"
        )

    @property
    def unconverged(self) -> tuple[int, float]:
        """Steps whose sweeps ended before convergence, and the worst residual."""
        solver = self.run.step.solver
        if solver is None:
            return 0, 0.0
        return int(values(solver.unconverged)), float(values(solver.worst))

    def _sweeps(self):
        (steps, worst), solver = self.unconverged, self.run.step.solver
        if not steps:
            return ""
        allowed = float(values(solver.tolerance))
        return (
            f"in {steps} steps the dashpots were not solved: the last sweep changed speeds by up "
            f"to {100 * worst:.2g} % of the largest, {100 * allowed:.2g} % is allowed; "
            f"allow more than {int(solver.bounds[1])} sweeps, or take a shorter step"
        )

    def _contact_shares(self):
        """Largest share that limited contact dashpots can have had where they acted, (bodies,)."""
        if self.run.contacts is None or not self.run.step.bonds.limited:
            return self.pair_share
        heat = values(self.run.state.contact_heat, slice(self.run.model.body_count))
        acted = heat[:, :2].sum(axis=1) > 0.0
        with np.errstate(invalid="ignore"):
            # A body without dashpots and of no recorded step gives no number, and keeps all.
            x = np.fmax(1.0, 2.0 * self.fastest * self.step)
        return np.minimum(self.pair_share, np.where(acted, 1.0 / x, 1.0))


def _too_long(values, allowed, words):
    """Sentence about the places where values are beyond what is allowed, with the worst; or ""."""
    count = (values > allowed).sum()
    if not count:
        return ""
    worst = int(np.argmax(values))
    figures = {"value": abs(values[worst]), "percent": 100 * abs(values[worst])}
    return f"the step is too long for {words.format(count=count, worst=worst, **figures)}"
