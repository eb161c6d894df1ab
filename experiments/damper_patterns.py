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

import itertools
import os
import sys

import numpy as np

from ca_damper import Automaton, Batch, SceneTable, Spheres, film
from ca_damper.automaton import ACCOUNTINGS
from ca_damper.measures import first_harmonic
from ca_damper.plot import Box, animate_films, picture_film_strips
from ca_damper.progress import Stages
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import BLACK, GREY, area_key, line_key, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, number, parser, show_rows, whole, write_rows

NAME = "damper_patterns"
QUICK, FULL = {"transient": 5, "cycles": 1, "seeds": 2}, {"transient": 30, "cycles": 4, "seeds": 5}
PARTICLES, TITLES = (20, 40), {"ca": "automaton", "dem": "spheres"}
KEYS = list(itertools.product(PARTICLES, TITLES))
#: Frames a cycle of the animation and the measures; the pictures show every fourth.
FRAMES, SHOWN = 32, 4
#: Step of the automaton [s], and steps of the spheres within one.
CA_DT, STEPS_IN_ONE = 1e-4, 5
#: Figure of summary.json by filling and particles: column of the table, unit.
COLUMNS = {
    "height_amplitude_mm": ("swing [mm]", "mm"),
    "height_lag_deg": ("lag [deg]", "deg"),
    "height_above_floor_mm": ("above floor [mm]", "mm"),
    "floor_share_least": ("at floor, least", "1"),
    "floor_share_most": ("at floor, most", "1"),
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
    settings, swing = QUICK if options.quick else FULL, 1e-3 * options.amplitude
    seeds = options.seeds or settings["seeds"]
    jobs = {"ca": (Automaton(accounting=options.accounting), CA_DT)}
    jobs["dem"] = Spheres(), options.dt or CA_DT / STEPS_IN_ONE
    scenes = np.repeat(PARTICLES, seeds), np.tile(np.arange(seeds) + 1, len(PARTICLES))
    batches = {
        name: Batch(filling, SceneTable(*scenes, dt, options.frequency, swing), mount="base")
        for name, (filling, dt) in jobs.items()
    }
    output_folder(options.out)
    films, measures = {}, {}
    for name, batch in batches.items():
        with ProgressBar(TITLES[name]) as progress:
            frames = shake(batch, settings, progress)
        for particles in PARTICLES:
            films[particles, name] = frames[particles]
            measures[particles, name] = measured(Box.of(batch.filling), frames[particles])
    steps = int(batches["ca"].steps_per_cycle[0])
    # Whole steps miss even spacing by a trifle.
    phase = np.arange(FRAMES) * (steps // FRAMES) / steps
    picture_all(options, {name: batch.filling for name, batch in batches.items()}, films)
    plot_cycle(os.path.join(options.out, "cycle.png"), phase, measures, batches, options.amplitude)
    write_tables(films, measures, phase, seeds, options.out)
    rows, figures = compared(measures, phase)
    print("Mean height of the particles over one cycle")
    shown = {words: (key, ".3g") for key, (words, _) in COLUMNS.items()}
    show_rows(rows, {"particles": ("particles", ""), "filling": ("filling", ""), **shown})
    finish(options, NAME, figures, batches.values(), show=False)


def shake(batch, settings, progress):
    """Shake the container, then film cycles: their frames, of all seeds, by number of particles."""
    batch.start()
    transient, cycles = settings["transient"], settings["cycles"]
    tell = Stages(progress, np.arange(transient, transient + cycles + 1) / (transient + cycles))
    batch.run(transient, 0, tell)
    steps, frames = int(batch.steps_per_cycle[0]), {particles: [] for particles in PARTICLES}
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
    for frame in itertools.chain(*cycles):
        below, above = box.gaps(frame.position)
        over = below.mean()
        heights = 1e3 * (box.lift(frame.x) + over), 1e3 * over
        rows.append((*heights, (below < near).mean(), (above < near).mean()))
    names = ("height_mm", "above_floor_mm", "floor", "ceiling")
    return dict(zip(names, np.array(rows).T.reshape(4, len(cycles), FRAMES)))


def compared(measures, phase):
    """Rows of heights and lags of the particles by filling; all figures, with the differences."""
    rows, figures = [], {}
    for particles in PARTICLES:
        cycles = {name: measures[particles, name]["height_mm"].mean(axis=0) for name in TITLES}
        swings = {name: first_harmonic(phase, cycle) for name, cycle in cycles.items()}
        for name, title in TITLES.items():
            one = measures[particles, name]
            floor, above = one["floor"].mean(axis=0).tolist(), float(one["above_floor_mm"].mean())
            values = dict(zip(COLUMNS, (*swings[name], above, min(floor), max(floor))))
            rows.append({"particles": particles, "filling": title, **values})
            for key, (_, unit) in COLUMNS.items():
                figures[f"{key}_{name}_N{particles}"] = figure(values[key], unit)
        (ca, late), (dem, later) = swings["ca"], swings["dem"]
        turn = (late - later + 180.0) % 360.0 - 180.0
        apart = float(np.sqrt(((cycles["ca"] - cycles["dem"]) ** 2).mean()))
        figures[f"amplitude_difference_mm_N{particles}"] = figure(ca - dem, "mm")
        figures[f"lag_difference_deg_N{particles}"] = figure(turn, "deg")
        figures[f"height_difference_mm_N{particles}"] = figure(apart, "mm")
    return rows, figures


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


def picture_all(options, fillings, films):
    """Frames of the first cycle: a picture for each number of particles, and an animation."""
    motion, moving = (1e-3 * options.amplitude, options.frequency), {}
    for particles in PARTICLES:
        strips = {}
        for name, filling in fillings.items():
            box, frames = Box.of(filling), films[particles, name][0]
            strips[filling.label] = box, frames[::SHOWN]
            title = styles_of([filling.label])[filling.label].label.replace(", ", ",\n")
            moving[f"{title}\n{particles} particles"] = box, frames
        path = os.path.join(options.out, f"patterns_{particles}.png")
        picture_film_strips(path, strips, *motion)
    animate_films(os.path.join(options.out, "patterns.gif"), moving, *motion)


def plot_cycle(path, phase, measures, batches, amplitude):
    """Mean height of the particles and how many touch floor and ceiling, over one closed cycle."""
    labels = {name: batch.filling.label for name, batch in batches.items()}
    styles, time = styles_of(labels.values()), np.linspace(0.0, 1.0, 200)
    shape = {"size": (4.2 * len(PARTICLES) + 0.6, 5.7), "sharex": True, "sharey": "row"}
    with picture(path, 2, len(PARTICLES), **shape) as (figure, panels):
        for top, bottom, particles in zip(*panels, PARTICLES):
            motion = amplitude * np.sin(2.0 * np.pi * time)
            top.plot(time, motion, color=GREY, linestyle=":", label="container")
            top.set_title(f"{particles} particles")
            for name, label in labels.items():
                draw_measures(top, bottom, phase, measures[particles, name], styles[label])
            bottom.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=len(keys))


def draw_measures(top, bottom, phase, one, style):
    """Curves of a filling: means over the cycles, and the spread of the height between them."""
    # The cycle is closed: it ends as it begins.
    closed = {name: np.append(values, values[:, :1], axis=1) for name, values in one.items()}
    phase = np.append(phase, 1.0)
    height, spread = closed["height_mm"].mean(axis=0), closed["height_mm"].std(axis=0)
    top.plot(phase, height, color=style.colour, label=style.label)
    band = {"color": style.colour, "alpha": 0.18, "linewidth": 0}
    top.fill_between(phase, height - spread, height + spread, **band)
    for end, line in (("floor", "-"), ("ceiling", "--")):
        share = 100.0 * closed[end].mean(axis=0)
        bottom.plot(phase, share, color=style.colour, linestyle=line)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
