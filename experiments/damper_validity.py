"""Where does the automaton agree with spheres and with exact solutions, and where not?

Each case has a reference, exact or by the spheres: the motion of grains in a container that throws
them, the impact damper, loss and apparent mass at small amplitudes, the plug that grains form
without gravity, the peaks of the damped structure, and whether a motion lasts. Each is run with the
rules of the paper and with those of place. Expect the rules of place to lie within the wanted range
in every row. The picture shows where to trust either, over acceleration, frequency and filling, by
the difference of the impedance from that of the spheres. A quick run leaves out the peaks of the
structure and the motion of few grains.

    python experiments/damper_validity.py                 # about five minutes on two cores
    python experiments/damper_validity.py --quick

Writes trust.png, validity.csv, trust.csv, validity.md and summary.json to
results/damper_validity/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

from _damper_validity import FILLINGS, JUMP, PARTS, Effort, trust_of
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_validity"
SETTINGS = {
    "seeds": (16, 4, study.whole(1, 1000), "number of starts averaged, default 16"),
    "transient": (150, 25),
    "cycles": (20, 6),
    "long": (2000, 200),
    # Numbers of grains that swing, cycles of them that are filmed; those whose peaks are sought.
    "swings": ((40, 20, 5), (40,)),
    "filmed": (8, 4),
    "peaks": ((30, 50), ()),
    "jump": (JUMP, JUMP[::2]),
    "frequencies": ([4.0, 6.0, 10.0, 16.0, 25.0, 40.0, 64.0], [6.0, 50.0]),
    "accelerations": ([0.8, 1.2, 1.5, 2.0, 3.0, 5.0, 8.0], [1.5, 3.0]),
    "grains": ([5, 10, 30, 50], [10, 30]),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Shares at which the colours of the picture change.
SHADES = (0.0, 0.05, 0.1, 0.2, 0.4, 1.0)
HEADER = ("case", "spheres or exact", "paper", "place", "wanted", "met")


def cells_of(row):
    """Cells of the printed table."""
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    wanted = f"{row['low']:.3g} to {row['high']:.3g}{unit}"
    numbers = [f"{row[name]:.3g}{unit}" for name in ("exact", "paper", "place")]
    return row["words"], *numbers, wanted, "yes" if row["met"] else "no"


def picture_trust(path, options, apart):
    """A panel for each number of grains and rules: percent of difference, light is good."""
    axes_of = {"x": options.frequencies, "y": options.accelerations}
    shape = {"size": (2.1 * len(options.grains) + 0.8, 6.4), "squeeze": False, "sharex": True}
    with picture(path, 2, len(options.grains), sharey=True, **shape) as (figure, panels):
        for row, name in zip(panels, ("paper", "place")):
            label = FILLINGS[name][0].label
            row[0].set_ylabel(f"{styles_of([label])[label].label}\nacceleration [g]")
            for axes, count in zip(row, options.grains):
                shade(axes, apart[count, name])
                axes.set_title(f"{count} grains")
                for axis, values in axes_of.items():
                    ticks = {f"{axis}ticks": range(len(values))}
                    axes.set(**ticks, **{f"{axis}ticklabels": [f"{one:g}" for one in values]})
        for axes in panels[-1]:
            axes.set_xlabel("frequency [Hz]")
        figure.suptitle("Difference of the impedance from that of spheres [%]")


def shade(axes, shares):
    """Cells of a map with their percent; white below 5 %, darker in steps."""
    level = np.digitize(shares, SHADES[1:])
    axes.imshow(level, cmap="YlOrRd", vmin=0, vmax=len(SHADES), origin="lower", aspect="auto")
    for (i, j), share in np.ndenumerate(shares):
        colour = "white" if level[i, j] > 0.6 * len(SHADES) else BLACK
        look = {"ha": "center", "va": "center", "fontsize": 8.5, "color": colour}
        axes.text(j, i, f"{100.0 * min(share, 9.99):.0f}", **look)
    axes.grid(False)


def run(options):
    """Measure all rows and the map; write the table and the picture."""
    folder, rows = study.begin(options), []
    effort = Effort(options.seeds, options.transient, options.cycles, [])
    with ProgressBar("rows and map") as progress:
        for k, part in enumerate(PARTS):
            progress.at(k / (len(PARTS) + 1))
            rows += part(options, effort)
        apart = trust_of(options, effort)
    cells = [cells_of(row) for row in rows]
    study.print_table(cells, HEADER)
    pd.DataFrame(rows).to_csv(folder / "validity.csv", index=False)
    write_text(folder / "validity.md", study.markdown_of(HEADER, cells))
    names = pd.MultiIndex.from_product(
        [options.accelerations, options.frequencies], names=["acceleration_g", "frequency_Hz"]
    )
    maps = {key: pd.Series(shares.ravel(), names) for key, shares in apart.items()}
    table = pd.concat(maps, names=["particles", "rules"]).rename("impedance_difference")
    table.to_csv(folder / "trust.csv")
    picture_trust(folder / "trust.png", options, apart)
    ends = {"": "place", "_exact": "exact", "_paper": "paper"}
    ends.update({"_wanted_low": "low", "_wanted_high": "high"})
    figures = {
        f"{row['key']}{end}": (row[name], row["unit"]) for row in rows for end, name in ends.items()
    }
    figures["rows_met"], figures["rows"] = (sum(row["met"] for row in rows), "1"), (len(rows), "1")
    for name in ("paper", "place"):
        shares = np.concatenate([one.ravel() for (_, rules), one in apart.items() if rules == name])
        figures[f"trusted_share_{name}"] = float((shares < 0.2).mean()), "1"
    study.finish(options, NAME, figures, effort.made)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
