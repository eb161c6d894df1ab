"""What shakes and what breaks, when holes in a tunnel face are fired, and does a cut help?

Rock of 4 m x 4 m x 3 m behind a plane face, open in front, with quiet boundaries elsewhere. Six
holes with the same charge stand in four designs: straight into full rock, as a V cut, beside a slot
that was cut before, and around an empty hole. Expect the V to throw out most, the free faces of
slot and empty hole to let more rock move at a charge, and peak velocities to fall with the power
1.3 to 1.9 of the distance, as they do near blasts in hard rock.

Each design runs on several meshes of two sizes. A bar is the 95 % range of the mean over meshes of
the finer size, and the difference to the coarser one; what lies within it is "not distinguished".
Rock and gas are assumed (granite; the pulse of the first paper's block), delays at 1/20 of real
ones. With --stress the rock is pressed by 20 MPa in one direction on the face and 2 MPa across it:
cracks turn into the direction of the largest pressure.

    python experiments/tunnel_face.py --quick                    # two designs, one mesh: no bars
    python experiments/tunnel_face.py                            # needs gmsh: make mesh
    python experiments/tunnel_face.py --near 0.03                # 50,000 tetrahedra and more
    python experiments/tunnel_face.py --holes holes.csv          # beside the parallel holes
    python experiments/tunnel_face.py --stress 45                # pressed at 45 degrees from x
    python experiments/tunnel_face.py --delay 2.5e-4 --exponent 1.4   # one by one; gas expands

A row of holes.csv is a hole: x_m, y_m, length_m, and by choice angle_deg, charge_from_m, delay_s,
diameter_m (docs/tunnel.md). Writes peaks.png, energy.png, runs.csv, designs.csv, summary.json and
a folder with the whole first run of each design and its cracks to results/tunnel_face/.
"""

import itertools
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

import taichi_dem as dem
from cases import tunnel as tunnel
from taichi_dem.kit import study
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, ORANGE, WINE, picture
from taichi_dem.mesh.boreholes import read_holes

NAME = "tunnel_face"
#: What is compared between designs, with its unit; colours of designs.
COMPARED = {"beside_m_s": "m/s", "behind_m_s": "m/s", "exponent": "1", "radiated_kJ": "kJ"}
COMPARED |= {"out_m3": "m3", "out_m_s": "m/s", "depth_m": "m"}
#: What is compared in rock under stress as well.
CRACKS = {"crack_deg": "degrees", "crack_alike": "1"}
COLOURS = (GREY, BLUE, ORANGE, GREEN)
#: Name of the design of a user's table; edges of the coarser meshes over the others.
YOURS, COARSER = "yours", 1.4
#: Each body has a step of its own, as those at the holes are a tenth as large as the others.
CONTROL = dem.StepControl(safety=0.3, dashpot_floor=1e-7)
METHOD = dem.Multirate(1.6e-6, 1e-4, control=CONTROL, dashpot="limited")


