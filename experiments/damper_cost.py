"""What a cycle costs against the number of particles, and which step each filling bears (Fig. 12).

    python experiments/damper_cost.py          # about a minute
    python experiments/damper_cost.py --quick

Spheres by comparing all pairs, as in the paper, and by cells, at 2e-5 s; the automaton by a scan of
all cells, as in the paper, and by a list of particles, at the paper's 1e-4 s and at the spheres'
2e-5 s. CPU seconds of one core for one cycle of 6 Hz on the spring, median of repeats, compile time
apart. Then every filling is run at longer and longer steps until it refuses or diverges.
"""

import os
import sys
import time

from _cli import (
    figure,
    main,
    parser,
    print_figures,
    print_table,
    several,
    whole,
    write_summary,
)
from _timing import Timing
from ca_damper import Automaton, Batch, SceneTable, SimulationDiverged, Spheres
from ca_damper.plot.cost import picture_cost, picture_steps
from taichi_dem import InputError
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_cost"
FREQUENCY = 6.0
BASE_AMPLITUDE = 0.6e-3
#: Particles in the search for the longest step.
SOME = 50
FULL = {
    "particles": [1, 2, 5, 10, 20, 30, 40, 50, 60, 80, 100, 120, 140, 160],
    "repeats": 5,
    "seconds": 0.05,
    "cycles": 20,
}
QUICK = {"particles": [1, 10, 50, 160], "repeats": 3, "seconds": 0.01, "cycles": 3}
#: Steps tried for stability [s].
STEPS = (1e-5, 2e-5, 3e-5, 5e-5, 7e-5, 1e-4, 2e-4, 3e-4, 5e-4, 7e-4, 1e-3, 1.5e-3, 2e-3, 3e-3)
STEPS_OF_QUICK = (2e-5, 1e-4, 1e-3, 2e-3)


def variants():
    """What is compared: label, filling, step [s]."""
    list_, scan = Automaton(), Automaton(traversal="scan")
    return (
        ("dem_pairs", Spheres(search="all_pairs"), 2e-5),
        ("dem_cells", Spheres(), 2e-5),
        ("ca_scan_1e-4", scan, 1e-4),
        ("ca_list_1e-4", list_, 1e-4),
        ("ca_scan_2e-5", scan, 2e-5),
        ("ca_list_2e-5", list_, 2e-5),
    )


def options_parser():
    """Options of this experiment; times are of one thread."""
    made = parser(NAME, __doc__)
    made.set_defaults(threads=1)
    made.add_argument("--particles", type=several(whole(1, 160)), help="numbers, 1 to 160")
    made.add_argument("--repeats", type=whole(1, 1000), help="of every timing, 5")
    return made


def run(options):
    """Time all variants, find their longest steps, write tables and pictures."""
    for name, value in (QUICK if options.quick else FULL).items():
        if getattr(options, name, None) is None:
            setattr(options, name, value)
    output_folder(options.out)
    started = time.perf_counter()
    costs = time_all(options)
    borne = find_steps(STEPS_OF_QUICK if options.quick else STEPS, options.cycles)
    write_tables(costs, borne, options)
    picture_cost(os.path.join(options.out, "cost.png"), options.particles, costs)
    picture_steps(os.path.join(options.out, "steps.png"), borne)
    figures = figures_of(costs, borne, options)
    seconds = time.perf_counter() - started
    compiling = sum(cost["compile_s"] for cost in costs.values())
    write_summary(
        options.out, NAME, figures, compile_seconds=compiling, run_seconds=seconds - compiling
    )
    print_costs(costs, options.particles)
    print()
    print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


def time_all(options):
    """CPU seconds a cycle: {label: {"timings": a Timing for each N, "steps", "compile_s"}}."""
    costs, done = {}, 0
    total = len(variants()) * len(options.particles)
    with ProgressBar("timing") as bar:
        for label, filling, dt in variants():
            batch = scenes(filling, options.particles, dt)
            steps = int(batch.steps_per_cycle[0])
            batch.advance(steps)
            timings = []
            for k in range(len(options.particles)):
                timings.append(time_cycle(batch, k, options))
                done += 1
                bar.count(done, total)
            costs[label] = {"timings": timings, "steps": steps}
            costs[label]["compile_s"] = batch.compile_seconds
    return costs


