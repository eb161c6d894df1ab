"""Time of whole steps of one blast in a process of its own: threads cannot change within one.

    python _scaling_worker.py JOB.json

Prints seconds a step, one a repeat, what the busiest thread took of the cores in a step, and a
digest of where the bodies are in the end, as JSON.
"""

import glob
import json
import os
import time

import numpy as np
import taichi as ti

from _blast import METHODS, paper_effects
from taichi_dem import CONCRETE, Scene, Simulation, effects, read_mesh, runtime
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import read_job
from taichi_dem.mesh.reorder import in_space_order
from taichi_dem.mesh.shapes import bar

#: Length and width of the bar that stands for a block [m].
BAR = (2.0, 1.0)


def scene_of(mesh, cells):
    """The paper's effects on a mesh file, or on a bar of some boxes under the same gas."""
    if mesh:
        return Scene(in_space_order(read_mesh(mesh)), CONCRETE, paper_effects())
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    gas = effects.GasPressure(group="left")
    return Scene(in_space_order(bar(*BAR, cells)), CONCRETE, [*blown, gas])


def thread_seconds():
    """CPU seconds of each thread of this process so far, by its number; empty where unknown."""
    found = {}
    for path in glob.glob("/proc/self/task/*/schedstat"):
        with open(path, encoding="ascii") as handle:
            found[int(path.split("/")[-2])] = 1e-9 * int(handle.read().split()[0])
    return found


def busiest(before, after):
    """CPU seconds that nobody could spare: of the main thread, and of the busiest of the others.

    The main thread waits while the others work, so on free cores a run takes no less. None where
    threads are not known.
    """
    spent = {number: seconds - before.get(number, 0.0) for number, seconds in after.items()}
    if not spent:
        return None
    main_thread = spent.pop(os.getpid())
    return main_thread + max(spent.values(), default=0.0)


def timed(simulation, warm, steps, repeats):
    """Seconds a step, and those of the busiest thread, of some steps after warm ones, two lists."""
    simulation.advance_to(warm)
    seconds, busy = [], []
    for k in range(repeats):
        started, before = time.perf_counter(), thread_seconds()
        simulation.advance_to(warm + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
        found = busiest(before, thread_seconds())
        busy.append(found / steps if found is not None else None)
    return seconds, busy


def bytes_a_step(simulation):
    """Bytes that a step of all bodies must move at least: the model read, the state written too."""
    sizes = {}
    engine = simulation.loan.engine
    for part, kind in (("tables", "constant"), ("state", "saved")):
        kept = FieldMemory(getattr(engine, part), kind)
        sizes[part] = sum(array.nbytes for array in kept.read().values())
    return sizes["tables"] + 2 * sizes["state"]


@ti.kernel
def _copy(a: ti.template(), b: ti.template()):
    for k in a:
        b[k] = a[k]


def bandwidth(entries=1 << 24, repeats=5):
    """Bytes a second that a copy of numbers reads and writes, the best of some."""
    a, b = (ti.field(ti.f64, shape=entries) for _ in range(2))
    best = 0.0
    for _ in range(repeats + 1):
        ti.sync()
        started = time.perf_counter()
        _copy(a, b)
        ti.sync()
        best = max(best, 16.0 * entries / (time.perf_counter() - started))
    return best


def main():
    """Do a job and print what it measured."""
    job = read_job()
    runtime.start(job["arch"], job["threads"])
    make, step = METHODS[job["method"]]
    scene = scene_of(job["mesh"], job["cells"])
    simulation = Simulation(scene, make(step), job["driver"])
    seconds, busy = timed(simulation, job["warm"], job["steps"], job["repeats"])
    motion = simulation.state.motion()
    found = {
        "seconds": seconds,
        "busy": busy,
        "driver": simulation.driver.name,
        "bodies": simulation.model.body_count,
        "bytes": bytes_a_step(simulation),
        "bandwidth": bandwidth(),
        "broken": int((simulation.state.broken_tick.to_numpy() >= 0).sum()),
        "digest": digest(*(np.ascontiguousarray(motion[key]) for key in ("position", "velocity"))),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
