"""Certificate of a run with effects="auto": what acted, since when, and what was left out."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.audit import Audit
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.effect_usage import EffectUse
from taichi_dem.mesh.parts import parts_of
from taichi_dem.physics.sphere_pair import CONTACT
from taichi_dem.report.estimates import Estimate, estimates_after
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.part_scales import PartScales
from taichi_dem.state.activity import LATER, SLIP, SOFTENING
from taichi_dem.state.model import Model
from taichi_dem.state.state import State
from taichi_dem.state.timeline import MACRO_TICKS, NEVER
from taichi_dem.step.audit import KINDS
from taichi_dem.step.schedule import Schedule

#: What is skipped of each kind of ``step.audit``, in words.
_SKIPPED = dict(zip(KINDS, ("softening", "slip", "bonds asleep")))
#: Times at which effects began on bodies, by the role that they have in a report.
_TIMES = {"tension": "softening", "shear": "slip", "contact": "contact", "friction": "friction"}


@dataclass(frozen=True)
class Acting:
    """One effect of a run and the time from which it acted.

    Parameters
    ----------
    use : EffectUse
        Activity of the effect.
    since_s : float
        Time at which its limit was first reached [s]; NaN where it never was, or is not known.
    """

    use: EffectUse
    since_s: float

    def __str__(self):
        if self.use.idle:
            return f"{self.use.effect}: never"
        of = f" of {self.use.of:,}" if self.use.of else ""
        begun = f" from {1e3 * self.since_s:.3g} ms" if np.isfinite(self.since_s) else ""
        return f"{self.use.effect}: {self.use.events:,}{of} {self.use.what}{begun}"


@dataclass(frozen=True)
class Certificate:
    """What acted in a run with effects="auto", and a bound of what was left out.

    Parameters
    ----------
    acting : tuple of Acting
        Activity and onset of each effect.
    law_evaluations : int
        Evaluations of softening and slip, one for each unit.
    all_law_evaluations : int
        Evaluations that effects="all" makes.
    sleep : float
        Share that was asked for [-], see ``Scene``.
    asleep : float
        Share of bodies times time that were asleep.
    impulse : float
        Bound of the impulse that sleeping bonds of a connected part left out, as a share of the
        momentum of that part; of the part where this is largest.
    energy : float
        Bound of the energy that they left out, as a share of the energy of that part, likewise.
    audits : tuple of Audit
        Audit of each kind of skipped evaluation.
    left_out : tuple of Estimate
        Estimate of each effect that no law of the scene serves.
    missing : tuple of MissingEffect, default ()
        Effects that were left out, not by choice of the user, and would have acted.
    """

    acting: tuple[Acting, ...]
    law_evaluations: int
    all_law_evaluations: int
    sleep: float
    asleep: float
    impulse: float
    energy: float
    audits: tuple[Audit, ...]
    left_out: tuple[Estimate, ...]
    missing: tuple[Any, ...] = ()

    @property
    def law_ratio(self) -> float:
        """Factor by which evaluations of softening and slip are fewer than with effects="all"."""
        return self.all_law_evaluations / max(1, self.law_evaluations)

    @property
    def holds(self) -> bool:
        """Whether no audit found a miss, no part left out more than asked, nothing is missed."""
        return not self.failure

    @property
    def failure(self) -> str:
        """Why the certificate does not hold, in words; ``""`` where it holds."""
        missed = [audit.failure for audit in self.audits if audit.misses]
        if not self.impulse <= self.sleep:
            missed.append(
                f"sleep left out {self.impulse:.2g} of a part's impulse, {self.sleep:g} asked"
            )
        return ", and ".join([*missed, *(one.what for one in self.missing)])

    @property
    def remedy(self) -> str:
        """What settles what it leaves open, in words."""
        if not self.missing:
            return "run the scene with effects='all'"
        return f"list {', '.join(one.effect for one in self.missing)}"

    def __repr__(self):
        return in_brief(self, *map(str, self.acting), "" if self.holds else "does not hold")

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        since = {one.use.effect: one.since_s for one in self.acting}
        return {
            "acting_since_s": {k: None if np.isnan(v) else v for k, v in since.items()},
            "law_evaluations": self.law_evaluations,
            "all_law_evaluations": self.all_law_evaluations,
            "law_ratio": self.law_ratio,
            "sleep": self.sleep,
            "asleep": self.asleep,
            "left_out_impulse": self.impulse,
            "left_out_energy": self.energy,
            "audits": [audit.as_dict() for audit in self.audits],
            "left_out": [estimate.as_dict() for estimate in self.left_out],
            "holds": self.holds,
        }

    def __str__(self):
        """A line for every kind of thing."""
        skipped = 100.0 * (1.0 - self.law_evaluations / max(1, self.all_law_evaluations))
        lines = [
            *map(str, self.acting),
            f"softening and slip: {skipped:.3g} % of their evaluations skipped",
            self._sleep_line(),
            *(f"left out: {estimate}" for estimate in self.left_out),
            *(f"audit: {audit}" for audit in self.audits if audit.skipped),
        ]
        if not self.holds:
            lines.append(f"this certificate does not hold, as {self.failure}: {self.remedy}")
        return "\n".join(lines)

    def _sleep_line(self):
        if not self.sleep:
            return "asleep: no body, as sleep is 0"
        return (
            f"asleep: {100.0 * self.asleep:.3g} % of body-steps (left out: at most "
            f"{self.impulse:.1g} of the impulse, {self.energy:.1g} of the energy of a part; "
            f"{self.sleep:g} asked)"
        )


def acting_since(model: Model, state: State, schedule: Schedule) -> dict[str, np.ndarray]:
    """Time [s] from which each effect acted on each body, (body_count,), NaN where never, by name.

    Softening and slip: on one of the body's bonds, as soon as it came near a limit. awake: since
    the body was evaluated. Empty unless effects act on demand.
    """
    if state.activity is None:
        return {}
    n, seconds = model.body_count, schedule.tick_seconds
    bonds = _times(values(state.activity.since, slice(model.bond_count)), NEVER, seconds)
    bodies = _times(values(state.activity.touched, slice(n)), LATER, seconds)
    own = np.append(bonds, [[np.nan, np.nan]], axis=0)[model.topology.body_bond]
    first = np.fmin.reduce(own, axis=1, initial=np.nan)
    awake = _times(values(schedule.sleeping.since, slice(n)), NEVER, seconds)
    found = first[:, SOFTENING], first[:, SLIP], bodies[:, 0], bodies[:, 1], awake
    return dict(zip((*_TIMES.values(), "awake"), found))


def _times(ticks, never, tick_seconds):
    return np.where(ticks == never, np.nan, ticks * tick_seconds)


def certificate_of(run: Any, report: Any) -> Certificate:
    """Certificate of a run so far.

    run: the ``Simulation``, started. report: its ``Report`` without a certificate.
    """
    model, state, schedule, now = run.model, run.state, run.schedule, run.time_s
    since = acting_since(model, state, schedule)
    evaluated, laws = _law_evaluations(model, state, schedule)
    skipped = *(laws - evaluated), _bond_steps_asleep(model, since["awake"], now, schedule)
    awake = np.nan_to_num(since["awake"], nan=now)
    scales = PartScales(model, parts_of(model.mesh))
    energy = _energy(run, scales)
    impulse, left_energy = _left_out(run, scales, energy)
    return Certificate(
        acting=tuple(_acting(model, use, since) for use in report.effect_activity),
        law_evaluations=int(evaluated.sum()),
        all_law_evaluations=int(laws.sum()),
        sleep=float(values(schedule.sleeping.share)),
        asleep=float(awake.mean() / now) if now > 0.0 else 0.0,
        impulse=impulse,
        energy=left_energy,
        audits=_audits(run.step.audit, skipped),
        left_out=_not_served(run, scales, energy),
        # What the user chose to leave out is no gap of what was left out for them.
        missing=tuple(one for one in report.missing_effects if not one.is_chosen),
    )


def _law_evaluations(model, state, schedule):
    """Evaluations of softening and slip, a unit each: those made, and those of effects="all"."""
    evaluated = values(state.activity.evaluated, slice(model.bond_count)).sum(axis=0)
    units = 3 * (int(values(schedule.evaluations)[5]) + model.bond_count)
    return evaluated, units * np.array(state.activity.laws, dtype=np.int64)


def _energy(run, scales):
    """Energy that each part got [J]: from loads and supports, or what it has and took if more.

    Zero where it is no more than rounding leaves.
    """
    body, bond, _ = run.energy_balance.tables()
    given = sum(np.abs(scales.sum(column)) for column in body[:, 1:3].T)
    taken = scales.sum(body[:, 0]) + scales.sum_of_bonds(bond.sum(axis=1))
    substeps = int(values(run.schedule.evaluations)[0])
    rounding = scales.sum_of_bonds(bond_rounding(run.model, run.state, substeps))
    energy = np.maximum(given, taken)
    return np.where(energy > rounding, energy, 0.0)


def _left_out(run, scales, energy):
    """Largest shares of impulse and energy of a part that sleep left out there."""
    table = np.zeros((max(1, run.model.bond_count), 2))
    run.readings.left_out(table)
    left = [scales.sum_of_bonds(column) for column in table[: run.model.bond_count].T]
    wholes = run.energy_balance.momentum_exchanged(scales.sum), energy
    return [float((part / np.maximum(whole, 1e-300)).max()) for part, whole in zip(left, wholes)]


def _not_served(run, scales, energy):
    """Estimates of what no law of the scene serves."""
    motion, model = run.motion(), run.model
    moved = motion["position"] - run.first_motion["position"]
    speed = np.linalg.norm(motion["velocity"], axis=1)
    touched = values(run.state.active_effects, slice(model.body_count)) & np.int64(CONTACT)
    borne = scales.under((*model.supports, *model.ground)) | (scales.sum(touched) > 0)
    return estimates_after(scales, moved, speed, run.time_s, energy, borne)


def _acting(model, use, since):
    role = next((e.role for e in model.effects if e.name == use.effect), "")
    times = since.get(_TIMES.get(role, ""), np.zeros(0))
    first = np.fmin.reduce(times, initial=np.nan) if use.events else np.nan
    return Acting(use, float(first))


def _audits(audit, skipped):
    counts = zip(_SKIPPED.values(), skipped, values(audit.audited), values(audit.misses))
    return tuple(
        Audit(max(int(most), int(audited)), int(audited), int(missed), what)
        for what, most, audited, missed in counts
    )


def _bond_steps_asleep(model, awake, now, schedule):
    """Evaluations of bonds that sleep has spared, at the largest step."""
    links = np.stack([model.topology.master, model.topology.slave])
    until = np.nan_to_num(awake, nan=now)[links].max(axis=0, initial=0.0)
    return int(until.sum() / (schedule.tick_seconds * MACRO_TICKS))