def scenes(filling, particles, dt):
    """A batch of scenes near resonance, started; particles or dt may be several."""
    batch = Batch(filling, SceneTable(particles, 1, dt, FREQUENCY, BASE_AMPLITUDE))
    # Swinging fully from the first cycle, so that the particles fly from then on.
    batch.start("empty")
    return batch


def cpu_seconds(batch, scene, cycles):
    """CPU time of some cycles of one scene [s]; the others stand."""
    steps = [0] * batch.count
    steps[scene] = cycles * int(batch.steps_per_cycle[scene])
    start = time.process_time()
    batch.advance(steps)
    return time.process_time() - start


def time_cycle(batch, scene, options):
    """Timing of a cycle of a scene in CPU seconds; at a time as many as fill a moment."""
    cycles = 1 + int(options.seconds / max(cpu_seconds(batch, scene, 1), 1e-6))
    return Timing.of([cpu_seconds(batch, scene, cycles) / cycles for _ in range(options.repeats)])


def find_steps(steps, cycles):
    """What becomes of 50 particles at each step: {label: [(dt, outcome)]}."""
    fillings = (Spheres(), Automaton(), Automaton(accounting="landing"))
    return {filling.label: outcomes(filling, steps, cycles) for filling in fillings}


def outcomes(filling, steps, cycles):
    """(dt, "runs" | "diverges" | "refused") for every step."""
    allowed = [dt for dt in steps if not refused(filling, dt)]
    found = [(dt, "refused") for dt in steps if dt not in allowed]
    while allowed:
        # A batch that holds a diverged scene goes no further: the rest gets one of its own.
        batch = scenes(filling, SOME, allowed)
        for k in range(batch.count):
            dt = allowed.pop(0)
            try:
                cpu_seconds(batch, k, cycles)
                found.append((dt, "runs"))
            except SimulationDiverged:
                found.append((dt, "diverges"))
                break
    return sorted(found)


def refused(filling, dt):
    """Whether a filling refuses a step."""
    try:
        filling.check(SOME, dt)
    except InputError:
        return True
    return False


def write_tables(costs, borne, options):
    """CSV of all timings, and of the steps tried."""
    rows = {name: [] for name in ("variant", "particles", "steps", "cpu_s", "low_s", "high_s")}
    for label, cost in costs.items():
        for particles, timing in zip(options.particles, cost["timings"]):
            row = (label, particles, cost["steps"], timing.median, timing.low, timing.high)
            for name, value in zip(rows, row):
                rows[name].append(value)
    write_csv(os.path.join(options.out, "cost.csv"), rows)
    tried = [(label, dt, word) for label, found in borne.items() for dt, word in found]
    names = ("filling", "dt_s", "outcome")
    write_csv(os.path.join(options.out, "steps.csv"), dict(zip(names, zip(*tried))))


def figures_of(costs, borne, options):
    """Seconds a cycle at 50 particles, rates, growth from fewest to most, longest steps."""
    figures = {}
    some = min(options.particles, key=lambda n: abs(n - SOME))
    place = options.particles.index(some)
    for label, cost in costs.items():
        seconds = [timing.median for timing in cost["timings"]]
        figures[f"cycle_ms_{label}_N{some}"] = figure(1e3 * seconds[place], "ms")
        rate = 1e-6 * some * cost["steps"] / seconds[place]
        figures[f"particle_steps_{label}_N{some}"] = figure(rate, "million/s")
        figures[f"growth_{label}"] = figure(seconds[-1] / seconds[0], "1")
    for label, found in borne.items():
        running = [dt for dt, word in found if word == "runs"]
        figures[f"longest_step_{label}"] = figure(max(running, default=None), "s")
    return figures


def print_costs(costs, particles):
    """Milliseconds a cycle."""
    rows = [
        (n, *(f"{1e3 * cost['timings'][k].median:.3g}" for cost in costs.values()))
        for k, n in enumerate(particles)
    ]
    print("CPU milliseconds a cycle")
    print_table(rows, ["N", *costs])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
