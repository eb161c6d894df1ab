"""The table of effects of a run: which acted, since when and where, and what was left out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_table import BaseCertificate, EffectTable, EffectUse
from taichi_dem.laws.contracts import BondLaw, ShearLaw, TensionLaw, UnitLaw
from taichi_dem.mesh.topology import parts_of
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.report.energy_balance import EnergyBalance, energy_put_in
from taichi_dem.report.estimates import PartScales, not_served
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.readings import Run
from taichi_dem.state.model import MANY, SINGLE, names_of
from taichi_dem.state.state import LATER
from taichi_dem.state.timeline import NEVER
from taichi_dem.step.sleeping import ROUNDINGS

#: Terms of the account that pass through bonds; dashpots are compared with their sum.
_THROUGH_BONDS = ("bond_strain", "bond_dashpot", "softening", "release", "slip")
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
    kinds = (BondLaw,) if model.by_role["bond"] else (TensionLaw, ShearLaw)
    laws = [kind.reported.since for kind in kinds]
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
        self.run, self.account, self.works = run, account, np.abs(balance.works())
        self.given = energy_put_in(account)
        self.bits = values(run.state.active_effects, slice(run.model.body_count))
        self.since, self.evaluated, self.skipped = on_demand(run)
        parts, damped = run.readings.active_bonds(), run.readings.bonds()[:, 1] > bond_rounding(run)
        rubbed, touched = (self.bits & np.int64(bit) for bit in (RUBBED, CONTACT))
        # In the order of SINGLE.
        marks = parts.any(axis=1), parts[:, 0], parts[:, 1], damped, rubbed, touched
        self.marks = dict(zip(SINGLE, marks))

    def of(self, effect, name):
        """The use of one effect, by its name among all."""
        what, marks, energy, kept = (self._drive if effect.role in MANY else self._law)(effect)
        whole, total, events = EffectUse.whole, self.given, int(np.count_nonzero(marks))
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
            **self._demanded(effect, events),
        )

    def _sum(self, terms):
        return sum(self.account[term] for term in terms)

    def _law(self, effect):
        """Events in words, where they were, the energy booked, and why it is kept in any case."""
        terms = effect.reported.terms
        if effect.role == "shear" and not any(e.name for e in self.run.model.by_role["tension"]):
            # A shear law may release bonds where no law of tension is listed.
            terms = *terms, "release"
        # Counts show all that laws of the package do; derived classes may act differently.
        ours = type(effect).__module__.startswith(("taichi_dem.laws.", "taichi_dem.loads."))
        kept = "" if ours or effect.role in ("contact", "friction") else _OWN
        return effect.reported.events, self.marks[effect.role], self._sum(terms), kept

    def _drive(self, effect):
        """The same of a load, support or ground, kept whatever work it did."""
        model, what = self.run.model, effect.reported.events
        kept = f"{'the' if effect.role == 'ground' else 'a'} {effect.role} defines the problem"
        place = (*model.loads, *model.supports, *model.ground).index(effect)
        marks, loads = self.bits & np.int64(1 << place), len(model.loads)
        accounts = {"load": place, "support": loads, "ground": place + 1 - len(model.supports)}
        works = self.works[:, accounts[effect.role]]
        if effect.role != "support":
            return what, marks, works.sum(), kept
        what = "bodies driven" if np.any(effect.travel()) else what
        return what, marks, np.where(marks != 0, works, 0.0).sum(), kept

    def _demanded(self, effect, events):
        """When and where an effect that acted on demand began, and its evaluations."""
        row, times = {}, self.since.get(effect.reported.since, np.zeros(0))
        if events and np.isfinite(times).any():
            first = int(np.nanargmin(times))
            row = {"since_s": float(times[first]), "where": f"body {first}"}
        if isinstance(effect, UnitLaw):
            row.update(evaluations=self.evaluated, skipped=self.skipped)
        return row


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
        Bound of the impulse that sleeping bonds of a part left out, as a share of its momentum.
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
        names = "law_evaluations", "all_law_evaluations", "law_ratio", "sleep", "asleep"
        figures = {name: getattr(self, name) for name in names}
        left = {"left_out_impulse": self.impulse, "left_out_energy": self.energy}
        return {**super().as_dict(), **figures, **left}

    def left_out_lines(self) -> list[str]:
        """What was left out, in lines."""
        skipped = 100.0 * (1.0 - self.law_evaluations / max(1, self.all_law_evaluations))
        asleep = "no body, as sleep is 0"
        if self.sleep:
            asleep = (
                f"{100.0 * self.asleep:.3g} % of body-steps (left out: at most "
                f"{self.impulse:.1g} of a part's impulse, {self.energy:.1g} of its energy; "
                f"{self.sleep:g} allowed)"
            )
        law = f"law of bonds: {skipped:.3g} % of its evaluations skipped"
        return [law, f"asleep: {asleep}", *super().left_out_lines()]


def certificate_of(
    run: Run, balance: EnergyBalance, table: EffectTable, way: np.ndarray
) -> Certificate:
    """The table of a run so far as its certificate; way: of each body since the start [m], (n,)."""
    now = run.schedule.time_s
    awake = np.nan_to_num(on_demand(run)[0]["awake"], nan=now)
    scales = PartScales(run.model, parts_of(run.model.mesh))
    energy = _energy(run, balance, scales)
    impulse, left = _slept(run, balance, scales, energy)
    share = float(values(run.schedule.sleeping.share))
    asleep = float(awake.mean() / now) if now > 0.0 else 0.0
    slept = {"sleep": share, "asleep": asleep, "impulse": impulse, "energy": left}
    left_out = not_served(run, scales, energy, way)
    return Certificate(**{**vars(table), **slept, "left_out": left_out})


def _energy(run, balance, scales):
    """Energy that each part got [J]: from loads and supports, or what it has and took if more."""
    body, bond, _ = balance.tables()
    given = sum(np.abs(scales.sum(column)) for column in body[:, 1:3].T)
    taken = scales.sum(body[:, 0]) + scales.sum_of_bonds(bond.sum(axis=1))
    energy = np.maximum(given, taken)
    return np.where(energy > scales.sum_of_bonds(bond_rounding(run)), energy, 0.0)


def _slept(run, balance, scales, energy):
    """Largest shares of impulse and energy of a part that sleep left out there."""
    table = np.zeros((max(1, run.model.bond_count), 2))
    run.readings.left_out(table)
    lightest = np.full(scales.count, np.inf)
    np.minimum.at(lightest, scales.part, run.model.body_mass)
    had = np.sqrt(2.0 * lightest * energy)
    wholes = np.maximum(had, balance.momentum_exchanged(scales.sum)), energy
    moves = energy > ROUNDINGS**2 * scales.sum_of_bonds(bond_rounding(run))
    left = (scales.sum_of_bonds(column) for column in table[: run.model.bond_count].T)
    shares = (np.where(moves, part, 0.0) / np.maximum(w, 1e-300) for part, w in zip(left, wholes))
    return [float(share.max()) for share in shares]
