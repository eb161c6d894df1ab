"""Activity of each effect in a run, from the energy balance at its end."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_usage import EffectUse
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.report.energy_balance import EnergyBalance, EnergyTables
from taichi_dem.report.missing_effects import bond_rounding
from taichi_dem.report.readings import Readings
from taichi_dem.state.model import Model

_EPSILON = np.finfo(np.float64).eps
#: Terms of the account that pass through bonds; dashpots are compared with their sum.
_THROUGH_BONDS = ("bond_strain", "bond_dashpot", "softening", "release", "slip")
#: Roles judged by whether they acted: a crack, slip, wall or sticking contact can decide the
#: outcome at little energy.
_STEERING = ("tension", "shear", "contact", "friction", "support", "ground")
#: Roles that define the problem, so that they are kept whatever work they did.
_POSED = {
    "load": "a load is part of the question",
    "support": "a support is part of the question",
    "ground": "the ground is part of the question",
}
_WITHOUT_WORK = ", and holds without doing work"
_OWN = "the account need not show what an effect of your own does"


def effect_activity(
    model: Model,
    energy_balance: EnergyBalance,
    readings: Readings,
    tables: EnergyTables,
    account: Mapping[str, float],
    substeps: int,
) -> tuple[EffectUse, ...]:
    """An EffectUse for every listed effect, in the model's order.

    Events are counted where effects act: one is idle only if not a bit of the run depends on it.
    readings: of the run. tables, account: from the methods of that name of the energy balance.
    substeps: of the run, each of which rounds. Effects are judged by role, so that user-defined
    ones are judged like those of the package; they are never called idle where only their own code
    could tell.
    """
    state = energy_balance.state
    given = abs(account["load_work"]) + abs(account["support_work"]) + energy_balance.start_energy
    rounding = _Rounding(substeps * _EPSILON * given, bond_rounding(model, state, substeps))
    active = values(state.active_effects, slice(model.body_count)), readings.active_bonds()
    found = [
        _by_role(model, energy_balance, tables, active, rounding, effect)
        for effect in _listed(model)
    ]
    return tuple(_use(account, given, model, rounding, *entry) for entry in found)


class _Rounding(NamedTuple):
    """Bounds of rounding errors in the account [J]: of a support, and of each bond."""

    work: float
    heat: np.ndarray


def _listed(model):
    return [effect for effect in model.effects if effect.name]


def _by_role(model, energy_balance, tables, active, rounding, effect):
    """The effect, its counted events in words, their number, and terms of the account or [J]."""
    bond, (bits, marks) = tables[1], active
    if effect.role == "load":
        place = model.loads.index(effect)
        work = energy_balance.load_works(place)
        return effect, "bodies loaded", _with_bit(bits, 1 << place), np.abs(work).sum()
    if effect.role == "support":
        place = model.supports.index(effect)
        done = np.nansum(np.abs(energy_balance.support_works(place)))
        how = "driven" if done > rounding.work and np.any(effect.travel()) else "held"
        count = _with_bit(bits, 1 << len(model.loads) + place)
        return effect, f"bodies {how}", count, done
    if effect.role == "ground":
        place = model.ground.index(effect)
        heat = np.abs(energy_balance.ground_heats(place)).sum()
        count = _with_bit(bits, 1 << len(model.loads) + len(model.supports) + place)
        return effect, "bodies braked", count, heat
    damped = _count(bond[:, 1] > rounding.heat)
    # A shear law may release bonds where no law of tension is listed.
    alone = not any(one.role == "tension" for one in _listed(model))
    return {
        "tension": (effect, "bonds softened", _count(marks[:, 0]), ("softening", "release")),
        "shear": (effect, "bonds slipped", _count(marks[:, 1]), ("slip", *("release",) * alone)),
        "dashpot": (effect, "bonds damped", damped, ("bond_dashpot",)),
        "contact": (
            *(effect, "bodies touched", _with_bit(bits, CONTACT)),
            ("sphere_dashpot", "sphere_strain"),
        ),
        "friction": (effect, "bodies rubbed", _with_bit(bits, RUBBED), ("friction",)),
    }[effect.role]


def _with_bit(bits, bit):
    return _count(bits & np.int64(bit))


def _use(account, given, model, rounding, effect, what, events, energy):
    if isinstance(energy, tuple):
        energy = sum(account[term] for term in energy)
    whole, total = "the energy put in", given
    if effect.role == "dashpot":
        # Of all the energy put in, a fall takes most: its vibration may be damped all the same.
        whole, total = "what bonds took and hold", sum(account[term] for term in _THROUGH_BONDS)
    kept = _POSED.get(effect.role, "" if _tells(effect) else _OWN)
    if effect.role == "support" and energy <= rounding.work:
        kept += _WITHOUT_WORK
    of = {"bonds": model.bond_count, "bodies": model.body_count}.get(what.split()[0], 0)
    return EffectUse(
        effect=effect.name,
        what=what,
        events=events,
        of=of,
        energy_J=float(energy),
        share=float(energy / total) if total > 0.0 else 0.0,
        whole=whole,
        steers=effect.role in _STEERING,
        kept=kept,
        rounding=effect.role == "dashpot" and energy > 0.0 and not events,
    )


def _tells(effect):
    """Whether counts show all that an effect does, as those of the step and of the package do."""
    return _of_the_package(effect) or effect.role in ("contact", "friction")


def _of_the_package(effect):
    """Whether the class itself is the package's; derived classes may act differently."""
    return type(effect).__module__.startswith(("taichi_dem.laws.", "taichi_dem.loads."))


def _count(values):
    return int(np.count_nonzero(values))
