"""What do grains take from a structure that a measured motion shakes?

The container on its spring is shaken by the record of a CSV file, empty and with more and more
grains, by the automaton and by spheres; what is told is its motion on the base. The file in the
repository is synthetic, an earthquake at a small scale by the formula in its header; give your own
with --record, with columns such as time_s and acceleration_m_s2. The damping ratio is that of the
structure with a dashpot that takes the work which the grains took. Expect 30 grains to double it
and to take a quarter of the RMS; after the strong part the filled container may swing more than the
empty one, whose resonance lies elsewhere.

    python experiments/damper_measured_motion.py                # 15 seconds
    python experiments/damper_measured_motion.py --record my_road.csv --scale 0.5

Writes motion.png, damping.png, motion.csv, damping.csv and summary.json to
results/damper_measured_motion/.
"""

import sys
from functools import partial

import numpy as np

from _measured_motion import RECORD, picture_damping, picture_motion
from ca_damper import Automaton, Empty, Spheres, excitation, shake
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_measured_motion"
SETTINGS = {
    "record": (str(RECORD), str(RECORD), str, "CSV file of the base's motion"),
    "scale": (1.0, 1.0, study.number(0, 1e6), "factor of the motion, 1"),
    "particles": (
        *([5, 10, 20, 30, 40, 50], [10, 30]),
        *(study.several(study.whole(1, 160)), "numbers of grains, 1 to 160"),
    ),
    "seeds": (6, 2, study.whole(1, 1000), "of each, 6"),
}
#: Number of grains that the figures speak of, or the next one there is.
SHOWN = 30
FILLINGS = (Spheres(), Automaton())
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def run(options):
    """Shake all fillings, compare, picture."""
    motion = excitation.from_csv(options.record, correct_baseline=True).scaled(options.scale)
    folder = study.begin(options)
    made = {"empty": shake(Empty(), motion, particles=0, seeds=1, progress=None)}
    for filling in FILLINGS:
        with ProgressBar(filling.label) as progress:
            few = {"particles": options.particles, "seeds": options.seeds, "progress": progress}
            made[filling.label] = shake(filling, motion, **few)
    shown = min(options.particles, key=lambda number: abs(number - SHOWN))
    write_tables(folder, made, shown)
    picture_motion(folder / "motion.png", made, shown)
    picture_damping(folder / "damping.png", made)
    reports = [history.report for history in made.values()]
    study.finish(options, NAME, figures_of(made, shown), reports, see="damping.png")


def figures_of(made, shown):
    """RMS, peak and damping ratio: empty, and mean over the seeds at the number shown."""
    figures = {}
    for label, history in made.items():
        k = 0 if label == "empty" else history.particles.index(shown)
        end = label if label == "empty" else f"{label}_N{shown}"
        figures[f"rms_mm_{end}"] = (1e3 * float(history.relative_rms[k].mean()), "mm")
        figures[f"peak_mm_{end}"] = (1e3 * float(history.relative_peak[k].mean()), "mm")
        figures[f"damping_ratio_{end}"] = (float(history.damping_ratio[k].mean()), "1")
    return figures


def write_tables(folder, made, shown):
    """The motions of the first seed at the number shown, and a row a scene."""
    empty = made["empty"]
    columns = {"time_s": empty.time_s, "base_m": empty.base, "x_m_empty": empty.x[:, 0, 0]}
    rows = []
    for label, history in made.items():
        if label != "empty":
            k = history.particles.index(shown)
            columns[f"x_m_{label}_N{shown}"] = history.x[:, k, 0]
        ratios = history.damping_ratio
        for place in np.ndindex(history.rms.shape):
            number, seed = history.particles[place[0]], history.seeds[place[1]]
            values = history.relative_rms[place], history.relative_peak[place], ratios[place]
            rows.append((label, number, seed, *map(float, values)))
    write_csv(folder / "motion.csv", columns)
    study.write_rows(folder / "damping.csv", rows, "filling particles seed rms_m peak_m ratio")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
