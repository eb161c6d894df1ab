"""Activity of each effect in a run, from the energy balance at its end."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from taichi_dem.diagnostics.energy_balance import EnergyBalance, EnergyTables
from taichi_dem.diagnostics.missing_effects import MissingEffects
from taichi_dem.kit.effect_usage import EffectUse
from taichi_dem.scene import outer_faces_warnings

if TYPE_CHECKING:
    from taichi_dem.engine.model import Model

_EPSILON = np.finfo(np.float64).eps
#: Terms of the account that pass through bonds; dashpots are compared with their sum.
_THROUGH_BONDS = ("bond_strain", "bond_dashpot", "softening", "release", "slip")
#: Roles judged by whether they acted: a crack, slip, wall or sticking contact can decide the
#: outcome at little energy.
_STEERING = ("tension", "shear", "contact", "friction", "support")
#: Roles that define the problem, so that they are kept whatever work they did.
_POSED = {
    "load": "a load is part of the question",
    "support": "a support is part of the question",
}
_WITHOUT_WORK = ", and holds without doing work"
_OWN = "the account need not show what an effect of your own does"
_UNTOUCHED = "bodies overlap where faces lack the spheres for it"
_APART = "parts of the mesh may pass through each other unseen, as their outer faces lack spheres"
_STUCK = "springs between spheres that stick hold without taking energy"
_NO_TRACE = "without sphere dashpots a touch between two recordings leaves no trace"


def effect_activity(
    model: "Model",
    energy_balance: EnergyBalance,
    tables: EnergyTables,
    account: Mapping[str, float],
    missing_effects: MissingEffects,
    substeps: int,
) -> tuple[EffectUse, ...]:
    """An EffectUse for every listed effect, in the model's order.

    tables, account: from the methods of that name of the energy balance. missing_effects: the
    ``MissingEffects`` of the run. substeps: of the run, each of which rounds. Effects are judged by
    role, so that user-defined ones are judged like those of the package; they are never called idle
    where only their own code could tell.
    """
    given = abs(account["load_work"]) + abs(account["support_work"]) + energy_balance.start_energy
    rounding = _Rounding(
        substeps * _EPSILON * given, _bond_rounding(model, energy_balance.state, substeps)
    )
    found = [
        _by_role(model, energy_balance, tables, missing_effects.touching, rounding, effect)
        for effect in _listed(model)
    ]
    lacking = _UNTOUCHED if missing_effects.outer.times > 0 else _unseen(model)
    parts = account, given, model, energy_balance.state, lacking, rounding
    return tuple(_use(*parts, *entry) for entry in found)


def _unseen(model):
    """Why a run with contact may miss that bodies meet, in words; "" where it would see it."""
    return _APART if model.has_contact and outer_faces_warnings(model) else ""


class _Rounding(NamedTuple):
    """Bounds of rounding errors in the account [J]: of a support, and of each bond."""

    work: float
    heat: np.ndarray


def _bond_rounding(model, state, substeps):
    """Heat that rounding alone may leave in each bond's dashpots [J], (bond_count,).

    A bond's opening is the difference of coordinates of up to X [m], so it is known to eps X. In
    every substep rounding may thus put into the bond the energy of such an opening,
    A (k_n + k_s) (eps X)^2 / 2, which its dashpots then take.
    """
    reach = max(np.abs(model.mesh.points).max(), np.abs(state.position.to_numpy()).max())
    area = 3.0 * model.bonds["area"]
    stiffness = model.bond_stiffness.sum(axis=1)
    return 0.5 * substeps * area * stiffness * (_EPSILON * reach) ** 2


def _listed(model):
    return [effect for effect in model.effects if effect.name]


def _by_role(model, energy_balance, tables, touching, rounding, effect):
    """The effect, its counted events in words, their number, and terms of the account or [J]."""
    body, bond, pair = tables
    if effect.role == "load":
        work = energy_balance.load_works(model.loads.index(effect))
        return effect, "bodies given work", _count(work), np.abs(work).sum()
    if effect.role == "support":
        work = energy_balance.support_works(model.supports.index(effect))
        done = np.nansum(np.abs(work))
        how = "driven" if done > rounding.work and np.any(effect.travel()) else "held"
        return effect, f"bodies {how}", int((~np.isnan(work)).sum()), done
    touched = max(touching, _count(body[:, 3]) + _count(pair[:, 1]))
    rubbed = _count(body[:, 4]) + _count(pair[:, 2])
    damped = _count(bond[:, 1] > rounding.heat)
    return {
        "tension": (effect, "bonds softened", _count(bond[:, 4]), ("softening", "release")),
        "shear": (effect, "bonds slipped", _count(bond[:, 2]), ("slip",)),
        "dashpot": (effect, "bonds damped", damped, ("bond_dashpot",)),
        "contact": (effect, "pairs touched", touched, ("sphere_dashpot", "sphere_strain")),
        "friction": (effect, "bodies rubbed", rubbed, ("friction",)),
    }[effect.role]


def _use(account, given, model, state, lacking, rounding, effect, what, events, energy):
    if isinstance(energy, tuple):
        energy = sum(account[term] for term in energy)
    whole, total = "the energy put in", given
    if effect.role == "dashpot":
        # Of all the energy put in, a fall takes most: its vibration may be damped all the same.
        whole, total = "what bonds took and hold", sum(account[term] for term in _THROUGH_BONDS)
    kept = _why_kept(model, state, lacking, effect, events)
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


def _why_kept(model, state, lacking, effect, events):
    """Reason to keep an effect whatever was counted, in words; "" where the count decides.

    lacking: reason why a count of contacts is incomplete, as faces carry no spheres; "" if
    complete.
    """
    reason = _POSED.get(effect.role, "" if _of_the_package(effect) else _OWN)
    if effect.role in ("contact", "friction"):
        if lacking:
            return lacking
        if not _spheres(model, state):
            return ""
    if getattr(effect, "remembers", False) and not reason and not events:
        return _STUCK
    if effect.role == "contact" and not reason and not events:
        return "" if model.material.contact_damping > 0.0 else _NO_TRACE
    return reason


def _of_the_package(effect):
    """Whether the class itself is the package's; derived classes may act differently."""
    return type(effect).__module__.startswith("taichi_dem.effects.")


def _spheres(model, state):
    """Whether any face carries contact spheres; else nothing can have touched."""
    return model.has_contact and bool((state.exposed_tick.to_numpy() >= 0).any())


def _count(values):
    return int(np.count_nonzero(values))
