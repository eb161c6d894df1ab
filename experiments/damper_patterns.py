"""How do the particles move in a shaken container, by automaton and by spheres?

The pictures show 20 and 40 particles over one cycle of a container that is driven by +-4 cells (24
mm) at 6 Hz (Komatsuzaki et al., Figs. 9 and 10). Expect the floor to throw the particles up, and to
catch them again. Those of the automaton move further than the spheres, as its ceiling takes down a
whole cluster when one particle touches it, and up to a tenth of a cycle earlier.

    python experiments/damper_patterns.py
    python experiments/damper_patterns.py --amplitude 10 --accounting landing

Writes patterns_20.png, patterns_40.png, cycle.png, patterns.gif, cycles.csv, particles.csv and
summary.json to results/damper_patterns/.
"""

import sys
from types import SimpleNamespace

import numpy as np

from ca_damper import Automaton, Batch, Paper, SceneTable, Spheres, film
from ca_damper.automaton import ACCOUNTINGS
from ca_damper.plot.boxes import BoxSize, animate_films, picture_film_strips
from ca_damper.plot.curves import FilmMeasures, picture_cycle
from ca_damper.report.progress import Stages
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_patterns"
SETTINGS = {
    "amplitude": (24.0, 24.0, study.number(0, 100), "amplitude of the container [mm], default 24"),
    "frequency": (6.0, 6.0, study.number(0.5, 100), "frequency [Hz], default 6"),
    "dt": (2e-5, 2e-5, study.number(0, 1), "step of the spheres [s], default 2e-5"),
    "seeds": (5, 2, study.whole(1, 100), "number of starts averaged, default 5"),
    "transient": (30, 5),
    "cycles": (4, 1),
}
PARTICLES, TITLES = (20, 40), {"ca": "automaton", "dem": "spheres"}
#: Frames a cycle of the animation and the measures; the pictures show every fourth.
FRAMES, SHOWN = 32, 4
#: Step of the automaton [s].
CA_DT = 1e-4
TABLE = study.Table(
    particles=("particles", "particles"),
    filling=(lambda one: TITLES[one.name], "filling"),
    height_amplitude_mm=(lambda one: one.swing[0], "swing [mm]", ".3g", "mm"),
    height_lag_deg=(lambda one: one.swing[1], "lag [deg]", ".3g", "deg"),
    height_above_floor_mm=("above", "above floor [mm]", ".3g", "mm"),
    floor_share_least=(lambda one: min(one.floor), "at floor, least", ".3g", "1"),
    floor_share_most=(lambda one: max(one.floor), "at floor, most", ".3g", "1"),
)


def options_parser():
    """Options of this experiment."""
    made = study.parser(NAME, __doc__, settings=SETTINGS)
    made.add_argument("--accounting", choices=ACCOUNTINGS, default="all", help="default all")
    return made


