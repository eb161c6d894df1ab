"""Can the results be trusted? Cases that others have published, beside our numbers.

Each case has a number from a formula, another program or a test of real material. Ours is the mean
over random meshes, with half of their range. A miss is reported with its reason. The cases are
in experiments/cases/trust; tests run them too.

    python experiments/trust.py
    python experiments/trust.py --only slope,rotation
    python experiments/trust.py --quick

Writes trust.csv, trust.md, numbers.png, pictures of two cases and summary.json to results/trust/.
"""

import itertools
import sys
from functools import partial

import numpy as np
import pandas as pd

from cases.trust import Effort, beams, bonds, contacts, cracks, waves
from cases.trust import blast as blasts
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, RED, picture
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "trust"
#: In the order of the page.
MEASURES = (
    *(waves.bar_wave, waves.spall, bonds.strengths, beams.beams),
    *(cracks.branching, bonds.joint, blasts.blast, contacts.slope, contacts.rotation),
)
CASES = {measure.__name__: measure for measure in MEASURES}
QUICK = ("bar_wave", "joint", "rotation")
SETTINGS = {
    "only": ([*CASES], QUICK, study.several(study.one_of(CASES)), "names of cases; default: all"),
    "meshes": (5, 2, study.whole(1, 100), "random meshes of each size, default 5"),
    "sizes": (3, 1, study.whole(1, 3), "element sizes of the plates, default 3"),
    "seed": (0, 0, study.whole(0, 10**6), "seed of the first mesh, default 0"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
HEADER = ("case", "source", "published", "ours", "wanted", "verdict")


def run(options):
    """Measure all cases; write the table, pictures, and the figures."""
    folder, rows = study.begin(options), []
    effort = Effort(range(options.seed, options.seed + options.meshes), options.sizes)
    with ProgressBar(NAME) as bar:
        for done, name in enumerate(options.only):
            bar.count(done, len(options.only))
            numbers, drawn = CASES[name](effort)
            rows += numbers
            if name in DRAWINGS:
                with picture(folder / f"{name}.png", size=(4.6, 3.6)) as (_, axes):
                    DRAWINGS[name](axes, **drawn)
    draw_numbers(folder / "numbers.png", rows)
    study.print_table([cells(row) for row in rows], HEADER)
    pd.DataFrame(map(vars, rows)).to_csv(folder / "trust.csv", index=False)
    write_text(folder / "trust.md", page_of(rows))
    study.finish(options, NAME, figures_of(rows), 0.0)


def cells(row):
    """Cells of the printed table."""
    unit = "" if row.unit == "1" else f" {row.unit}"
    spread = f" ± {row.spread:.2g}" if np.size(row.values) > 1 else ""
    ours, published = f"{row.mean:.4g}{spread}", f"{row.published:.4g}{unit}"
    wanted, verdict = f"{row.low:.4g} to {row.high:.4g}", "holds" if row.holds else "misses"
    return row.words, row.source, published, ours, wanted, verdict


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
    """Table in Markdown, each source once, and the reasons of misses, to which verdicts refer."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    reasons = list(dict.fromkeys(row.miss for row in rows if row.miss and not row.holds))
    above = None
    for row in rows:
        note = f" ({reasons.index(row.miss) + 1})" if row.miss and not row.holds else ""
        words, source, *rest = cells(row)
        shown = (words, "" if source == above else source, *rest)
        lines.append("| " + " | ".join(shown) + note + " |")
        above = source
    notes = [f"{k}. {reason}." for k, reason in enumerate(reasons, 1)]
    return "\n".join([*lines, "", *notes]) + "\n"


def draw_numbers(path, rows):
    """Where each number lies in what counts as agreement, -1 to 1; what is far off at the edge."""
    with picture(path, size=(7.6, 0.9 + 0.24 * len(rows))) as (figure, axes):
        axes.axvspan(-1.0, 1.0, color=GREY, alpha=0.25, lw=0.0, label="counts as agreement")
        for place, row in enumerate(rows):
            half = 0.5 * (row.high - row.low) or 1e-12
            found = np.array([row.mean, row.mean - row.spread, row.mean + row.spread])
            found = np.clip((found - row.low) / half - 1.0, -3.0, 3.0)
            colour = GREEN if row.holds else RED
            axes.plot(found[1:], [place, place], color=colour)
            axes.plot(found[0], place, "o", color=colour, ms=4)
        axes.set_yticks(range(len(rows)), [row.words for row in rows], fontsize=7.0)
        axes.set(xlabel="deviation / what is allowed [1]", xlim=(-3.2, 3.2))
        axes.invert_yaxis()
        for colour, words in ((GREEN, "holds"), (RED, "misses")):
            axes.plot([], [], "o-", color=colour, ms=4, label=f"{words}, and the spread of meshes")
        figure.legend(loc="outside lower center", ncols=3)


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


#: Pictures of cases by name: a function of axes and of what the case gave to draw.
DRAWINGS = {drawing.__name__: drawing for drawing in (branching, blast)}


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
