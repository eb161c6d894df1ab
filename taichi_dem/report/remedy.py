"""Advice for a diverged run: a shorter step, a larger bound of the speed, or firmer contact."""

from collections.abc import Sequence
from typing import NamedTuple, Optional

import numpy as np

from taichi_dem.contact.contacts import Contacts
from taichi_dem.kit.allocation import values
from taichi_dem.report.energy_balance import EnergyBalance, unexplained_share
from taichi_dem.stability.contact_limits import contact_rates
from taichi_dem.stability.quality import quality_report
from taichi_dem.stability.stable_step import dashpot_step, spring_step
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.step.schedule import Schedule

#: Share of all energy that an account may leave unexplained while the step is not to blame. Steps
#: at half of their limits, those that are advised, leave some per cent.
CLOSED = 0.1
#: Factor by which a bound or a stiffness that is not the step's is raised at a time.
RAISED = 10.0


class Remedy(NamedTuple):
    """The end of a sentence, and the same as numbers: see ``SimulationDiverged.advice``."""

    words: str
    advice: dict[str, float]


def shorter_step(step: float, why: str) -> Remedy:
    """To try a step [s]; why: what allows no more, in words."""
    return Remedy(f"{why}: try a step of {step:.2g} s", {"step": float(f"{step:.2g}")})


class Remedies:
    """What to change in a scene or method where a body is out of bounds.

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
        self.model, self.state, self.schedule, self.solves = model, state, schedule, solves
        self.controlled = schedule.has_limits
        self.limited = schedule.has_limits and schedule.limits.limited
        self.contacts, self.energy_balance = contacts, energy_balance

    def of_speed(self, body: int, beside: Sequence[int], speed: float) -> Remedy:
        """For a body near others that moves at a speed [m/s] beyond the bound of the scene."""
        remedy = self._of_step(body, beside)
        if remedy is None:
            bound = RAISED * speed
            words = f"the energy that it has was given to it: try a max_speed of {bound:.2g} m/s"
            return Remedy(words, {"max_speed": float(f"{bound:.2g}")})
        return remedy

    def of_overlap(self, body: int, beside: Sequence[int]) -> Remedy:
        """For a body that has sunk too deep into one of those near it."""
        if not values(self.state.tick):
            return Remedy("and the scene begins like this: move the bodies apart", {})
        remedy = self._of_step(body, beside)
        if remedy is None:
            stiffness = self.model.materials.of_contacts("contact_stiffness")
            firm = RAISED * float(np.broadcast_to(stiffness, self.model.body_count)[body])
            words = f"its contacts are too soft: try a contact_stiffness of {firm:.2g} N/m"
            return Remedy(words, {"contact_stiffness": float(f"{firm:.2g}")})
        return remedy

    def of_energy(self, body: int, beside: Sequence[int]) -> Remedy:
        """For the fastest body of a run in which energy came from nowhere."""
        return self._of_step(body, beside, to_blame=True) or Remedy("which nothing limits", {})

    def _of_step(self, body, beside, to_blame=False):
        """A shorter step, or None where the step is not to blame.

        Runaways are often thrown by a neighbour of a shorter step, so the tightest limit counts.
        Control keeps bodies below their limits: there, and below half of them, a shorter step helps
        where the account of energy does not close.
        """
        level = values(self.state.level, [body, *beside]).max()
        taken = self.schedule.dt0 / 2.0 ** (int(level) if self.controlled else 0)
        limits = self._limits()
        limit, cause, tight = min(
            (limits[name][k], name, k) for name in limits for k in (body, *beside)
        )
        bounded = np.isfinite(limit)
        whose = f"its {cause}" if tight == body else f"the {cause} of body {tight} beside it"
        words = f"{whose} allow {limit:.3g} s" if bounded else "which nothing near it limits"
        if bounded and taken > 0.5 * limit:
            return shorter_step(0.5 * limit, words)
        if to_blame or not self._closes():
            return shorter_step(0.5 * min(taken, limit), f"{words}, but the account does not close")
        return None

    def _closes(self):
        """Whether the account explains the energy of the run."""
        return unexplained_share(self.energy_balance.account()) <= CLOSED

    def _limits(self):
        """Largest stable explicit steps [s] by criterion, arrays (body_count,).

        Dashpots that are solved or limited set none.
        """
        steps = quality_report(self.model.mesh, self.model.materials)
        limits = {"bond springs": steps.spring_step_s}
        tame = self.solves or self.limited
        if self.model.by_role["dashpot"] and not tame:
            limits["bond dashpots"] = steps.dashpot_step_s
        if self.contacts is not None:
            stiffness, damping = map(
                self.model.materials.of_contacts, ("contact_stiffness", "contact_damping")
            )
            pairs, counts, _ = self.contacts.store.near_table()
            rates = contact_rates(pairs, counts, self.model.body_mass)
            limits["contact springs"] = spring_step(stiffness * rates)
            if not tame:
                limits["sphere dashpots"] = dashpot_step(damping * rates)
        return limits