def run(options):
    """Shake both fillings, compare, picture."""
    automaton = Automaton(Paper(options.accounting))
    jobs = {"ca": (automaton, CA_DT), "dem": (Spheres(), options.dt)}
    scenes = (
        np.repeat(PARTICLES, options.seeds),
        np.tile(np.arange(options.seeds) + 1, len(PARTICLES)),
    )
    motion = 1e-3 * options.amplitude, options.frequency
    batches = {
        name: Batch(filling, SceneTable(*scenes, dt, motion[1], motion[0]), mount="base")
        for name, (filling, dt) in jobs.items()
    }
    folder, runs = study.begin(options), []
    steps = int(batches["ca"].steps_per_cycle[0])
    # Whole steps miss even spacing by a trifle.
    phase = np.arange(FRAMES) * (steps // FRAMES) / steps
    for name, batch in batches.items():
        with ProgressBar(TITLES[name]) as progress:
            films, box = shake(batch, options, progress), BoxSize.of(batch.filling)
        runs += [run_of(name, n, batch.filling.label, box, films[n], phase) for n in PARTICLES]
    runs.sort(key=lambda one: one.particles)
    picture_all(folder, runs, motion)
    write_tables(folder, runs, options.seeds)
    rows, figures = compared(runs)
    print("Mean height of the particles over one cycle")
    TABLE.show(rows)
    study.finish(options, NAME, figures, batches.values())


def shake(batch, options, progress):
    """Shake the container, then film cycles: their frames, of all seeds, by number of particles."""
    batch.start()
    transient, cycles = options.transient, options.cycles
    tell = Stages(progress, np.arange(transient, transient + cycles + 1) / (transient + cycles))
    batch.run(transient, 0, tell)
    steps, frames = int(batch.steps_per_cycle[0]), {particles: [] for particles in PARTICLES}
    for _ in range(cycles):
        every = {"sample_every": steps, "frame_every": steps // FRAMES}
        shot = film(batch, steps, **every, progress=tell)
        for particles, cycle in zip(batch.table.column("particles").tolist(), shot.frames):
            frames[particles].append(cycle[:FRAMES])
    return frames


def run_of(name, particles, label, box, cycles, phase):
    """A subject of ``TABLE``: the films of a filling with a number of particles, measured."""
    measures = FilmMeasures.of(box, cycles, phase)
    told = {"swing": measures.swing(), "floor": measures.floor.mean(axis=0).tolist()}
    told["above"] = float(measures.above_floor_mm.mean())
    kept = {"label": label, "box": box, "cycles": cycles, "measures": measures}
    return SimpleNamespace(name=name, particles=particles, **kept, **told)


def compared(runs):
    """Rows of heights and lags of the particles by filling; all figures, with the differences."""
    rows, figures = TABLE.rows(runs), {}
    for ca, dem, *pair in zip(runs[::2], runs[1::2], rows[::2], rows[1::2]):
        for one, row in zip((ca, dem), pair):
            figures.update(TABLE.figures(row, f"{{key}}_{one.name}_N{one.particles}"))
        turn = (ca.swing[1] - dem.swing[1] + 180.0) % 360.0 - 180.0
        apart = ca.measures.mean_height_mm - dem.measures.mean_height_mm
        rms = float(np.sqrt((apart**2).mean()))
        figures[f"amplitude_difference_mm_N{ca.particles}"] = (ca.swing[0] - dem.swing[0], "mm")
        figures[f"lag_difference_deg_N{ca.particles}"] = turn, "deg"
        figures[f"height_difference_mm_N{ca.particles}"] = rms, "mm"
    return rows, figures


def write_tables(folder, runs, seeds):
    """The measures of every frame, and the places of all particles in the first cycle."""
    frames, places = [], []
    for one in runs:
        key, (phase, *columns) = (one.particles, one.name), vars(one.measures).values()
        for row, k in np.ndindex(len(one.cycles), FRAMES):
            start = row % seeds + 1, row // seeds, phase[k], 1e3 * one.cycles[row][k].x
            frames.append((*key, *start, *(values[row, k] for values in columns)))
        for k, frame in enumerate(one.cycles[0]):
            for place, velocity in zip(1e3 * frame.position, frame.velocity):
                places.append((*key, phase[k], *place, *velocity))
    names = "particles filling seed cycle phase container_mm height_mm above_floor_mm floor ceiling"
    study.write_rows(folder / "cycles.csv", frames, names)
    names = "particles filling phase across_mm up_mm across_m_s up_m_s"
    study.write_rows(folder / "particles.csv", places, names)


def picture_all(folder, runs, motion):
    """A picture of frames for each number of particles, an animation, curves over the cycle."""
    moving, measures = {}, {}
    for particles in PARTICLES:
        own = [one for one in runs if one.particles == particles]
        strips = {one.label: (one.box, one.cycles[0][::SHOWN]) for one in own}
        picture_film_strips(folder / f"patterns_{particles}.png", strips, *motion)
        measures[f"{particles} particles"] = {one.label: one.measures for one in own}
        for one in own:
            title = styles_of([one.label])[one.label].label.replace(", ", ",\n")
            moving[f"{title}\n{particles} particles"] = one.box, one.cycles[0]
    animate_films(folder / "patterns.gif", moving, *motion)
    picture_cycle(folder / "cycle.png", measures, 1e3 * motion[0])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
