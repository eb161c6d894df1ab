"""How many steps a second does each back end make, and what bounds them?

Bars of tetrahedra under gas pressure are stepped by three methods: on one CPU thread, on all CPU
threads, and on each GPU back end found here. Two lines bound the measured rates: the bytes of a
step at the bandwidth of memory, and the rate of the smallest scene, in which the device waits for
launches and for reads by the host.

    python experiments/backends.py           # minutes on a CPU and on a graphics card
    python experiments/backends.py --quick

Mesa's lavapipe, a Vulkan driver that runs on the CPU, is slow and refuses large scenes.

Writes backends.png, backends.csv and summary.json to results/backends/.
"""

import sys
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import taichi as ti

from cases.blast import METHODS as BLAST_METHODS
from cases.blast import paper_effects
from taichi_dem import CONCRETE, InputError, Scene, Simulation, effects, runtime
from taichi_dem.kit import backend, study
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, RED, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar, in_space_order

NAME = "backends"
METHODS = {
    "explicit_limited": "explicit, one step for all",
    "multirate_controlled": "explicit, a step for each",
    "implicit": "dashpots solved together",
}
#: Colour and words of a place.
LOOK = {
    "cpu 1": (RED, "CPU, one thread"),
    "cpu": (BLACK, "CPU, all threads"),
    "vulkan": (BLUE, "Vulkan"),
    "cuda": (GREEN, "CUDA"),
}
SETTINGS = {
    # Bars of 2k x k x k boxes of six tetrahedra.
    "sizes": ((4, 8, 13, 20), (2, 3), study.several(study.whole(1, 60)), "boxes along a width"),
    "places": (None, ["cpu 1", "cpu"], study.several(study.one_of(LOOK)), "devices; default all"),
    "methods": ([*METHODS], ["explicit_limited"], study.several(study.one_of(METHODS)), "by comma"),
    "steps": (20, 5, study.whole(1, 10_000), "steps in one timing, default 20"),
    "repeats": (3, 1, study.whole(1, 100), "timings, of which the fastest counts, default 3"),
}
TABLE = study.Table(
    place=("place", "place"),
    method=("method", "method"),
    bodies=("bodies", "bodies", ","),
    steps_per_s=("rate", "steps/s", ".3g"),
    floor_per_s=("floor", "by bytes", ".3g"),
)
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Edge of a box [m].
BOX = 0.05
#: What every step writes of bodies and bonds, and what it reads besides; also the laws of bonds.
WRITTEN = "slot position orientation velocity spin angular_momentum bond_drag".split()
READ = (
    *("bond_frame", "vertex_master", "vertex_slave", "bond_stiffness", "bond_slots", "bond_pair"),
    *("unit_area", "tables.dashpot.coefficient", "broken_tick"),
    *("mass_inverse", "inertia_inverse", "level", "last_tick"),
)
#: The visit of a bond in a sweep. It reads two numbers of bodies, the symmetric 6x6 block (21
#: numbers), the branch (3), the twist of the last visit (6), and of both bodies twist (6),
#: symmetric inverse inertia (6) and inverse mass (1). It writes the twist of the visit (6) and
#: those of both bodies (12): 74 numbers.
VISIT_BYTES = 8 + 8 * 74
#: Numbers of an array far beyond every cache, numbers that one instruction may take, and copies.
LARGE, LANES, COPIES = 1 << 24, 8, 5


def places():
    """Name, architecture and threads of what kernels can run on here."""
    cores = runtime.usable_cores()
    found = [("cpu 1", "cpu", 1), *([("cpu", "cpu", cores)] if cores > 1 else [])]
    return [*found, *((name, name, 1) for name in backend.GPUS if backend.is_present(name))]


def measured(place, method, size, options):
    """Steps a second of a bar at a place, and as many as the bytes of a step allow."""
    name, arch, threads = place
    job = {"method": method, "size": size, "steps": options.steps, "repeats": options.repeats}
    title = f"on {threads} threads of {arch}"
    found = study.call_in_process(whole_steps, arch=arch, threads=threads, title=title, **job)
    rate, bodies = 1.0 / min(found["seconds"]), found["bodies"]
    floor = found["bandwidth"] / found["bytes"]
    return SimpleNamespace(place=name, method=method, bodies=bodies, rate=rate, floor=floor)


