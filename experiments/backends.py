"""How many steps a second, on each device of this machine, and what bounds them?

Five scenes from the worst to the easiest: free bodies pressed together, a block that falls to
pieces, one that only might, one without contact, one without contact by explicit steps. Each runs
on one CPU thread, on all, and on each GPU back end found here, at growing size. A step moves at
least some bytes, each number once; copies of a large array, measured in the same run, say how long
that must take.

    make bench                              # after the bench; writes docs/bench.md
    python experiments/backends.py --quick

Rates are of the clock, medians of n timings with the 95 % interval of the median. Equal digests are
equal bits of all bodies. Mesa's lavapipe, a Vulkan driver that runs on the CPU, is slow and refuses
large scenes.

Writes backends.png, backends.csv and summary.json to results/backends/.
"""

import re
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import taichi as ti

from cases.blast import paper_effects
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.kit import backend, runtime, study
from taichi_dem.kit.allocation import values
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, RED, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.timing import median_interval
from taichi_dem.mesh.shapes import bar, in_space_order

NAME = "backends"
#: Edge of a box [m]; steps with dashpots solved and without [s]; strain rates [1/s].
BOX, SOLVED, LIMITED, PRESSED, TORN = 0.05, 4e-7, 1e-7, 100.0, 100.0
WORDS = {
    "rubble": "free bodies, pressed together",
    "breaking": "a block that falls to pieces",
    "contact": "a block struck by gas",
    "solved": "the same without contact",
    "bonds": "the same, explicit steps",
}
#: Colour and words of a place; marker of a scene.
LOOK = {
    "cpu 1": (RED, "CPU, one thread"),
    "cpu": (BLACK, "CPU, all threads"),
    "vulkan": (BLUE, "Vulkan"),
    "cuda": (GREEN, "CUDA"),
}
MARKS = dict(zip(WORDS, "v^so*"))
SETTINGS = {
    # Bars of 2k x k x k boxes of six tetrahedra.
    "sizes": ((4, 9, 20), (2, 3), study.several(study.whole(1, 60)), "boxes along a width"),
    "places": (None, ["cpu 1", "cpu"], study.several(study.one_of(LOOK)), "devices; default all"),
    "scenes": ([*WORDS], ["contact", "bonds"], study.several(study.one_of(WORDS)), "by comma"),
    "updates": (1e6, 2e4, study.number(1.0, 1e12), "bodies advanced in one timing"),
    "repeats": (7, 1, study.whole(1, 100), "timings, default 7"),
}
TABLE = study.Table(
    scene=("scene", "scene"),
    bodies=("bodies", "bodies", ","),
    place=("place", "place"),
    steps_per_s=("rate", "steps/s", ".3g"),
    low=("low", "from", ".3g"),
    high=("high", "to", ".3g"),
    timings=("n", "n"),
    evaluations=("evaluations", "M evaluations/s", ".3g"),
    bytes_a_step=("megabytes", "MB/step", ".3g"),
    share_of_copy=("share", "of copy", ".2f"),
    broken=("broken", "broken", ","),
    digest=("digest", "digest"),
)
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
#: A pair reads place, turn, velocity, spin, inverse inertia and mass of two bodies: 40 numbers.
PAIR_BYTES = 8 + 8 * 40
#: Numbers of an array far beyond every cache, numbers that one instruction may take, and copies.
LARGE, LANES, COPIES = 1 << 24, 8, 5


def options_parser():
    """Options of this script."""
    made = study.parser(NAME, __doc__, settings=SETTINGS)
    made.add_argument("--page", help="page of Markdown whose table is renewed")
    return made


def places():
    """Name, architecture and threads of what kernels can run on here."""
    cores = runtime.usable_cores()
    named = [("cpu 1", "cpu", 1), *([("cpu", "cpu", cores)] if cores > 1 else [])]
    return [*named, *((name, name, 1) for name in backend.GPUS if backend.is_present(name))]


def bench_scene(name, size):
    """A scene of so many boxes along its width, and the method of its steps."""
    mesh = in_space_order(bar(2 * BOX * size, BOX * size, (2 * size, size, size)))
    gas = effects.GasPressure(group="left")
    if name == "rubble":
        corners = mesh.points[mesh.tetrahedra]
        mesh = checked_mesh(
            corners.reshape(-1, 3),
            np.arange(4 * len(corners)).reshape(-1, 4),
            {},
            keep_coincident=True,
        )
    if name in ("rubble", "breaking"):
        rate = -PRESSED if name == "rubble" else TORN
        scene = Scene(mesh, CONCRETE, "auto", velocity=lambda x: rate * (x - x.mean(axis=0)))
    elif name == "contact":
        scene = Scene(mesh, CONCRETE, "auto", loads=[gas])
    else:
        alone = ("bond_damping", "softening", "shear_slip")
        scene = Scene(mesh, CONCRETE, [*(e for e in paper_effects() if e.name in alone), gas])
    return scene, Uniform(LIMITED, dashpot="limited") if name == "bonds" else ImplicitDashpots(
        SOLVED
    )


