"""What do grains take from a structure that a measured motion shakes?

The record of a CSV file shakes the container on its spring, empty and with more and more grains, by
the automaton and by spheres. The result is its motion relative to the base. The file in the
repository is synthetic, a small-scale earthquake by the formula in its header; give your own with
--record, with columns such as time_s and acceleration_m_s2. The damping ratio is that of a dashpot
that takes the same work as the grains, plus the structure's own. Expect 30 grains to double it and
to reduce the RMS by a quarter; after the strong part the filled container may swing more than the
empty one, as the resonance has shifted.

    python experiments/damper_measured_motion.py
    python experiments/damper_measured_motion.py --record my_road.csv --scale 0.5

Writes motion.png, damping.png, motion.csv, damping.csv and summary.json to
results/damper_measured_motion/.
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from ca_damper import Automaton, Empty, Spheres, excitation, shake
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, STYLES, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_measured_motion"
RECORD = Path(__file__).with_name("base_motion.csv")
SETTINGS = {
    "record": (str(RECORD), str(RECORD), str, "CSV file of the base's motion"),
    "scale": (1.0, 1.0, study.number(0, 1e6), "factor of the motion, default 1"),
    "particles": (
        *([5, 10, 20, 30, 40, 50], [10, 30]),
        *(study.several(study.whole(1, 160)), "numbers of grains, from 1 to 160"),
    ),
    "seeds": (6, 2, study.whole(1, 1000), "seeds of each number, default 6"),
}
#: Number of grains that the figures speak of, or the next one there is.
SHOWN = 30
FILLINGS = (Spheres(), Automaton())
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def picture_motion(path, made, shown):
    """Acceleration of the base, and motion of the container with and without grains."""
    empty, filled = made["empty"], {k: v for k, v in made.items() if k != "empty"}
    with picture(path, 3, 1, size=(8.6, 7.2), sharex=True) as (_, axes):
        base, time = empty.excitation.base, empty.time_s
        axes[0].plot(time, base.at(np.minimum(time, base.duration))[2], color=BLACK, lw=0.8)
        axes[0].set(ylabel="acceleration\nof the base [m/s²]")
        bare = {"color": STYLES["empty"].colour, "lw": 0.9, "label": STYLES["empty"].label}
        for axis, (label, history) in zip(axes[1:], filled.items()):
            style, k = styles_of(filled)[label], history.particles.index(shown)
            axis.plot(time, 1e3 * empty.relative[:, 0, 0], **bare)
            own = {"color": style.colour, "lw": 0.9, "label": f"{style.label}, {shown} particles"}
            axis.plot(time, 1e3 * history.relative[:, k, 0], **own)
            axis.set(ylabel="displacement from\nthe base [mm]")
            axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        axes[-1].set(xlabel="time [s]", xlim=(0.0, time[-1]))


def picture_damping(path, made):
    """RMS, peak and damping ratio over the number of particles; bars: range over the seeds."""
    empty, filled = made["empty"], {k: v for k, v in made.items() if k != "empty"}
    drawn = (
        ("RMS displacement from the base [mm]", lambda one: 1e3 * one.relative_rms),
        ("largest displacement from the base [mm]", lambda one: 1e3 * one.relative_peak),
        ("damping ratio [%]", lambda one: 1e2 * one.damping_ratio),
    )
    with picture(path, 1, 3, size=(9.2, 3.6)) as (figure, axes):
        for axis, (words, measure) in zip(axes, drawn):
            level = measure(empty)[0, 0]
            axis.axhline(level, color=STYLES["empty"].colour, ls=":", label=STYLES["empty"].label)
            for label, history in filled.items():
                style, values = styles_of(filled)[label], measure(history)
                middle = values.mean(axis=1)
                bars = [middle - values.min(axis=1), values.max(axis=1) - middle]
                look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.2}
                axis.errorbar(history.particles, middle, yerr=bars, label=style.label, **look)
            axis.set(xlabel="particles [1]", ylabel=words, ylim=(0.0, None))
        keys = axes[0].get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper left", ncols=3)


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
    empty, figures, tables = made["empty"], {}, []
    columns = {"time_s": empty.time_s, "base_m": empty.base}
    for label, history in made.items():
        number = 0 if label == "empty" else shown
        end, k = f"{label}_N{number}".removesuffix("_N0"), history.particles.index(number)
        columns[f"x_m_{end}"] = history.x[:, k, 0]
        values = {
            "rms_mm": 1e3 * history.relative_rms,
            "peak_mm": 1e3 * history.relative_peak,
            "damping_ratio": history.damping_ratio,
        }
        for name, one in values.items():
            unit = "1" if name == "damping_ratio" else "mm"
            figures[f"{name}_{end}"] = float(one[k].mean()), unit
        scenes = pd.MultiIndex.from_product([[label], history.particles, history.seeds])
        tables.append(pd.DataFrame({key: one.ravel() for key, one in values.items()}, scenes))
    write_csv(folder / "motion.csv", columns)
    names = ["filling", "particles", "seed"]
    pd.concat(tables).to_csv(folder / "damping.csv", index_label=names)
    picture_motion(folder / "motion.png", made, shown)
    picture_damping(folder / "damping.png", made)
    reports = [history.report for history in made.values()]
    study.finish(options, NAME, figures, reports, see="damping.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
