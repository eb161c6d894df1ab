"""What each effect of a run did: read off the energy account at the end, at no cost in the step."""

import numpy as np

from taichi_dem.effect_use import EffectUse


def effects_acted(model, ledger, tables, account, touching):
    """An EffectUse for every listed effect, in the model's order.

    tables, account: what the ledger's methods of that name gave. touching: most pairs of bodies
    that a recording saw in contact. Judged by role, so that an effect of one's own is judged like
    those of the package.
    """
    given = abs(account["load_work"]) + abs(account["support_work"]) + ledger.start_energy
    found = [_by_role(model, ledger, tables, touching, effect) for effect in _listed(model)]
    return tuple(_use(account, given, model, *entry) for entry in found)


def _listed(model):
    return [effect for effect in model.effects if effect.name]


def _by_role(model, ledger, tables, touching, effect):
    """(effect, what, events, energy): terms of the account, or a number [J]."""
    body, bond, pair = tables
    if effect.role == "load":
        work = ledger.load_works(model.loads.index(effect))
        return effect, "bodies pushed", _count(work), np.abs(work).sum()
    if effect.role == "support":
        work = ledger.support_works(model.supports.index(effect))
        return effect, "bodies held", _count(work), np.abs(work).sum()
    touched = max(touching, _count(body[:, 3]) + _count(pair[:, 1]))
    rubbed = _count(body[:, 4]) + _count(pair[:, 2])
    return {
        "tension": (effect, "bonds softened", _count(bond[:, 4]), ("softening", "release")),
        "shear": (effect, "bonds slipped", _count(bond[:, 2]), ("slip",)),
        "dashpot": (effect, "bonds damped", _count(bond[:, 1]), ("bond_dashpot",)),
        "contact": (effect, "pairs touched", touched, ("sphere_dashpot", "sphere_strain")),
        "friction": (effect, "bodies rubbed", rubbed, ("friction",)),
    }[effect.role]


def _use(account, given, model, effect, what, events, energy):
    if isinstance(energy, tuple):
        energy = sum(account[term] for term in energy)
    of = {"bonds": model.bond_count, "bodies": model.body_count}.get(what.split()[0], 0)
    return EffectUse(
        effect=effect.name,
        what=what,
        events=events,
        of=of,
        energy_J=float(energy),
        share=float(energy / given) if given > 0.0 else 0.0,
        # They direct forces; a crack or a wall decides much and takes little.
        steers=effect.role in ("tension", "contact", "support"),
    )


def _count(values):
    return int(np.count_nonzero(values))
