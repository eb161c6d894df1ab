"""Where do the damper's fillings agree with others, with exact solutions and with each other?

Published cases first. One grain between walls has a closed form (Masri). A beam with 6 % of its
mass in lead grains loses half of its energy in a cycle (Friend and Kinra); grains that collect and
collide can take 8 times the mass ratio, 48 %. In boxes without a lid the apparent mass falls as
acceleration to the -2, the loss to the -1, whatever the width (Masmoudi et al., Ferreyra et al.).
Fillings of one mass have one response where the box leaves them room (Sanchez et al.). A miss is
printed as a miss: in one case of Masri's, with 3 % above resonance, both fillings end from rest in
an irregular motion beside the periodic one; a box without a lid has a mass that turns negative at
3 g, so that few points are left for its exponent. The optimum of clearance of the beam and the
curves of Saeki 2002 are drawn in papers that print no numbers, and are not compared.

Then the automaton, by the rules of the paper and by those of place, beside spheres: the motion of
grains in a container that throws them, loss and apparent mass at small amplitudes, the plug that
grains form without gravity, the peaks of the damped structure, and whether a motion lasts. Expect
the rules of place within the wanted range of every such row. The map shows where to trust either,
by the difference of the impedance from that of spheres.

    python experiments/damper_trust.py            # about ten minutes on two cores
    python experiments/damper_trust.py --quick    # published cases by the rules of place alone

Writes trust.png, published.png, trust.csv, map.csv, damper_trust.md and summary.json to
results/damper_trust/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

from cases import damper_trust as cases
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_trust"
SETTINGS = {
    "seeds": (16, 4, study.whole(1, 1000), "starts averaged beside spheres, default 16"),
    "transient": (150, 25),
    "cycles": (20, 6),
    "long": (2000, 200),
    # Numbers of grains that swing, cycles of them that are filmed; those whose peaks are sought.
    "swings": ((40, 20, 5), (40,)),
    "filmed": (8, 4),
    "peaks": ((30, 50), ()),
    "jump": (cases.JUMP, cases.JUMP[::2]),
    "frequencies": ([4.0, 6.0, 10.0, 16.0, 25.0, 40.0, 64.0], [6.0, 50.0]),
    "accelerations": ([0.8, 1.2, 1.5, 2.0, 3.0, 5.0, 8.0], [1.5, 3.0]),
    "grains": ([5, 10, 30, 50], [10, 30]),
    # Of the published cases: seeds and cycles of the maps, periods of one grain.
    "few": (2, 1),
    "driven": (50, 10),
    "levels": (12, 6),
    "periods": (400, 300),
    "grid": (cases.MASRI, ((0.05,), (0.5,), (2,), cases.MASRI[3])),
    "gaps": (cases.BEAM_CELLS, (2, 4)),
    "columns": (cases.COLUMNS, (3,)),
    "fillings": (((30, 0.75, 0.5), *cases.EQUAL_MASS), cases.EQUAL_MASS[1:3]),
    "by": (("dem", "place"), ("place",)),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Shares at which the colours of the map change.
SHADES = (0.0, 0.05, 0.1, 0.2, 0.4, 1.0)
UNITS = {"mm": "mm", "deg": "deg", "percent": "%"}
HEADER = ("case", "source", "published", "spheres", "paper", "place", "wanted", "verdict")


def measured(options):
    """Values and what is drawn by case and filling; impedances by filling."""
    jobs = [(case, by) for case in cases.PUBLISHED for by in options.by]
    jobs += [(case, by) for case in cases.COMPARED for by in cases.FILLINGS]
    jobs += [(cases.lasting, by) for by in ("paper", "place")]
    found, maps = {}, {}
    with ProgressBar("cases and map") as bar:
        for k, (case, by) in enumerate(jobs):
            bar.count(k, len(jobs) + len(cases.FILLINGS))
            found[case, by] = case(cases.FILLINGS[by], options)
        for by, filling in cases.FILLINGS.items():
            maps[by] = cases.impedance(filling, options)
    return found, maps


def rows_of(found):
    """Rows of the table: words, source, published, values by filling, ends of what is wanted."""
    values = {}
    for (_, by), (ours, _) in found.items():
        for key, value in ours.items():
            values.setdefault(key, {})[by] = float(value)
    rows = {}
    for key, of in values.items():
        if key in cases.WANTED:
            words, source, published, low, high = cases.WANTED[key]
        else:
            words, off, share = cases.NEAR[key]
            # Beside spheres, which have a column of their own.
            source, published, off = "", "", off + share * abs(of["dem"])
            low, high = of["dem"] - off, of["dem"] + off
        rows[key] = words, source, published, of, low, high
    return rows


def cells_of(words, source, published, of, low, high):
    """Cells of the printed table; the verdict is that of the rules of place."""
    numbers = [f"{of[by]:.3g}" if by in of else "" for by in cases.FILLINGS]
    verdict = "holds" if low <= of["place"] <= high else "misses"
    return words, source, published, *numbers, f"{low:.3g} to {high:.3g}", verdict


def draw_map(path, options, apart):
    """A panel for each number of grains and rules: percent of difference, light is good."""
    axes_of = {"x": options.frequencies, "y": options.accelerations}
    shape = {"size": (2.1 * len(options.grains) + 0.8, 6.4), "squeeze": False, "sharex": True}
    with picture(path, len(apart), len(options.grains), sharey=True, **shape) as (figure, panels):
        for row, (name, maps) in zip(panels, apart.items()):
            label = cases.FILLINGS[name].label
            row[0].set_ylabel(f"{styles_of([label])[label].label}\nacceleration [g]")
            for axes, count, shares in zip(row, options.grains, maps):
                shade(axes, shares)
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


def draw_published(path, found, names):
    """The beam at its best clearance, and boxes without a lid, over acceleration."""
    with picture(path, 1, 2, (10.5, 4.6)) as (figure, (left, right)):
        styles = styles_of([cases.FILLINGS[by].label for by in names]).values()
        for by, style in zip(names, styles):
            look = {"color": style.colour, "marker": style.marker, "ms": 6, "label": style.label}
            levels, capacity = found[cases.beam, by][1]
            left.plot(levels, capacity.max(axis=0), **look)
            for level, mass, loss in found[cases.open_boxes, by][1]:
                right.plot(level, loss, lw=1.0, **look)
                right.plot(level, np.where(mass > 0.0, mass, np.nan), lw=1.0, mfc="none", **look)
        right.plot(level, 1.6 / level, color=BLACK, ls="--")
        right.plot(level, 1.6 / level**2, color=BLACK, ls=":")
        left.axhspan(40.0, 60.0, color=BLACK, alpha=0.12)
        left.set(title="beam with 6 % of grains (grey: measured)", xscale="log", ylim=(0, 70))
        left.set(xlabel="peak acceleration [g]", ylabel="energy lost in a cycle [%]")
        right.set(title="no lid: dashed -1, dotted -2", xscale="log", yscale="log")
        right.set(xlabel="peak acceleration [g]", ylabel="loss (full), mass (open) [1]")
        right.set_ylim(0.01, 2.0)
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=2)


def write_map(path, options, apart):
    """The map as a table."""
    names = pd.MultiIndex.from_product(
        [apart, options.grains, options.accelerations, options.frequencies],
        names=["rules", "particles", "acceleration_g", "frequency_Hz"],
    )
    table = pd.Series(np.ravel([*apart.values()]), names, name="impedance_difference")
    table.to_csv(path)


def run(options):
    """Measure all cases and the map; print, write, picture."""
    folder = study.begin(options)
    found, maps = measured(options)
    rows = rows_of(found)
    cells = [cells_of(*row) for row in rows.values()]
    study.print_table(cells, HEADER)
    study.write_rows(folder / "trust.csv", cells, " ".join(HEADER))
    write_text(folder / f"{NAME}.md", study.markdown_of(HEADER, cells))
    exact = np.array(maps.pop("dem"))
    apart = {by: np.abs(np.array(one) - exact) / np.abs(exact) for by, one in maps.items()}
    write_map(folder / "map.csv", options, apart)
    draw_map(folder / "trust.png", options, apart)
    draw_published(folder / "published.png", found, options.by)
    figures = {
        f"{key}_{by}": (value, next((UNITS[part] for part in key.split("_") if part in UNITS), "1"))
        for key, row in rows.items()
        for by, value in row[3].items()
    }
    near = [one for key, one in zip(rows, cells) if key in cases.NEAR]
    figures["near_spheres"], figures["compared"] = (
        (sum(one[-1] == "holds" for one in near), "1"),
        (len(near), "1"),
    )
    for by, shares in apart.items():
        figures[f"trusted_share_{by}"] = float((shares < 0.2).mean()), "1"
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