DESIGNS = [*tunnel.designs()]
SETTINGS = {
    "designs": (DESIGNS, [*tunnel.KEPT], study.several(study.one_of(DESIGNS)), "of tunnel rounds"),
    "near": (0.09, None, study.number(0, 0.5), "edge of elements at the holes [m], 0.09"),
    "meshes": (4, 1, study.whole(1, 100), "meshes of each design and size, 4"),
    "until": (2e-3, 8e-4, study.number(0, 1), "simulated time [s], 2e-3"),
    "delay": (0.0, 0.0, study.number(0, 1e-2, open_low=False), "between heights of holes [s], 0"),
    "exponent": (0.0, 0.0, study.number(0, 5, open_low=False), "of gas that expands; 0: none"),
    "stress": (None, None, study.number(-90, 90), "largest pressure at [degrees] from x"),
    "holes": (None, None, str, "CSV file of holes, run beside the parallel ones"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def fired(row):
    """Design and result of a row: name of a design, edge near its holes, number of its mesh."""
    known = tunnel.designs(row["delay_s"])
    design = known.get(row["design"]) or tunnel.Design(read_holes(row["holes"]))
    mesh = tunnel.mesh_of(row["design"], design, row["near_m"], row["mesh"])
    looks = {"until": row["until_s"], "samples": 200, "frames": 16, "title": row["design"]}
    scene = tunnel.scene_of(mesh, design, row["exponent"], row.get("stress_deg"))
    return design, dem.simulate(scene, method=METHOD, **looks)


def measured(row):
    """What is measured of the run of a row, numbers by name."""
    return tunnel.measures(*fired(row))


def rows_of(options):
    """Rows of all runs; the first mesh of each design, of the finer size, comes first."""
    names = ("parallel", YOURS) if options.holes else options.designs
    near = options.near or (tunnel.KEPT_NEAR if options.holes else 0.0)
    fixed = {"delay_s": options.delay, "until_s": options.until, "exponent": options.exponent}
    fixed |= {"holes": options.holes} if options.holes else {}
    fixed |= {} if options.stress is None else {"stress_deg": options.stress}
    sizes = [near, COARSER * near] if options.meshes > 1 else [near]
    numbers = itertools.product(range(options.meshes), sizes, names)
    return [{"design": d, "near_m": n, "mesh": k, **fixed} for k, n, d in numbers]


def runs_of(options):
    """Table of all runs, and design and result of the first run of each design by its name.

    Those are drawn; the others run side by side, and the same command runs what is missing.
    """
    rows = rows_of(options)
    count = len({row["design"] for row in rows})
    first = {row["design"]: fired(row) for row in rows[:count]}
    found = [
        pd.DataFrame([{**row, **tunnel.measures(*first[row["design"]])} for row in rows[:count]])
    ]
    if rows[count:]:
        where = {"out": study.begin(options) / "runs", "workers": options.threads}
        version = Path(options.holes).read_text() if options.holes else ""
        found.append(dem.sweep(measured, rows[count:], version=version, **where))
        for sentence in found[1]["error"][found[1]["error"] != ""]:
            raise dem.InputError(sentence)
    return pd.concat(found), first


def with_bars(rows):
    """A row a design: means over the meshes of the finer size, and their bars, NAME_bar each.

    A bar is half of the 95 % range of the mean by Student's t, and the difference to the mean of
    the coarser size; NaN of one mesh.
    """
    of_number = rows.select_dtypes("number").columns.drop("near_m")
    finer, *coarser = (own.groupby("design", sort=False) for _, own in rows.groupby("near_m"))
    mean, count = finer[of_number].mean(), finer.size()
    wide = count.map(lambda n: t_quantile(0.95, n - 1) if n > 1 else np.nan)
    bar = finer[of_number].std().mul(wide / np.sqrt(count), axis=0)
    for other in coarser:
        bar = bar + (other[of_number].mean() - mean).abs()
    return mean.join(bar.add_suffix("_bar"))


def compared(table, names):
    """Rows in words: value and bar of each design, and whether it differs from the first."""
    rows = []
    for name, unit in names.items():
        value, bar = table[name], table[f"{name}_bar"]
        apart = (value - value.iloc[0]).abs() > np.hypot(bar, bar.iloc[0])
        words = [f"{v:.3g} +- {b:.2g}" if b == b else f"{v:.3g}" for v, b in zip(value, bar)]
        notes = ["", *("" if known else " (not distinguished)" for known in apart[1:])]
        rows.append([f"{name} [{unit}]", *(a + b for a, b in zip(words, notes))])
    return rows


def draw_peaks(path, runs, table):
    """Peak velocities of bodies over distance, their power law, and the bars at one place."""
    with picture(path, 1, 2, size=(9.6, 4.4), sharey=True) as (figure, panels):
        for (name, run), colour in zip(runs.items(), COLOURS):
            distance, speed, sides = tunnel.peaks(*run)
            for axes, (side, chosen) in zip(panels, sides.items()):
                chosen &= distance > tunnel.FITTED[0]
                axes.plot(distance[chosen], speed[chosen], ".", ms=1.5, alpha=0.2, color=colour)
                power, level = tunnel.power_law(distance, speed, chosen)
                fit = level * (np.array(tunnel.FITTED) / tunnel.PLACE) ** -power
                axes.plot(tunnel.FITTED, fit, lw=2.5, color=colour)
                value, bar = table.loc[name, [f"{side}_m_s", f"{side}_m_s_bar"]]
                look = {"fmt": "o", "ms": 7, "capsize": 5, "color": colour, "mec": "white"}
                axes.errorbar(tunnel.PLACE, value, bar if bar == bar else None, label=name, **look)
                axes.set(xscale="log", yscale="log", title=f"{side} the round", xticks=(1, 2, 3))
                axes.set_xlabel("distance from the charges [m]")
        panels[0].set_ylabel("peak velocity [m/s]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)


def draw_energy(path, table):
    """What the work of the gas went into, a bar a design, with the spread over meshes."""
    parts = [*tunnel.PARTS]
    shares, bars = (
        100.0 * table[[f"{part}_share{end}" for part in parts]].set_axis(parts, axis=1)
        for end in ("", "_bar")
    )
    colours = [BLUE, WINE, ORANGE, "#c7b299", GREEN, "#dddddd"]
    with picture(path, size=(8.4, 1.4 + 0.65 * len(table))) as (figure, axes):
        look = {"stacked": True, "color": colours, "legend": False, "capsize": 3, "ylabel": ""}
        shares.plot.barh(xerr=bars, ax=axes, **look)
        axes.set(xlabel="share of the work of the gas [%]", xlim=(0.0, None))
        axes.invert_yaxis()
        figure.legend(loc="outside upper center", ncols=6)


def run(options):
    """Fire all designs, draw, print."""
    (rows, first), folder = runs_of(options), study.begin(options)
    table = with_bars(rows)
    names = COMPARED if options.stress is None else COMPARED | CRACKS
    study.print_table(compared(table, names), ["", *table.index])
    rows.to_csv(folder / "runs.csv", index=False)
    table.to_csv(folder / "designs.csv")
    draw_peaks(folder / "peaks.png", first, table)
    draw_energy(folder / "energy.png", table)
    for name, (_, result) in first.items():
        result.write(folder / name)
        result.plot.cracks(magnify=3.0, path=folder / name / "cracks.png")
    figures = {
        f"{design.replace(' ', '_')}_{name}": (table.loc[design, name], unit)
        for design in table.index
        for name, unit in names.items()
    }
    figures["tetrahedra"] = int(rows.tetrahedra.max()), "1"
    study.finish(options, NAME, figures, [result.report for _, result in first.values()])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
