"""How do the particles move in a shaken container, by automaton and by spheres?

20 and 40 particles over one cycle of a container that moves by +-4 cells (24 mm) at 6 Hz, whatever
the particles do (Komatsuzaki et al., Figs. 9 and 10). Expect particles that the floor throws up,
that come apart in the air and are caught again. The automaton's swing further than the spheres, as
its ceiling takes down a whole cluster when one particle of it touches, and up to a tenth of a
cycle earlier.

    python experiments/damper_patterns.py                  # about half a minute
    python experiments/damper_patterns.py --amplitude 10 --accounting landing

Writes patterns_20.png, patterns_40.png, cycle.png, patterns.gif, cycles.csv, particles.csv and
summary.json to results/damper_patterns/.
"""

import os
import sys

import numpy as np

import _patterns_pictures as pictures
from ca_damper import Automaton, Batch, SceneTable, Spheres, film
from ca_damper.automaton import ACCOUNTINGS
from ca_damper.plot import Box
from ca_damper.progress import Stages
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import (
    figure,
    finish,
    main,
    number,
    parser,
    print_table,
    whole,
    write_rows,
)

NAME = "damper_patterns"
QUICK = {"transient": 5, "cycles": 1, "seeds": 2}
FULL = {"transient": 30, "cycles": 4, "seeds": 5}
PARTICLES = (20, 40)
TITLES = {"ca": "automaton", "dem": "spheres"}
KEYS = [(particles, name) for particles in PARTICLES for name in TITLES]
#: Frames a cycle of the animation and the measures.
FRAMES = 32
#: Step of the automaton [s], and steps of the spheres within one.
CA_DT, STEPS_IN_ONE = 1e-4, 5
#: Figure of summary.json by filling and particles: column of the table.
COLUMNS = {
    "height_amplitude_mm": "swing [mm]",
    "height_lag_deg": "lag [deg]",
    "height_above_floor_mm": "above floor [mm]",
    "floor_share_least": "at floor, least",
    "floor_share_most": "at floor, most",
}


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--amplitude", type=number(0, 100), default=24.0, help="[mm], 24")
    made.add_argument("--frequency", type=number(0.5, 100), default=6.0, help="[Hz], 6")
    made.add_argument("--accounting", choices=ACCOUNTINGS, default="all", help="all")
    made.add_argument("--dt", type=number(0, 1), help="spheres' step [s], 2e-5")
    made.add_argument("--seeds", type=whole(1, 100), help="starts that are averaged, 5")
    return made


