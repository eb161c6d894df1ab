"""Which measurements and solutions of others does the damper meet, and which does it miss?

One grain between walls has a closed form (Masri). A beam with 6 % of its mass in lead grains loses
half of its energy in a cycle (Friend and Kinra); grains that collect and collide can take 8 times
the mass ratio, 48 %. In boxes without a lid the apparent mass falls as acceleration to the -2, the
loss to the -1, whatever the width (Masmoudi et al., Ferreyra et al.). Fillings of one mass have one
response where the box leaves them room (Sanchez et al.). Rows are measured by the rules of place
and by spheres; a miss is printed as a miss. The optimum of clearance of the beam and the curves of
Saeki 2002 are drawn in papers that print no numbers, and are not compared.

In one case of Masri's, with 3 % above resonance, both fillings end from rest in an irregular motion
beside the periodic one. A box without a lid has a mass that turns negative at 3 g, so that few
points are left for its exponent.

    python experiments/damper_trust.py            # about five minutes on two cores
    python experiments/damper_trust.py --quick    # the rules of place alone

Writes trust.png, trust.csv, damper_trust.md and summary.json to results/damper_trust/.
"""

import sys
from functools import partial

import numpy as np

from _damper_trust import BEAM_CELLS, CASES, COLUMNS, EQUAL_MASS, FILLINGS, MASRI
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_trust"
SETTINGS = {
    "seeds": (2, 1, study.whole(1, 100), "of the maps, 2"),
    "cycles": (50, 10),
    "levels": (12, 6),
    "long": (400, 300),
    "grid": (MASRI, ((0.05,), (0.5,), (2,), MASRI[3])),
    "gaps": (BEAM_CELLS, (2, 4)),
    "columns": (COLUMNS, (3,)),
    "fillings": (((30, 0.75, 0.5), *EQUAL_MASS), EQUAL_MASS[1:3]),
    "by": (FILLINGS, FILLINGS[:1]),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
HEADER = ("case", "source", "published", "by", "ours", "wanted", "verdict")


def cells_of(label, row):
    """Cells of the printed table."""
    verdict = "holds" if row.low <= row.ours <= row.high else "misses"
    wanted = f"{row.low:g} to {row.high:g}"
    return row.words, row.source, row.published, label, f"{row.ours:.3g}", wanted, verdict


def draw(path, found):
    """Four panels, by the rules of place and by spheres."""
    with picture(path, 2, 2, (10.5, 8.4)) as (figure, axes):
        panels = dict(zip(CASES, axes.ravel()))
        for label, style in styles_of(found).items():
            look = {"color": style.colour, "marker": style.marker, "ms": 6}
            for name, axis in panels.items():
                DRAWINGS[name](axis, found[label][name][0].drawn, {**look, "label": style.label})
        ends = axes[0, 0].get_xlim()
        axes[0, 0].plot(ends, ends, color=BLACK, lw=1.0)
        axes[0, 1].axhspan(40.0, 60.0, color=BLACK, alpha=0.12)
        axes[0, 0].set(title="one grain (Masri)", xlabel="RMS, closed form [mm]")
        axes[0, 0].set_ylabel("RMS [mm]")
        axes[0, 1].set(title="beam with 6 % of grains (grey: measured)", xscale="log", ylim=(0, 70))
        axes[0, 1].set(xlabel="peak acceleration [g]", ylabel="energy lost in a cycle [%]")
        axes[1, 0].set(title="no lid: dashed -1, dotted -2", xscale="log", yscale="log")
        axes[1, 0].set(xlabel="peak acceleration [g]", ylabel="loss (full), mass (open) [1]")
        axes[1, 0].set_ylim(0.01, 2.0)
        axes[1, 1].set(title="fillings of one mass", ylabel="peak RMS [mm]")
        axes[1, 1].set_ylim(0.0, 1.2 * axes[1, 1].get_ylim()[1])
        axes[1, 1].margins(x=0.15)
        axes[1, 1].set_xlabel("number, restitution, friction [1]")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)


def draw_masri(axis, drawn, look):
    """Ours over the closed form."""
    axis.plot(*drawn, ls="", **look)


def draw_beam(axis, drawn, look):
    """Capacity over acceleration, the best clearance at each."""
    levels, capacity, _ = drawn
    axis.plot(levels, capacity.max(axis=0), **look)


def draw_open(axis, drawn, look):
    """Loss and mass over acceleration for each width."""
    for level, mass, loss in drawn.values():
        axis.plot(level, loss, lw=1.0, **look)
        axis.plot(level, np.where(mass > 0.0, mass, np.nan), lw=1.0, mfc="none", **look)
    axis.plot(level, 1.6 / level, color=BLACK, ls="--")
    axis.plot(level, 1.6 / level**2, color=BLACK, ls=":")


def draw_equal(axis, drawn, look):
    """Peak of each filling."""
    fillings, peaks = drawn
    axis.plot(range(len(peaks)), peaks, ls="", **look)
    names = [f"N = {n}\ne = {e:g}\nμ = {friction:g}" for n, e, friction in fillings]
    axis.set_xticks(range(len(peaks)), names)


DRAWINGS = {"masri": draw_masri, "beam": draw_beam, "open": draw_open, "equal": draw_equal}


def run(options):
    """Measure all cases, print, write, picture."""
    folder, found = study.begin(options), {}
    for filling in options.by:
        made = found[filling.label] = {}
        with ProgressBar(filling.label) as bar:
            for k, (name, case) in enumerate(CASES.items()):
                bar.count(k, len(CASES))
                made[name] = list(case(filling, options))
    rows = [(label, row) for label, made in found.items() for part in made.values() for row in part]
    cells = [cells_of(*pair) for pair in rows]
    study.print_table(cells, HEADER)
    study.write_rows(folder / "trust.csv", cells, " ".join(HEADER))
    write_text(folder / f"{NAME}.md", study.markdown_of(HEADER, cells))
    draw(folder / "trust.png", found)
    figures = {f"{row.key}_{label}": (float(row.ours), "1") for label, row in rows}
    figures["holds"] = sum(one[-1] == "holds" for one in cells), "1"
    figures["rows"] = len(cells), "1"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
