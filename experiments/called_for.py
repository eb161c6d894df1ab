"""What does each effect cost, what does the blast look like without it, and where did it act?

    python experiments/called_for.py
    python experiments/called_for.py --quick

The paper's block is blasted to 0.5 ms with all effects, without each of them, and with contacts of
spheres in place of that of bodies. Each frame shows the surroundings of the hole, displacements
magnified five times. Below it are the CPU seconds of the run and the error of the hole's
displacement against the run with all effects. The effect of chance is the difference of a run whose
gas pressure differs in the last bit.

With effects="auto", an effect begins to act on a body when it is needed there. The maps colour
bodies by the time from which each effect acts. Where bonds only strain, nothing else is computed.
Friction begins with contact.

Seconds are those of stepping on one core, in the fastest run; scenes take turns, as no machine is
equally fast for long. A run without an effect takes another way: its seconds are those of that way.
Writes called_for.png, effects.png, acting.png, called_for.csv and summary.json to
results/called_for/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import taichi_dem as dem
from cases.blast import EFFECTS
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREY, RED, area_key, picture
from taichi_dem.mesh.mesh import volumes
from taichi_dem.plot.view import draw_bodies, shades

NAME = "called_for"
#: Pressure of the blast [Pa].
PEAK = 575e6
#: Laws of bonds, then contact; nothing sticks without contact.
BONDS, CONTACT = ("bond_damping", "softening", "shear_slip"), ("body_contact", "sticking_friction")
ALL = (*BONDS, *CONTACT)
#: Effects by title of a scene, the first four of which are drawn.
SCENES = {
    "all effects": ALL,
    "no contact": BONDS,
    "no friction": ALL[:-1],
    "no softening": ("bond_damping", "shear_slip", *CONTACT),
    "no slip": ("bond_damping", "softening", *CONTACT),
    "no dashpots": ALL[1:],
    "contact of spheres": (*BONDS, "sphere_contact", "friction"),
    "spheres on all faces": (*BONDS, "surface_contact", "friction"),
}
SETTINGS = {
    # Each is compiled; a quick run does with three.
    "scenes": (tuple(SCENES), ("all effects", "no contact", "no slip")),
    "until": (5e-4, 2e-4, study.number(0, 1), "simulated time [s], default 5e-4"),
    "repeats": (3, 1, study.whole(1, 100), "runs, of which the fastest counts, default 3"),
    "step": (4e-7, 4e-7, study.number(0, 1e-5), "step of the method [s], default 4e-7"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)
#: What is drawn.
AROUND = {"xlim": (0.95, 2.15), "ylim": (0.4, 1.6), "xticks": [], "yticks": []}
COLUMNS = ["scene", "seconds", "hole_mm", "error_percent"]
#: Least change that is drawn [%].
LEAST = 0.01


def blast(names, options, title, peak=PEAK):
    """Result of a run of the block with effects by name, or "auto"; peak: of the gas [Pa]."""
    mesh, gas = dem.read_mesh(dem.PAPER_BLOCK), EFFECTS["gas_pressure"](peak=peak)
    if names == "auto":
        scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=[gas])
    else:
        scene = dem.Scene(mesh, dem.CONCRETE, [gas, *(EFFECTS[name]() for name in names)])
    looks = {"until": options.until, "samples": 1, "frames": 1, "title": title}
    return dem.simulate(scene, method=dem.ImplicitDashpots(options.step), **looks)


def hole_mm(result):
    """Displacement of the hole at the end [mm]."""
    return dem.goals.hole_displacement().value(result)


def runs_of(options):
    """Result of each run by title, and a table of seconds, displacements and errors."""
    titles = options.scenes
    made = [
        {title: blast(SCENES[title], options, title) for title in titles}
        for _ in range(options.repeats)
    ]
    results, whole = made[-1], hole_mm(made[-1]["all effects"])
    rows = [
        (
            title,
            min(turn[title].report.run_cpu_seconds for turn in made),
            hole_mm(result),
            100.0 * abs(hole_mm(result) / whole - 1.0),
        )
        for title, result in results.items()
    ]
    return results, pd.DataFrame(rows, columns=COLUMNS)


def draw_frames(path, results, table):
    """The surroundings of the hole at the end, by how far bodies have moved; numbers below."""
    lines = min(4, len(table)) // 2
    with picture(path, lines, 2, size=(4.8, 2.4 + 1.5 * lines), dpi=300) as (figure, panels):
        for axes, result, row in zip(panels.flat, results.values(), table.itertuples()):
            frame, model = result.frame(), result.model
            moved = 1e3 * np.linalg.norm(frame.displacement, axis=1)
            look = {"cmap": shades("magma_r", 0.04, 0.9), "clim": (0.0, 5.0), "magnify": 5.0}
            broken = ~np.isnan(result.broken_time)
            drawn = draw_bodies(axes, model, frame, moved, broken=broken, **look)
            axes.set(title=row.scene, **AROUND)
            off = f", hole {row.error_percent:.0f} % off" * (row.error_percent > 0.0)
            axes.set_xlabel(f"{row.seconds:.1f} s{off}")
        bar = {"location": "bottom", "aspect": 30, "extend": "max"}
        figure.colorbar(drawn, ax=panels, label="displacement [mm]", **bar)


def draw_effects(path, table, chance):
    """Bars: seconds of each run, and the change of the hole's displacement [%]."""
    with picture(path, 1, 2, (9.2, 1.8 + 0.4 * len(table)), sharey=True) as (figure, (left, right)):
        left.barh(table.scene, table.seconds, color=BLUE, height=0.6)
        left.set_xlabel("CPU time of the run [s]")
        changes = table.error_percent.iloc[1:]
        bars = right.barh(table.scene[1:], changes.clip(lower=LEAST), color=RED, height=0.6)
        right.bar_label(bars, [f"{value:.2g} %" for value in changes], padding=3, fontsize=8.5)
        right.axvspan(LEAST, max(LEAST, chance), color=GREY, alpha=0.3, linewidth=0)
        right.set(xscale="log", xlim=(LEAST, 2e3), xlabel="change of the hole's displacement [%]")
        left.invert_yaxis()
        keys = [area_key("change by chance alone (round-off)", fc=GREY, alpha=0.3)]
        figure.legend(handles=keys, loc="outside lower right")


