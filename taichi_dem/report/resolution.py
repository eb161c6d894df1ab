"""What mesh and step of a run do not resolve: slip of bonds that hold, dashpots, late failures."""

from dataclasses import dataclass

import numpy as np

from taichi_dem.report.missing_effects import middle_of_bond
from taichi_dem.report.run import Kept, Run
from taichi_dem.state.timeline import MAX_LEVEL

#: Largest slip over the shortest edge at which a bond still represents its face. Of a triangle that
#: has slid by a share s of an edge along it, (1 - s)^2 still lies on the other: at 5 % a tenth of
#: the area that the bond acts on is gone, more than an error that a user would accept.
MOST_SLIP = 0.05
_FULL = "the cohesion is undiminished: SlipWeakening in place of ShearSlip degrades it with slip"
_WEAKENED = "friction acts on the whole of it: compare with a coarser mesh"
#: Least share of its coefficient at which a limited dashpot still represents the material.
LEAST_SHARE = 0.5
#: A bond open by this many failure openings when it fails has failed too late: its dashpots,
#: far stronger than its springs, have acted too long.
MOST_OPENING = 1.25
#: Sphere dashpots of a pair take c n dt / m of the speed at which the bodies part or meet; above 1
#: they reverse it, and throw apart bodies that the springs should part gently.
MOST_TAKEN = 1.0


@dataclass(frozen=True)
class BondSlip:
    """Largest residual slip of a bond that held, at the recording times of a run.

    share: of the shortest edge of its face. bond, place_m, time_s: the bond, the middle of its face
    in the mesh [m], and when. count: largest number of bonds beyond ``MOST_SLIP`` at a time.
    weakens: whether slip degrades cohesion.
    """

    share: float
    bond: int
    place_m: tuple
    time_s: float
    count: int
    weakens: bool

    #: As of a ``MissingEffect``: the effect to list, and the finding in words.
    effect = "SlipWeakening"
    what = f"bonds that hold have slipped by more than {100 * MOST_SLIP:g} % of an edge"

    @property
    def figure(self) -> str:
        """The share and the bond in words."""
        return f"{100 * self.share:.3g} % of the shortest edge of its face (bond {self.bond})"

    def __str__(self):
        place = ", ".join(f"{x:.3g}" for x in self.place_m)
        return (
            f"up to {self.count} {self.what} of their face, bond {self.bond} (at {place} m) by "
            f"{100 * self.share:.3g} % at t = {self.time_s:.4g} s: less of the face lies on the "
            f"other, but {_WEAKENED if self.weakens else _FULL}"
        )


class BondSlips(Kept):
    """Measures the residual slip of bonds at recording times."""

    kept = "share", "time_s", "bond", "count"

    def __init__(self, run: Run):
        self.run, (law,) = run, run.model.by_role["shear"] or (None,)
        self.present = run.model.bond_count > 0 and getattr(law, "remembers_slip", False)
        self.weakens = getattr(law, "releases", False)
        self.share, self.time_s, self.bond, self.count = 0.0, 0.0, -1, 0
        corners = run.model.mesh.points[run.model.topology.vertices]
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
        self.shortest = edges.min(axis=1)

    def sample(self, time_s: float) -> None:
        """Update the figures at a recording time [s]."""
        if not self.present:
            return
        share = self.run.readings.residual_slip() / self.shortest
        self.count = max(self.count, int((share > MOST_SLIP).sum()))
        if share.max() > self.share:
            self.share, self.bond, self.time_s = float(share.max()), int(share.argmax()), time_s

    def finding(self) -> tuple[BondSlip, ...]:
        """The ``BondSlip`` of the run so far, or nothing where no bond slipped."""
        if self.bond < 0:
            return ()
        bond, place = int(self.bond), middle_of_bond(self.run.model, self.bond)
        figures = float(self.share), bond, tuple(place.tolist()), float(self.time_s)
        return (BondSlip(*figures, int(self.count), self.weakens),)


