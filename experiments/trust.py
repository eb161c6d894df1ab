"""Can the results be trusted? Cases that others have published, beside our numbers.

Each case has a number from a formula, another program or a test of real material. Ours is the mean
over random meshes, with half of their range. A miss is reported with its reason. The cases are
tests, in tests/trust.

    python experiments/trust.py
    python experiments/trust.py --only slope,rotation
    python experiments/trust.py --quick

Writes trust.csv, trust.md, a picture of each case and summary.json to results/trust/.
"""

import itertools
import sys
from functools import partial

import numpy as np

from _asked import found_by
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, RED, picture

NAME = "trust"
QUICK = ("bar_wave", "joint", "rotation")
SETTINGS = {
    "only": (None, QUICK, study.several(str), "names of cases; default: all"),
    "meshes": (5, 2, study.whole(1, 100), "random meshes of each size, default 5"),
    "sizes": (3, 1, study.whole(1, 3), "element sizes of the plates, default 3"),
    "seed": (0, 0, study.whole(0, 10**6), "seed of the first mesh, default 0"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
HEADER = ("case", "source", "published", "ours", "wanted", "verdict")


def run(options):
    """Measure all cases; write the table, a picture of each, and the figures."""
    folder, rows = study.begin(options), []
    for case, numbers, drawn in found_by(NAME, options):
        rows += numbers
        with picture(folder / f"{case.name}.png", 1, 1, size=(4.6, 3.6)) as (_, axes):
            DRAWINGS[case.name](axes, **drawn)
    study.print_table([cells(row) for row in rows], HEADER)
    study.write_rows(folder / "trust.csv", [csv_row(row) for row in rows])
    write_text(folder / "trust.md", page_of(rows))
    study.finish(options, NAME, figures_of(rows), 0.0)


def cells(row):
    """Cells of the printed table."""
    unit = "" if row.unit == "1" else f" {row.unit}"
    spread = f" ± {row.spread:.2g}" if np.size(row.values) > 1 else ""
    ours, published = f"{row.mean:.4g}{spread}{unit}", f"{row.published:.4g}{unit}"
    wanted = f"{row.low:.4g} to {row.high:.4g}{unit}"
    return row.words, row.source, published, ours, wanted, "holds" if row.holds else "misses"


def csv_row(row):
    """Row of the CSV."""
    names = ("key", "unit", "published", "mean", "spread", "low", "high", "holds")
    values = " ".join(f"{value:.8g}" for value in np.ravel(row.values))
    found = {"ours" if name == "mean" else name: getattr(row, name) for name in names}
    return {**found, "values": values}


def figures_of(rows):
    """Value, error and spread of every number."""
    figures = {}
    for row in rows:
        figures[f"{row.key}_value"] = row.mean, row.unit
        figures[f"{row.key}_published"] = row.published, row.unit
        figures[f"{row.key}_error_percent"] = row.error_percent, "%"
        figures[f"{row.key}_spread"] = row.spread, row.unit
    holding = sum(row.holds for row in rows)
    return {**figures, "numbers": (len(rows), "1"), "numbers_that_hold": (holding, "1")}


def page_of(rows):
    """The table in Markdown, and the reasons of the misses, to which their verdicts refer."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    reasons = list(dict.fromkeys(row.miss for row in rows if row.miss and not row.holds))
    for row in rows:
        note = f" ({reasons.index(row.miss) + 1})" if row.miss and not row.holds else ""
        lines.append("| " + " | ".join(cells(row)) + note + " |")
    notes = [f"{k}. {reason}." for k, reason in enumerate(reasons, 1)]
    return "\n".join([*lines, "", *notes]) + "\n"


def dots(axes, x, values, words="a random mesh", colour=RED):
    """A dot a mesh: values (meshes, n) over x (n,)."""
    axes.plot(x, np.transpose(values), "o", color=colour, ms=4)
    axes.plot([], [], "o", color=colour, label=words)


def bar_wave(axes, waves, error):
    """Error of the speed [%] over the elements in a wave length."""
    axes.axhspan(-1.0, 1.0, color=GREY, alpha=0.25, lw=0.0, label="1 %")
    dots(axes, waves, error)
    axes.plot(waves, error.mean(axis=0), "_", color=BLACK, ms=16, label="mean")
    axes.set(xlabel="elements in a wave length [1]", ylabel="error of the speed [%]")
    axes.set_xticks(waves, map("{:g}".format, waves))
    axes.legend(loc="lower right")


def spall(axes, from_end, depth):
    """Where the bars came apart, and the planes of the formula [mm]."""
    look = {"color": RED, "ms": 14}
    for k, places in enumerate(from_end):
        axes.plot(places, np.full(len(places), k + 1.0), "|", **look)
    axes.plot([], [], "|", label="end of a piece", **look)
    for k in range(1, 5):
        words = "" if k > 1 else "planes of the formula"
        axes.axvline(k * depth, color=BLACK, lw=0.8, ls=":", label=words)
    axes.set(xlabel="distance from the free end [mm]", ylabel="random mesh [1]")
    axes.set(yticks=range(1, len(from_end) + 1), ylim=(0.4, len(from_end) + 0.6))
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def disc(axes, tension, brazilian, ratio, allowed):
    """Both strengths [MPa] of every mesh, and the ratio of granite."""
    ends = np.array([0.0, 1.15 * tension.max()])
    near = (ratio * (1.0 + way) * ends for way in (-allowed, allowed))
    axes.fill_between(ends, *near, color=GREY, alpha=0.25, label=f"within {100 * allowed:.0f} %")
    axes.plot(ends, ratio * ends, color=BLACK, lw=0.8, label="ratio of granite")
    dots(axes, tension, [brazilian])
    axes.set(xlabel="direct tension [MPa]", xlim=ends)
    axes.set_ylabel("Brazilian test, arcs of 10 degrees [MPa]")
    axes.legend(loc="lower right")


def crack(axes, edges, area):
    """Broken area over that of the plane, over the size of the elements [mm]."""
    dots(axes, edges, area)
    axes.axhline(1.0, color=BLACK, lw=0.8, label="a plane")
    axes.set(xlabel="edge of an element [mm]", xscale="log")
    axes.set_ylabel("broken area / area of the plane [1]")
    axes.legend()


def branching(axes, places, notch, length, reach):
    """Broken faces ahead of the notch [mm], a colour and a mark for each mesh."""
    axes.plot([0.0, notch], [0.0, 0.0], color=BLACK, lw=1.5, label="notch")
    looks = zip((RED, BLUE, GREEN, ORANGE, GREY), "osD^v")
    for k, (place, (colour, mark)) in enumerate(zip(places, itertools.cycle(looks)), 1):
        look = {"color": colour, "marker": mark, "ms": 2.5, "ls": "none", "label": f"mesh {k}"}
        axes.plot(*place, **look)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", xlim=(40.0, length), ylim=(-reach, reach))
    axes.set_aspect("equal")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, markerscale=2.0)


def joint(axes, law, angles, spent):
    """Energies over the angle beside the law."""
    axes.plot(*law, color=BLACK, lw=0.8, label="law")
    dots(axes, angles, spent, "plates", BLUE)
    axes.set(xlabel="pull against the joint's normal [degrees]", ylabel="energy [J/m2]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def blast(axes, curves, law, limit):
    """Share of the mass below a size [m], for each mesh, and where sizes are those of the mesh."""
    for k, (sieves, passing) in enumerate(curves):
        axes.loglog(1e3 * sieves, passing, color=RED, lw=1.0, label="" if k else "a random mesh")
    sieves, passing = law
    axes.loglog(1e3 * sieves, passing, color=BLACK, lw=0.8, ls=":", label="Rosin and Rammler")
    low, high = 1e3 * sieves[0], 1e3 * sieves[-1]
    axes.set(xlabel="size of a fragment [mm]", xlim=(low, high))
    axes.set(ylabel="share of the mass below [1]", ylim=(1e-4, 1))
    axes.axvspan(low, 1e3 * limit, color=GREY, alpha=0.3, label="the mesh's own sizes")
    axes.legend(loc="lower right")


def slope(axes, shares, ways):
    """Ways [mm] over the angle."""
    for (words, moved), colour, form in zip(ways.items(), (BLUE, RED), ("o-", "s--")):
        axes.plot(shares, moved.T, form, color=colour, ms=4, lw=0.8)
        axes.plot([], [], form, color=colour, label=words)
    axes.axvline(1.0, color=BLACK, lw=0.8, ls=":", label="limit")
    axes.set(xlabel="tangent of the slope / its limit [1]", ylabel="way after 0.12 s [mm]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))


def rotation(axes, closed, before, after):
    """Spin after the blow over the spin before it, in units of mu v / R."""
    axes.plot(*closed, color=BLACK, lw=1.0, label="sliding, closed form")
    axes.plot(before, after, "o", color=RED, ms=5, label="spheres")
    axes.set_xlabel(r"spin before, $R\omega/(\mu v)$ [1]")
    axes.set_ylabel(r"spin after, $R\omega/(\mu v)$ [1]")
    axes.legend(loc="upper left")


#: Picture of each case by its name: a function of axes and of what the case gave to draw.
DRAWINGS = (bar_wave, spall, disc, crack, branching, joint, blast, slope, rotation)
DRAWINGS = {drawing.__name__: drawing for drawing in DRAWINGS}


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
