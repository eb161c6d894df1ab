"""Launches of a substep and reads of the host on a device, by kind of scene.

    python -m tests.devices.launches ARCH

prints a table as JSON: for each kind the loops and tasks that Taichi's profiler counts a substep,
those of contact searches apart, and how often the host waits for a number.
"""

import functools
import json
import sys

import taichi as ti
from taichi.profiler.kernel_profiler import get_default_kernel_profiler

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.contact import search
from taichi_dem.kit.launch import Launch
from taichi_dem.mesh.shapes import bar
from taichi_dem.step import drivers
from tests.devices.work import METHODS
from tests.scenes import paper_effects

GAS = effects.GasPressure("left", peak=2e9, rise=1e-5)
BONDS = [effects.BondDamping(), GAS]
CONTACT = [*paper_effects(kind=effects.SphereContact)[:-1], GAS]
#: Methods and effects, with the most launches of a substep beside its sweeps, of a sweep, and reads
#: of the host.
SCENES = {
    "uniform": (Uniform(2e-8), BONDS, (5.3, 0, 0.13)),
    "controlled with contact": (METHODS["controlled"], CONTACT, (23, 0, 0.3)),
    "solved with contact": (ImplicitDashpots(4e-7), CONTACT, (30, 19, 0.3)),
}
#: Begin and end of what is counted, in largest steps: the first ones need more sweeps.
FROM, UNTIL = 16, 64
#: One entry for each call after which the host waits for a number.
READS = []


def counted(function):
    """A function that counts its calls in READS."""

    @functools.wraps(function)
    def counting(*given):
        READS.append(function)
        return function(*given)

    return counting


def records():
    """Number of launches so far by kernel."""
    profiler = get_default_kernel_profiler()
    profiler._update_records()
    profiler._count_statistics()
    return {one.name: one.counter for one in profiler._statistical_results.values()}


def figures(method, listed):
    """Launches, those of searches, and reads of a substep."""
    simulation = Simulation(Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, listed), method, "parallel")
    simulation.advance_to(FROM)
    ti.profiler.clear_kernel_profiler_info()
    before = count_of(simulation)
    READS.clear()
    simulation.advance_to(UNTIL)
    found, waits = records(), len(READS)
    substeps, sweeps = (now - then for now, then in zip(count_of(simulation), before))
    searching = sum(count for name, count in found.items() if "_search" in name)
    stepping = sum(found.values()) - searching
    each = {"launches": stepping, "of searches": searching, "reads": waits, "sweeps": sweeps}
    return {name: n / substeps for name, n in each.items()}


def count_of(simulation):
    """Substeps and sweeps so far."""
    solver = simulation.engine.step.solver
    sweeps = int(simulation.values(solver.total_sweeps)) if solver else 0
    return int(simulation.values(simulation.schedule.evaluations)[0]), sweeps


if __name__ == "__main__":
    # A call that ends when its time is over would read once more on a slow machine.
    drivers.CALL_SECONDS = float("inf")
    ti.init = functools.partial(ti.init, kernel_profiler=True)
    runtime.start(sys.argv[1], threads=2)
    Launch.__call__ = counted(Launch.__call__)
    for module in (drivers, search):
        module.values = counted(module.values)
    print(json.dumps({name: figures(*scene) for name, (*scene, _) in SCENES.items()}))