class StepResolution(Kept):
    """Checks of the time step: shares of dashpots at recording times, bond failures at the end.

    share: least share of its dashpots that each bond kept while it held, (bond_count,). step:
    shortest step of each body [s]; lightest: mass of the lightest body near it [kg]; pair_share:
    least recorded share of its contacts; taken: largest part of a speed that they take in a step;
    all (body_count,).
    """

    kept = "share", "pair_share", "taken", "step", "lightest"

    def __init__(self, run: Run):
        self.run, bodies = run, run.model.body_count
        self.share, self.pair_share = np.ones(run.model.bond_count), np.ones(bodies)
        self.taken, self.step = np.zeros(bodies), np.full(bodies, np.inf)
        self.lightest = run.model.body_mass.copy()

    def sample(self) -> None:
        """Update the figures at a recording time; not for dashpots that are solved."""
        advance, readings, contacts = self.run.advance, self.run.readings, self.run.contacts
        if advance.solves:
            return
        if advance.limited and advance.has_dashpot and self.run.model.bond_count:
            readings.bond_shares(self.share)
        if contacts is not None and contacts.store.near_count[None]:
            if advance.limited:
                self._note_partners(contacts)
            readings.contact_shares(self.pair_share, self.taken)

    def _note_partners(self, contacts):
        """Remember steps and light partners: few contacts last until a recording."""
        step = self.run.schedule.dt0 / 2.0 ** self.run.state.level.to_numpy()
        self.step, mass = np.minimum(self.step, step), self.run.model.body_mass
        pairs, _, _ = contacts.store.near_table()
        for one, other in (pairs.T, pairs.T[::-1]):
            np.minimum.at(self.lightest, one, mass[other])

    def findings(self) -> tuple[str, ...]:
        """Sentences about dashpots and failures that the step did not resolve; may be empty."""
        share, late, pair_share = self.share, self._openings_at_failure(), self._contact_shares()
        return (
            *_too_long(
                share < LEAST_SHARE,
                -share,
                "the dashpots of {count} bonds, and limits them to less than half, bond {worst} to "
                "{percent:.2g} %: these bonds give way too fast",
            ),
            *_too_long(
                late > MOST_OPENING,
                late,
                "{count} bonds that failed late, bond {worst} at {value:.2g} times its failure "
                "opening: their dashpots took energy for too long",
            ),
            *_too_long(
                pair_share < LEAST_SHARE,
                -pair_share,
                "the sphere dashpots of {count} bodies, and limits them to less than half, those "
                "of body {worst} to {percent:.2g} %: what is pressed together parts too fast",
            ),
            *_too_long(
                self.taken > MOST_TAKEN,
                self.taken,
                "the sphere dashpots of {count} bodies: those of body {worst} take {value:.2g} of "
                "a speed in one step, and throw bodies apart that they should stop",
            ),
            *self._sweeps(),
            *self._levels(),
        )

    def _levels(self):
        if not self.run.schedule.undivided[None]:
            return ()
        least = self.run.schedule.dt0 / 2.0**MAX_LEVEL
        return (
            f"the shortest step of all, {least:.3g} s or 2^-{MAX_LEVEL} of the largest, was "
            "reached: steps are not divided further; take a shorter largest step",
        )

    @property
    def unconverged(self) -> tuple[int, float]:
        """Steps whose sweeps ended before impulses agreed, and the worst residual.

        The residual is a share of the fastest body's speed.
        """
        solver = self.run.advance.solver
        if solver is None:
            return 0, 0.0
        return int(solver.unconverged[None]), float(solver.worst[None])

    def _sweeps(self):
        (steps, worst), solver = self.unconverged, self.run.advance.solver
        if not steps:
            return ()
        allowed = float(solver.tolerance[None])
        return (
            f"the dashpots of {steps} steps were not solved: sweeps ended with changes of up to "
            f"{100 * worst:.2g} % of the largest speed, where {100 * allowed:.2g} % is asked; "
            f"allow more sweeps than {int(solver.bounds[1])}, or take a shorter step",
        )

    def _contact_shares(self):
        """Largest share that limited sphere dashpots can have had where they acted, (body_count,).

        The recorded share, or that of a single contact, 1 / X with X = 2 c dt / m; see
        ``stability/body_limits.py``. Contacts that took energy have acted; it is booked to the
        first body of a pair.
        """
        damping = self.run.model.materials.of_contacts("contact_damping")
        if self.run.contacts is None or not self.run.advance.limited or not np.any(damping):
            return self.pair_share
        acted = self.run.state.contact_heat.to_numpy()[:, :2].sum(axis=1) > 0.0
        x = 2.0 * damping * self.step / self.lightest
        return np.minimum(self.pair_share, np.where(acted, 1.0 / np.maximum(1.0, x), 1.0))

    def _openings_at_failure(self):
        """Largest opening of the units of every bond that failed over the failure opening, (b,)."""
        model, units = self.run.model, self.run.state.fields().get("softening_unit")
        if units is None:
            return np.zeros(model.bond_count)
        widest = units.to_numpy()[: 3 * model.bond_count, 0].reshape(-1, 3).max(axis=1)
        opening = model.of_bonds(lambda material: material.failure_opening)
        return np.where(self.run.broken(), widest / opening, 0.0)


def _too_long(wrong, values, words):
    """Sentence about the places where a step is too long, with the worst; or none."""
    if not wrong.any():
        return ()
    worst = int(np.argmax(values))
    figures = {"value": abs(values[worst]), "percent": 100 * abs(values[worst])}
    told = words.format(count=wrong.sum(), worst=worst, **figures)
    return (f"the step is too long for {told}",)
