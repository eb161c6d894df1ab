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
SOLVED = ImplicitDashpots(4e-7)
SCENES = {
    "uniform": (Uniform(2e-8), BONDS),
    "limited": (Uniform(5e-8, dashpot="limited"), BONDS),
    "uniform with contact": (Uniform(2e-8), CONTACT),
    "controlled with contact": (METHODS["controlled"], CONTACT),
    "solved": (SOLVED, BONDS),
    "solved with contact": (SOLVED, CONTACT),
}
#: Begin and end of what is counted, in largest steps: the first ones need more sweeps.
FROM, UNTIL = 16, 64


class Reads:
    """Counts the calls after which the host waits for a number."""

    def __init__(self):
        self.count = 0
        Launch.__call__ = self.counted(Launch.__call__)
        for module in (drivers, search):
            module.values = self.counted(module.values)

    def counted(self, function):
        """A function that counts its calls."""

        @functools.wraps(function)
        def counting(*given):
            self.count += 1
            return function(*given)

        return counting


def records():
    """Number of launches so far by kernel."""
    profiler = get_default_kernel_profiler()
    profiler._update_records()
    profiler._count_statistics()
    return {one.name: one.counter for one in profiler._statistical_results.values()}


def figures(method, listed, reads):
    """Launches, those of searches, and reads of a substep."""
    simulation = Simulation(Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, listed), method, "parallel")
    simulation.advance_to(FROM)
    ti.profiler.clear_kernel_profiler_info()
    before, reads.count = count_of(simulation), 0
    simulation.advance_to(UNTIL)
    found, waits = records(), reads.count
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
    counter = Reads()
    print(json.dumps({name: figures(*scene, counter) for name, scene in SCENES.items()}))
