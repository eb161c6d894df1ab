"""What does the blast look like without contact, friction or softening, and where did each act?

    python experiments/called_for.py
    python experiments/called_for.py --quick

The paper's block is blasted to 0.5 ms with all effects, and without some of them. Each frame shows
the surroundings of the hole, displacements magnified five times. Below it are the CPU seconds of
the run and the error of the hole's displacement against the run with all effects. The effect of
chance is the difference of a run whose gas pressure differs in the last bit.

With effects="auto", an effect begins to act on a body when it is needed there. The map colours each
body by the last effect that began to act on it. Where bonds only strain, nothing else is computed.
Friction begins with contact.

Seconds are those of stepping on one core, in the fastest run. Writes called_for.png, acting.png,
called_for.csv and summary.json to results/called_for/.
"""

import sys
from functools import partial

import numpy as np
from matplotlib.colors import ListedColormap

import taichi_dem as dem
from _effects import ORDER, PEAK, scene_of
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, ORANGE, WINE, area_key, picture
from taichi_dem.mesh.mesh import volumes
from taichi_dem.plot.view import ALONG_Z, STONE, View, draw_bodies, frame_block, shades

NAME = "called_for"
#: Effects that are left out, by title.
LEFT_OUT = {
    "all effects": (),
    "no contact": ("body_contact", "sticking_friction"),
    "no friction": ("sticking_friction",),
    "no softening": ("softening",),
}
SETTINGS = {
    # Each is compiled; a quick run does without the last two.
    "scenes": (tuple(LEFT_OUT), ("all effects", "no contact")),
    "until": (5e-4, 2e-4, study.number(0, 1), "simulated time [s], default 5e-4"),
    "repeats": (3, 1, study.whole(1, 100), "runs, of which the fastest counts, default 3"),
    "step": (4e-7, 4e-7, study.number(0, 1e-5), "step of the method [s], default 4e-7"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)
#: Effects that can begin to act, the later one of two that do so at once; and what is drawn.
ACTING = {"softening": ORANGE, "slip": WINE, "contact": BLUE}
AROUND = {"xlim": (0.95, 2.15), "ylim": (0.4, 1.6), "xticks": [], "yticks": []}
COLUMNS = "scene seconds hole_mm error_percent"


def blast(scene, options, title):
    """Result of a run of the block."""
    looks = {"until": options.until, "samples": 1, "frames": 1, "title": title}
    return dem.simulate(scene, method=dem.ImplicitDashpots(options.step), **looks)


def hole_mm(result):
    """Displacement of the hole at the end [mm]."""
    return dem.goals.hole_displacement().value(result)


def runs_of(options):
    """Result of each run by title, and CPU seconds of its fastest repeat.

    Scenes take turns, as no machine is equally fast for long.
    """
    made = {title: [] for title in options.scenes}
    for _ in range(options.repeats):
        for title in options.scenes:
            scene = scene_of([name for name in ORDER if name not in LEFT_OUT[title]])
            made[title].append(blast(scene, options, title))
    spent = {title: [one.report.run_cpu_seconds for one in own] for title, own in made.items()}
    return {title: (own[-1], min(spent[title])) for title, own in made.items()}


def draw_frames(path, results, rows):
    """The surroundings of the hole at the end, by how far bodies have moved; numbers below."""
    lines = len(rows) // 2
    with picture(path, lines, 2, size=(4.8, 2.4 + 1.5 * lines), dpi=300) as (figure, panels):
        for axes, result, (title, seconds, _, error) in zip(panels.flat, results, rows):
            frame, model = result.frame(), result.model
            moved = 1e3 * np.linalg.norm(frame.displacement, axis=1)
            look = {"cmap": shades("magma_r", 0.04, 0.9), "clim": (0.0, 5.0), "magnify": 5.0}
            broken = ~np.isnan(result.broken_time)
            drawn = draw_bodies(axes, model, frame, moved, broken=broken, **look)
            axes.set(title=title, **AROUND)
            axes.set_xlabel(f"{seconds:.1f} s" + f", {error:.0f} % off" * (error > 0.0))
        bar = {"location": "bottom", "aspect": 30, "extend": "max"}
        figure.colorbar(drawn, ax=panels, label="displacement [mm]", **bar)


def last_awake(acting_since):
    """Number of the effect that began last to act on each body, 0 for none, (n,)."""
    since = np.array([acting_since[name] for name in ACTING])
    last = len(ACTING) - np.nan_to_num(since, nan=-1.0)[::-1].argmax(axis=0)
    return np.where(np.isnan(since).all(axis=0), 0, last)


def draw_acting(path, model, last):
    """The block at rest, each body in the colour of the effect that awoke on it last."""
    colours = {"none": STONE, **ACTING}
    with picture(path, size=(4.8, 4.6), dpi=300) as (figure, axes):
        look = {"cmap": ListedColormap([*colours.values()]), "clim": (-0.5, len(ACTING) + 0.5)}
        draw_bodies(axes, model, None, last, **look)
        frame_block(axes, View(ALONG_Z), model, 0.02)
        axes.set(xlabel="x [m]", ylabel="y [m]")
        keys = [area_key(name, fc=colour) for name, colour in colours.items()]
        look = {"loc": "outside upper center", "ncols": 4, "columnspacing": 1.0}
        figure.legend(handles=keys, title="last effect to act", **look)


def shares_of(mesh, last):
    """Figures: share of the volume on whose bodies each effect began last."""
    volume = volumes(mesh)
    shares = np.bincount(last, volume, len(ACTING) + 1) / volume.sum()
    names = ["none", *ACTING]
    return {f"{name}_last_percent": (100.0 * share, "%") for name, share in zip(names, shares)}


def run(options):
    """Run all, draw, print."""
    folder, runs = study.begin(options), runs_of(options)
    chance = blast(scene_of(ORDER, peak=np.nextafter(PEAK, np.inf)), options, "last bit changed")
    automatic = blast(scene_of("auto"), options, "effects where called for")
    results, whole = [result for result, _ in runs.values()], hole_mm(runs["all effects"][0])

    def error_of(result):
        return 100.0 * abs(hole_mm(result) / whole - 1.0)

    rows = [(title, spent, hole_mm(one), error_of(one)) for title, (one, spent) in runs.items()]
    study.write_rows(folder / f"{NAME}.csv", rows, COLUMNS)
    study.print_table([[row[0], *(f"{x:.3g}" for x in row[1:])] for row in rows], COLUMNS.split())
    draw_frames(folder / f"{NAME}.png", results, rows)
    last = last_awake(automatic.acting_since)
    draw_acting(folder / "acting.png", automatic.model, last)
    figures = {"chance_percent": (error_of(chance), "%")}
    for title, spent, _, error in rows:
        key = title.replace(" ", "_")
        figures.update({f"{key}_seconds": (spent, "s"), f"{key}_error_percent": (error, "%")})
    figures.update(shares_of(automatic.model.mesh, last))
    figures["auto_seconds"] = automatic.report.run_cpu_seconds, "s"
    study.finish(options, NAME, figures, [one.report for one in [*results, automatic]])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