def run(options):
    """Run all, draw, print."""
    folder, (results, table) = study.begin(options), runs_of(options)
    changed = blast(ALL, options, "last bit changed", peak=np.nextafter(PEAK, np.inf))
    chance = 100.0 * abs(hole_mm(changed) / hole_mm(results["all effects"]) - 1.0)
    automatic = blast("auto", options, "effects where called for")
    table.to_csv(folder / f"{NAME}.csv", index=False)
    print(table.to_string(index=False, float_format="{:.3g}".format), "\n")
    draw_frames(folder / f"{NAME}.png", results, table)
    draw_effects(folder / "effects.png", table, chance)
    automatic.plot.acting(path=folder / "acting.png")
    figures = {"chance_percent": (chance, "%")}
    for row in table.itertuples():
        key = row.scene.replace(" ", "_")
        figures[f"{key}_seconds"] = row.seconds, "s"
        figures[f"{key}_error_percent"] = row.error_percent, "%"
    since = [automatic.acting_since[name] for name in ("softening", "slip", "contact")]
    idle = np.isnan(since).all(axis=0)
    share = 100.0 * np.average(idle, weights=volumes(automatic.model.mesh))
    figures["none_acts_percent"] = float(share), "%"
    figures["auto_seconds"] = automatic.report.run_cpu_seconds, "s"
    study.finish(options, NAME, figures, [one.report for one in [*results.values(), automatic]])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
