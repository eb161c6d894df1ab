"""Effects of a run: what acted, since when, and with what share of the energy."""

from collections.abc import Mapping

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_usage import EffectUse
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.report.energy_balance import EnergyBalance
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.readings import Run
from taichi_dem.state.activity import LATER
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
    "contact": ("bodies touched", ("sphere_dashpot", "sphere_strain"), "contact"),
    "friction": ("bodies rubbed", ("friction",), "friction"),
}
_WITHOUT_WORK = ", and holds without doing work"
_OWN = "the account need not show what an effect of your own does"


def on_demand(run: Run) -> tuple[dict[str, np.ndarray], int, int]:
    """Where and when laws acted on demand so far; empty and zero where all are evaluated.

    By name, times from which an effect acted on each body [s], NaN where never; "awake": since it
    was evaluated. Laws of bonds: on one of its bonds, as soon as it came near a limit. Also how
    often the law of bonds was evaluated, a unit each, and how often that was skipped.
    """
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
    """An EffectUse for every listed effect, in the model's order.

    Events are counted where effects act: one is idle only if not a bit of the run depends on it.
    account: of the energy balance. Effects are judged by role, so that user-defined ones are judged
    like those of the package; they are never called idle where only their own code could tell.
    """
    uses = _Uses(run, balance, account)
    return tuple(uses.of(effect) for effect in run.model.effects if effect.name)


class _Uses:
    """Makes the EffectUse of an effect."""

    def __init__(self, run, balance, account):
        self.run, self.account, self.works = run, account, balance.works()
        self.given = abs(account["load_work"]) + abs(account["support_work"]) + balance.start_energy
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

    def of(self, effect):
        """The use of one effect."""
        find = self._law if effect.role in _LAWS else self._drive
        what, marks, energy, kept = find(effect)
        whole, total, events = "the energy put in", self.given, int(np.count_nonzero(marks))
        if effect.role == "dashpot":
            # Of all the energy put in, a fall takes most: its vibration may be damped all the same.
            whole, total = "what bonds took and hold", self._sum(_THROUGH_BONDS)
        of = {"bonds": self.run.model.bond_count, "bodies": self.run.model.body_count}
        return EffectUse(
            effect=effect.name,
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
        kept = f"{article} {effect.role} is part of the question"
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