def measured(place, name, size, options):
    """A row of the table: a scene of a size at a place."""
    label, arch, threads = place
    job = {"name": name, "size": size, "updates": options.updates, "repeats": options.repeats}
    title = f"on {threads} threads of {arch}"
    row = study.call_in_process(whole_steps, arch=arch, threads=threads, title=title, **job)
    rate, low, high = median_interval([1.0 / seconds for seconds in row["seconds"]])
    return SimpleNamespace(
        scene=name,
        place=label,
        rate=rate,
        low=low,
        high=high,
        n=options.repeats,
        evaluations=1e-6 * rate * row["evaluations"],
        megabytes=1e-6 * row["bytes"],
        share=rate * row["bytes"] / row["bandwidth"],
        **{key: row[key] for key in ("bodies", "broken", "digest", "bandwidth")},
    )


def whole_steps(name, size, updates, repeats):
    """Whole steps of a scene by the parallel driver, some to warm up; for a JSON file.

    seconds: of a step, one a repeat. bytes, evaluations: of a step, the least bytes. bandwidth: of
    memory [B/s].
    """
    scene, method = bench_scene(name, size)
    simulation = Simulation(scene, method, "parallel")
    model = simulation.model
    steps = max(1, int(updates / model.body_count))
    simulation.advance_to(steps)
    seconds, counts = [], counts_of(simulation)
    for k in range(repeats):
        started = time.perf_counter()
        simulation.advance_to((k + 2) * steps)
        seconds.append((time.perf_counter() - started) / steps)
    laws, visits, pairs = (counts_of(simulation) - counts) / (steps * repeats)
    # An evaluated bond stands for its share of a step of all bodies.
    moved = bytes_a_step(simulation.engine) * laws / max(1, model.bond_count)
    moved += VISIT_BYTES * visits + bytes_of_pair(simulation.engine) * pairs
    motion = simulation.state.motion()
    return {
        **{"seconds": seconds, "bodies": model.body_count, "bytes": moved},
        **{"evaluations": laws + visits + pairs, "bandwidth": bandwidth()},
        **{"broken": simulation.report().broken_faces, "digest": digest(*motion.values())[:8]},
    }


def bytes_a_step(engine):
    """Least bytes that a step of all bodies and bonds moves, each number once."""
    parts = FieldMemory(engine.tables, "constant"), FieldMemory(engine.state, "saved")
    fields = {name: field for part in parts for name, field in part.fields.items()}
    laws = [name for name in fields if name.startswith("tables.bond.")]
    moved = [*WRITTEN, *WRITTEN, *READ, *laws]
    return sum(engine.values(fields[name]).nbytes for name in moved if name in fields)


def bytes_of_pair(engine):
    """Least bytes that a visit of a near pair moves: bodies, its row, pending impulses."""
    if engine.contacts is None:
        return 0
    store = engine.contacts.store
    row = [*store.columns.members, store.impulse, store.impulse, store.heat]
    return PAIR_BYTES + 2 * sum(values(field, slice(1)).nbytes for field in row)


def counts_of(simulation):
    """Numbers since the start: evaluated laws of bonds, visits of bonds in sweeps, pairs."""
    counts = simulation.values(simulation.schedule.evaluations).tolist()
    # Those of the third count are both.
    return np.array([counts[5], counts[2] - counts[5], counts[3]])


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


def draw(path, rows):
    """Roofline: bytes moved a second over bodies, under the bandwidth of each place."""
    with picture(path, 1, 1, size=(7.2, 4.6)) as (_, axes):
        for place in dict.fromkeys(row.place for row in rows):
            colour, words = LOOK[place]
            own = [row for row in rows if row.place == place]
            roof = 1e-9 * max(row.bandwidth for row in own)
            axes.axhline(roof, color=colour, lw=0.8, ls="--", label=f"copies, {words}")
            for scene in dict.fromkeys(row.scene for row in own):
                some = [row for row in own if row.scene == scene]
                moved = [1e-3 * row.rate * row.megabytes for row in some]
                look = {"color": colour, "marker": MARKS[scene], "ms": 5, "lw": 0.8}
                axes.plot([row.bodies for row in some], moved, **look)
        for scene in dict.fromkeys(row.scene for row in rows):
            axes.plot([], [], MARKS[scene], color=BLACK, label=WORDS[scene])
        axes.set(xscale="log", yscale="log", xlabel="bodies [1]", ylabel="least bytes moved [GB/s]")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def renewed(page, rows):
    """A page of Markdown with another table, and another first line that says where it is from."""
    table = study.markdown_of(*TABLE.cells(TABLE.rows(rows)))
    place = f"{study.processor()}, {runtime.usable_cores()} cores, {time.strftime('%d %B %Y')}"
    page = re.sub(r"(?m)^Measured on .*$", f"Measured on {place}:", page, count=1)
    return re.sub(r"(?m)(^\|.*\n)+", table, page, count=1)


def run(options):
    """Measure all places, one after the other; table, picture, figures."""
    at, rows = study.output_paths(options.out), []
    jobs = [
        (place, name, size)
        for name in options.scenes
        for size in options.sizes
        for place in places()
        if place[0] in (options.places or LOOK)
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
    draw(at("backends.png"), rows)
    if options.page:
        page = Path(options.page)
        page.write_text(renewed(page.read_text(encoding="utf-8"), rows), encoding="utf-8")
    figures = {}
    for row in rows:
        name = f"{row.place.replace(' ', '_')}_{row.scene}_{row.bodies}"
        figures[f"steps_per_s_{name}"] = row.rate, "1/s"
        figures[f"share_of_copy_{name}"] = row.share, "1"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
