"""Costs of a step of the blast with other effects, from the same states (``cost_of_effects.py``).

The functions are called in a process of their own, where all candidates are alive at once and take
turns. A cost is a dict of numbers, see ``paired_costs``.
"""

from dataclasses import replace
from typing import NamedTuple

from _blast import EFFECTS
from _effects_frozen import paired_costs, states_of_run
from _effects_runs import PEAK
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Material, Scene, read_mesh, simulate
from taichi_dem.demo import figures_of_certificate

#: Effects in the order in which they are added; the load is always there.
ORDER = ("bond_damping", "softening", "shear_slip", "body_contact", "sticking_friction")
#: Contacts in place of that of bodies: their states are those of an own run.
REPLACING = ("sphere_contact", "surface_contact")
#: Pressure at which no bond of the paper's block reaches its envelope [Pa].
WEAK = 0.01 * PEAK
BEST, AUTO, EVERY = "best list", "auto", "all effects"


class KnownList(NamedTuple):
    """Material and peak pressure [Pa] of a scene, and the shortest list that leaves out nothing."""

    material: Material
    peak: float
    best: tuple


_UNDAMPED = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
#: Scenes whose best list of effects is known, by what happens in them.
KNOWN_LISTS = {
    "blast": KnownList(CONCRETE, PEAK, ORDER),
    "weak pulse": KnownList(CONCRETE, WEAK, ("bond_damping",)),
    "weak pulse, no damping": KnownList(_UNDAMPED, WEAK, ()),
    "blast, no friction": KnownList(replace(CONCRETE, friction=0.0), PEAK, ORDER[:-1]),
}


def costs_of_blast(scenes, lists, certified, **shared):
    """Costs of scenes and of lists, and the certificate of a run until a time [s]: by one process.

    Contact of all effects is compiled once for all of them.
    """
    return {
        "blast": blast_costs(scenes, **shared),
        "lists": list_costs(lists, **shared),
        "certificate": certificate(certified, shared["step"]),
    }


def blast_costs(scenes, until, step, states, **timing):
    """Costs of lists of effects by scene, the first with all; states: how many over the run."""
    method, times = ImplicitDashpots(step), middles(states, until)
    candidates = {scene: scene_of(CONCRETE, PEAK, names) for scene, names in scenes.items()}
    shared = states_of_run(next(iter(candidates.values())), method, times)
    begun = dict.fromkeys(candidates, shared)
    for scene, names in scenes.items():
        if set(names) & set(REPLACING):
            begun[scene] = states_of_run(candidates[scene], method, times)
    return paired_costs(candidates, begun, method, **timing)


def list_costs(scenes, until, step, states, **timing):
    """Costs of effects="auto" and of all effects beside the best list, by scene of KNOWN_LISTS.

    Each candidate begins from states of its own run, which are the same but for round-off.
    """
    method, times = ImplicitDashpots(step), middles(states, until)
    found = {}
    for scene in scenes:
        material, peak, best = KNOWN_LISTS[scene]
        lists = {BEST: best, AUTO: AUTO, EVERY: ORDER}
        candidates = {name: scene_of(material, peak, names) for name, names in lists.items()}
        begun = {name: states_of_run(one, method, times) for name, one in candidates.items()}
        found[scene] = paired_costs(candidates, begun, method, **timing)
    return found


def scene_of(material, peak, names):
    """The paper's block under gas of some peak pressure [Pa], with effects by name, or "auto"."""
    mesh, gas = read_mesh(PAPER_BLOCK), EFFECTS["gas_pressure"](peak=peak)
    if names == AUTO:
        return Scene(mesh, material, AUTO, loads=[gas])
    return Scene(mesh, material, [gas, *(EFFECTS[name]() for name in names)])


def certificate(until, step):
    """Figures of the certificate of the paper's blast with effects="auto"."""
    scene = scene_of(CONCRETE, PEAK, AUTO)
    found = simulate(scene, until=until, method=ImplicitDashpots(step), samples=1)
    return figures_of_certificate(found.certificate)


def middles(count, until):
    """Times [s] in the middle of equal parts of a run."""
    return [until * (k + 0.5) / count for k in range(count)]