def whole_steps(method, size, steps, repeats):
    """Whole steps of a bar by the parallel driver, two of them to warm up; for a JSON file.

    seconds: of a step, one a repeat. bytes: least ones of a step. bandwidth: of memory [B/s].
    """
    blown = [e for e in paper_effects() if e.name != "gas_pressure"]
    mesh = in_space_order(bar(2 * BOX * size, BOX * size, (2 * size, size, size)))
    scene = Scene(mesh, CONCRETE, [*blown, effects.GasPressure(group="left")])
    make, step = BLAST_METHODS[method]
    simulation = Simulation(scene, make(step), "parallel")
    simulation.advance_to(2)
    seconds, counts = [], counts_of(simulation)
    for k in range(repeats):
        started = time.perf_counter()
        simulation.advance_to(2 + (k + 1) * steps)
        seconds.append((time.perf_counter() - started) / steps)
    bonds, visits = (counts_of(simulation) - counts) / (steps * repeats)
    # An evaluated bond stands for its share of a step of all bodies.
    share, model = bytes_a_step(simulation.engine), simulation.model
    moved = share * bonds / model.bond_count + VISIT_BYTES * visits
    found = {"seconds": seconds, "bodies": model.body_count, "bytes": moved}
    return {**found, "bandwidth": bandwidth()}


def bytes_a_step(engine):
    """Least bytes that a step of all bodies and bonds moves, each number once."""
    parts = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    fields = {name: field for part in parts for name, field in part.fields.items()}
    laws = [name for name in fields if name.startswith("tables.bond.")]
    moved = [*WRITTEN, *WRITTEN, *READ, *laws]
    return sum(engine.values(fields[name]).nbytes for name in moved if name in fields)


def counts_of(simulation):
    """Numbers of evaluated bonds, and of visits of bonds in sweeps, since the start."""
    counts = simulation.values(simulation.schedule.evaluations).tolist()
    # Those of the third count are both.
    return np.array([counts[5], counts[2] - counts[5]])


def bandwidth():
    """Bytes a second that copies of a large array by all threads read and write, the best."""
    entries, lanes = int(min(LARGE, backend.most_entries())), 1 if study.on_device() else LANES
    a, b = (ti.Vector.field(lanes, ti.f64, shape=entries // lanes) for _ in range(2))
    seconds = []
    for _ in range(1 + COPIES):
        started = time.perf_counter()
        copy(a, b)
        ti.sync()
        seconds.append(time.perf_counter() - started)
    return 16.0 * entries / min(seconds[1:])


@ti.kernel
def copy(a: ti.template(), b: ti.template()):
    """Copy a field into another."""
    for k in a:
        b[k] = a[k]


def draw(path, rows, methods):
    """Steps a second over bodies, a panel a method, a colour a place."""
    with picture(path, 1, len(methods), size=(3.2 * len(methods) + 1.0, 4.2)) as (figure, panels):
        for axes, method in zip(panels if len(methods) > 1 else [panels], methods):
            for name in dict.fromkeys(row.place for row in rows):
                mine = [row for row in rows if (row.place, row.method) == (name, method)]
                if mine:
                    bodies = [row.bodies for row in mine]
                    colour, words = LOOK[name]
                    axes.plot(bodies, [row.rate for row in mine], "o-", color=colour, label=words)
                    axes.plot(bodies, [row.floor for row in mine], ":", color=colour)
                    axes.axhline(mine[0].rate, color=colour, lw=0.6, ls="--")
            axes.plot([], [], ":", color=GREY, label="bound by bytes")
            axes.plot([], [], "--", lw=0.6, color=GREY, label="rate of the smallest scene")
            axes.set(xscale="log", yscale="log", title=METHODS[method])
            axes.set(xlabel="bodies [1]", ylabel="steps a second [1/s]")
        figure.legend(
            *axes.get_legend_handles_labels(), loc="outside lower center", ncols=2 * len(methods)
        )


def run(options):
    """Measure all places, one after the other; table, picture, figures."""
    at, rows = study.output_paths(options.out), []
    jobs = [
        (place, method, size)
        for place in places()
        if place[0] in (options.places or LOOK)
        for method in options.methods
        for size in options.sizes
    ]
    if not jobs:
        raise InputError(f"places must have one that answers here, got {', '.join(options.places)}")
    with ProgressBar("places") as bar:
        for done, job in enumerate(jobs):
            bar.count(done, len(jobs))
            try:
                rows.append(measured(*job, options))
            except InputError as error:
                reason = str(error).splitlines()[-1]
                print(f"{job[0][0]}, {job[1]}, size {job[2]}: {reason}")
    study.write_rows(at("backends.csv"), TABLE.rows(rows))
    TABLE.show(TABLE.rows(rows))
    draw(at("backends.png"), rows, options.methods)
    figures = {}
    for row in rows:
        name = f"{row.place.replace(' ', '_')}_{row.method}_{row.bodies}"
        figures[f"steps_per_s_{name}"] = row.rate, "1/s"
        figures[f"share_of_floor_{name}"] = row.rate / row.floor, "1"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