def run(options):
    """Shake both fillings, compare, picture."""
    settings = QUICK if options.quick else FULL
    seeds = options.seeds or settings["seeds"]
    automaton, spheres = Automaton(accounting=options.accounting), Spheres()
    boxes = {"ca": Box.of_automaton(automaton), "dem": Box.of_spheres(spheres)}
    jobs = {"ca": (automaton, CA_DT), "dem": (spheres, options.dt or CA_DT / STEPS_IN_ONE)}
    batches = {name: shaken_batch(*job, seeds, options) for name, job in jobs.items()}
    output_folder(options.out)
    measures, films = {}, {}
    for name, batch in batches.items():
        with ProgressBar(TITLES[name]) as progress:
            frames = shake(batch, settings, progress)
        for particles, cycles in frames.items():
            measures[particles, name] = measured(boxes[name], cycles)
            films[particles, name] = cycles
    steps = int(batches["ca"].steps_per_cycle[0])
    # Whole steps miss even spacing by a trifle.
    phase = np.arange(FRAMES) * (steps // FRAMES) / steps
    labels = {name: batch.filling.label for name, batch in batches.items()}
    shown = {(n, labels[name]): (boxes[name], films[n, name][0]) for n, name in KEYS}
    curves = {(n, labels[name]): measures[n, name] for n, name in KEYS}
    pictures.draw_all(options.out, shown, curves, phase, options)
    write_tables(films, measures, phase, seeds, options.out)
    figures = figures_of(measures, phase)
    print_heights(figures)
    finish(options, NAME, figures, batches.values(), show=False)


def shaken_batch(filling, dt, seeds, options):
    """Batch of all numbers of particles and seeds; InputError for a step out of range."""
    particles, seed = np.repeat(PARTICLES, seeds), np.tile(np.arange(seeds) + 1, len(PARTICLES))
    table = SceneTable(particles, seed, dt, options.frequency, 1e-3 * options.amplitude)
    return Batch(filling, table, mount="base", measured_cycles=0)


def shake(batch, settings, progress):
    """Shake the container through a transient, then film some cycles; returns the frames."""
    batch.start()
    transient, cycles = settings["transient"], settings["cycles"]
    tell = Stages(progress, np.arange(transient, transient + cycles + 1) / (transient + cycles))
    batch.run(transient, 0, tell)
    steps = int(batch.steps_per_cycle[0])
    frames = {particles: [] for particles in PARTICLES}
    for _ in range(cycles):
        every = {"sample_every": steps, "frame_every": steps // FRAMES}
        shot = film(batch, steps, **every, progress=tell)
        for particles, cycle in zip(batch.table.column("particles").tolist(), shot.frames):
            frames[particles].append(cycle[:FRAMES])
    return frames


def measured(box, cycles):
    """Arrays (cycles of all seeds, frames) by name; heights [mm] and shares of the particles.

    height_mm: mean over the particles, in the room, less that of particles at rest on the floor of
    a container in its middle. above_floor_mm: the same over the container's floor. floor, ceiling:
    share of the particles less than half a diameter away from it.
    """
    rows, near = [], 0.5 * box.diameter
    for frame in (frame for cycle in cycles for frame in cycle):
        below, above = box.gaps(frame.position)
        over = below.mean()
        heights = 1e3 * (box.lift(frame.x) + over), 1e3 * over
        rows.append((*heights, (below < near).mean(), (above < near).mean()))
    names = ("height_mm", "above_floor_mm", "floor", "ceiling")
    return dict(zip(names, np.array(rows).T.reshape(4, len(cycles), FRAMES)))


def harmonic(phase, values):
    """Amplitude and lag [degrees] behind the container of a quantity over a cycle."""
    angle = 2.0 * np.pi * phase
    columns = np.column_stack([np.ones_like(angle), np.sin(angle), np.cos(angle)])
    _, sine, cosine = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.hypot(sine, cosine)), float(np.degrees(np.arctan2(-cosine, sine)))


def figures_of(measures, phase):
    """Heights and lags of the particles by filling, and how far the fillings differ."""
    figures, units = {}, ("mm", "deg", "mm", "1", "1")
    for particles in PARTICLES:
        fillings = {name: measures[particles, name] for name in TITLES}
        cycles = {name: one["height_mm"].mean(axis=0) for name, one in fillings.items()}
        swings = {name: harmonic(phase, cycle) for name, cycle in cycles.items()}
        for name, one in fillings.items():
            floor, above = one["floor"].mean(axis=0), one["above_floor_mm"].mean()
            values = (*swings[name], float(above), float(floor.min()), float(floor.max()))
            for key, value, unit in zip(COLUMNS, values, units):
                figures[f"{key}_{name}_N{particles}"] = figure(value, unit)
        (ca, late), (dem, later) = swings["ca"], swings["dem"]
        turn = (late - later + 180.0) % 360.0 - 180.0
        figures[f"amplitude_difference_mm_N{particles}"] = figure(ca - dem, "mm")
        figures[f"lag_difference_deg_N{particles}"] = figure(turn, "deg")
        apart = float(np.sqrt(((cycles["ca"] - cycles["dem"]) ** 2).mean()))
        figures[f"height_difference_mm_N{particles}"] = figure(apart, "mm")
    return figures


def write_tables(films, measures, phase, seeds, folder):
    """The measures of every frame, and the places of all particles in the first cycle."""
    frames, places = [], []
    for key in KEYS:
        one, cycles = measures[key], films[key]
        for row, k in np.ndindex(len(cycles), FRAMES):
            start = row % seeds + 1, row // seeds, phase[k], 1e3 * cycles[row][k].x
            frames.append((*key, *start, *(values[row, k] for values in one.values())))
        for k, frame in enumerate(cycles[0]):
            for place, velocity in zip(1e3 * frame.position, frame.velocity):
                places.append((*key, phase[k], *place, *velocity))
    names = f"particles filling seed cycle phase container_mm {' '.join(one)}"
    write_rows(os.path.join(folder, "cycles.csv"), frames, names)
    names = "particles filling phase across_mm up_mm across_m_s up_m_s"
    write_rows(os.path.join(folder, "particles.csv"), places, names)


def print_heights(figures):
    """Print the figures, a row each filling and number of particles."""
    rows = []
    for particles, name in KEYS:
        values = (figures[f"{key}_{name}_N{particles}"]["value"] for key in COLUMNS)
        rows.append((particles, TITLES[name], *(f"{value:.3g}" for value in values)))
    print("Mean height of the particles over one cycle")
    print_table(rows, ["particles", "filling", *COLUMNS.values()])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
