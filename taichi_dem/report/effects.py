"""Effects of a run: which acted, since when, and with what share of the energy."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_table import BaseCertificate, EffectUse
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.report.energy_balance import EnergyBalance, energy_put_in
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.readings import Run
from taichi_dem.state.model import names_of
from taichi_dem.state.state import LATER
from taichi_dem.state.timeline import NEVER

_EPSILON = np.finfo(np.float64).eps
#: Terms of the account that pass through bonds; dashpots are compared with their sum.
_THROUGH_BONDS = ("bond_strain", "bond_dashpot", "softening", "release", "slip")
#: By role of each law: its events in words, the terms of the account that it books, and the name
#: of the times at which it began on bodies.
_LAWS = {
    "bond": ("bonds damaged", ("softening", "release", "slip"), "damage"),
    "tension": ("bonds softened", ("softening", "release"), "softening"),
    "shear": ("bonds slipped", ("slip",), "slip"),
    "dashpot": ("bonds damped", ("bond_dashpot",), ""),
    "contact": ("bodies touched", ("sphere_dashpot", "sphere_strain", "hysteresis"), "contact"),
    "friction": ("bodies rubbed", ("friction",), "friction"),
}
_WITHOUT_WORK = ", and holds without doing work"
_OWN = "the energy balance may not show what an effect of your own does"


def on_demand(run: Run) -> tuple[dict[str, np.ndarray], int, int]:
    """Where and when laws acted on demand so far; empty and zero where all are evaluated."""
    activity, schedule, model = run.state.activity, run.schedule, run.model
    if activity is None:
        return {}, 0, 0
    n, bonds, seconds = model.body_count, model.bond_count, schedule.tick_seconds
    begun = _times(values(activity.since, slice(bonds)), NEVER, seconds)
    own = np.append(begun, [[np.nan, np.nan]], axis=0)[model.topology.body_bond]
    first = np.fmin.reduce(own, axis=1, initial=np.nan)
    touched = _times(values(activity.touched, slice(n)), LATER, seconds)
    awake = _times(values(schedule.sleeping.since, slice(n)), NEVER, seconds)
    laws = ("damage",) if model.by_role["bond"] else ("softening", "slip")
    times = dict(zip((*laws, "contact", "friction"), (*first.T[: len(laws)], *touched.T)))
    evaluated = int(values(activity.evaluated, slice(bonds)).sum())
    units = 3 * (int(values(schedule.evaluations)[5]) + bonds)
    return {**times, "awake": awake}, evaluated, units - evaluated


def _times(ticks, never, tick_seconds):
    return np.where(ticks == never, np.nan, ticks * tick_seconds)


def effect_uses(
    run: Run, balance: EnergyBalance, account: Mapping[str, float]
) -> tuple[EffectUse, ...]:
    """An EffectUse for every listed effect, in the model's order."""
    uses = _Uses(run, balance, account)
    named = zip(names_of(run.model.effects), run.model.effects)
    return tuple(uses.of(effect, name) for name, effect in named if name)


class _Uses:
    """Makes the EffectUse of an effect."""

    def __init__(self, run, balance, account):
        self.run, self.account, self.works = run, account, balance.works()
        self.given = energy_put_in(account)
        self.bits = values(run.state.active_effects, slice(run.model.body_count))
        self.since, self.evaluated, self.skipped = on_demand(run)
        marks = run.readings.active_bonds()
        self.marks = {
            "bond": marks.any(axis=1),
            "tension": marks[:, 0],
            "shear": marks[:, 1],
            "dashpot": run.readings.bonds()[:, 1] > bond_rounding(run),
            "contact": self.bits & np.int64(CONTACT),
            "friction": self.bits & np.int64(RUBBED),
        }

    def of(self, effect, name):
        """The use of one effect, by its name among all."""
        find = self._law if effect.role in _LAWS else self._drive
        what, marks, energy, kept = find(effect)
        whole, total, events = "the energy put in", self.given, int(np.count_nonzero(marks))
        if effect.role == "dashpot":
            # Of all the energy put in, a fall takes most: its vibration may be damped all the same.
            whole, total = "what bonds took and hold", self._sum(_THROUGH_BONDS)
        of = {"bonds": self.run.model.bond_count, "bodies": self.run.model.body_count}
        return EffectUse(
            effect=name,
            what=what,
            events=events,
            of=of[what.split()[0]],
            energy_J=float(energy),
            share=float(energy / total) if total > 0.0 else 0.0,
            whole=whole,
            # A crack, slip, wall or sticking contact can decide the outcome at little energy.
            steers=effect.role not in ("dashpot", "load"),
            kept=kept,
            rounding=effect.role == "dashpot" and energy > 0.0 and not events,
            **self._demanded(effect.role, events),
        )

    def _sum(self, terms):
        return sum(self.account[term] for term in terms)

    def _law(self, effect):
        """Events in words, where they were, the energy booked, and why it is kept in any case."""
        what, terms, _ = _LAWS[effect.role]
        roles = {one.role for one in self.run.model.effects if one.name}
        if effect.role == "shear" and "tension" not in roles:
            # A shear law may release bonds where no law of tension is listed.
            terms = *terms, "release"
        # Counts show all that laws of the package do; derived classes may act differently.
        ours = type(effect).__module__.startswith(("taichi_dem.laws.", "taichi_dem.loads."))
        kept = "" if ours or effect.role in ("contact", "friction") else _OWN
        return what, self.marks[effect.role], self._sum(terms), kept

    def _drive(self, effect):
        """The same of a load, support or ground, kept whatever work it did."""
        model, article = self.run.model, "the" if effect.role == "ground" else "a"
        kept = f"{article} {effect.role} defines the problem"
        drives = *model.loads, *model.supports, *model.ground
        place = drives.index(effect)
        marks, loads = self.bits & np.int64(1 << place), len(model.loads)
        accounts = {"load": place, "support": loads, "ground": place + 1 - len(model.supports)}
        works = np.abs(self.works[:, accounts[effect.role]])
        if effect.role != "support":
            what = "bodies loaded" if effect.role == "load" else "bodies braked"
            return what, marks, works.sum(), kept
        done = np.where(marks != 0, works, 0.0).sum()
        rounds = done <= int(values(self.run.schedule.evaluations)[0]) * _EPSILON * self.given
        is_driven = not rounds and np.any(effect.travel())
        kept += _WITHOUT_WORK if rounds else ""
        return f"bodies {'driven' if is_driven else 'held'}", marks, done, kept

    def _demanded(self, role, events):
        """When and where an effect that acted on demand began, and its evaluations."""
        found, name = {}, _LAWS[role][2] if role in _LAWS else ""
        times = self.since.get(name, np.zeros(0))
        if events and np.isfinite(times).any():
            first = int(np.nanargmin(times))
            found = {"since_s": float(times[first]), "where": f"body {first}"}
        if role in ("bond", "tension", "shear"):
            found.update(evaluations=self.evaluated, skipped=self.skipped)
        return found


@dataclass(frozen=True, kw_only=True, repr=False)
class Certificate(BaseCertificate):
    """What acted in a run with effects="auto", and a bound of what was left out.

    Parameters
    ----------
    acting : tuple of EffectUse
        Activity, onset and evaluations of each effect.
    left_out : tuple of Estimate
        Estimate of each effect that no law of the scene serves.
    warnings : tuple of str
        Sentences of the report about the run, all but those about missing effects.
    sleep : float
        Share that was asked for [-], see ``Scene``.
    asleep : float
        Share of bodies times time that were asleep.
    impulse : float
        Bound of the impulse that sleeping bonds of a connected part left out, as a share of its
        momentum; largest over the parts.
    energy : float
        Bound of the energy that they left out, as a share of the energy of that part, likewise.
    missing : tuple of MissingEffect, default ()
        Effects that were left out and would have acted.
    """

    sleep: float
    asleep: float
    impulse: float
    energy: float

    @property
    def law_evaluations(self) -> int:
        """Evaluations of the law of bonds, one for each unit; effects that share it share them."""
        return max((use.evaluations for use in self.acting), default=0)

    @property
    def all_law_evaluations(self) -> int:
        """Evaluations of them that effects="all" makes."""
        return self.law_evaluations + max((use.skipped for use in self.acting), default=0)

    @property
    def law_ratio(self) -> float:
        """Factor by which evaluations of the law of bonds are fewer than with effects="all"."""
        return self.all_law_evaluations / max(1, self.law_evaluations)

    @property
    def faults(self) -> tuple[str, ...]:
        """More left out than asked, and effects that are missed."""
        if self.impulse <= self.sleep:
            return super().faults
        left = f"sleep left out {self.impulse:.2g} of a part's impulse, {self.sleep:g} allowed"
        return left, *super().faults

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        laws = "law_evaluations", "all_law_evaluations", "law_ratio"
        return {
            **super().as_dict(),
            **{name: getattr(self, name) for name in (*laws, "sleep", "asleep")},
            "left_out_impulse": self.impulse,
            "left_out_energy": self.energy,
        }

    def left_out_lines(self) -> list[str]:
        """What was left out, in lines."""
        skipped = 100.0 * (1.0 - self.law_evaluations / max(1, self.all_law_evaluations))
        asleep = "asleep: no body, as sleep is 0"
        if self.sleep:
            asleep = (
                f"asleep: {100.0 * self.asleep:.3g} % of body-steps (left out: at most "
                f"{self.impulse:.1g} of the impulse, {self.energy:.1g} of the energy of a part; "
                f"{self.sleep:g} asked)"
            )
        law = f"law of bonds: {skipped:.3g} % of its evaluations skipped"
        return [law, asleep, *super().left_out_lines()]
