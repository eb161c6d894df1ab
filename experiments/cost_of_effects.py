"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py          # about three minutes on two cores
    python experiments/cost_of_effects.py --quick

The paper's block is blasted with its effects added one by one, and left out one by one; so is a
response curve of the damper, by spheres and by the automaton. Every run is a process of its own
with an empty cache of kernels, then with a full one for the repeats: CPU seconds of a step (least
of the repeats), memory of all fields, CPU seconds before the first step, size of the compiled
kernels. Beside it: the displacement of the hole and the broken faces, or the response. An effect
that is left out of a scene must cost nothing: an elastic block is timed against a step stripped
by hand.

Writes effects.png, blast.csv, damper.csv and summary.json to results/cost_of_effects/.
"""

import os
import sys
from functools import partial

import numpy as np

from _effects_runs import absent, blast, damper
from ca_damper.measures import curve_distance
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, SKY, area_key, line_key, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "cost_of_effects"
#: Effects in the order in which they are added; the load is always there.
ORDER = ("bond_damping", "softening", "shear_slip", "sphere_contact", "friction")
#: What cannot stay without it.
ALONG = {"sphere_contact": ("friction",)}
SETTINGS = {
    "until": (2.5e-4, 1e-4, study.number(0, 1), "simulated time of the blast [s], 2.5e-4"),
    "repeats": (3, 1, study.whole(1, 100), "of every run, 3"),
    "ratios": ((0.88, 0.91, 0.94, 0.96, 0.98, 1.0, 1.03), (0.92, 0.96, 1.0)),
    "cycles": ((60, 20), (15, 5)),
    "left_out": (ORDER, ("sphere_contact", "friction")),
    "added": (ORDER, ()),
    "again": (100, 40),
}
#: Substeps that the elastic block is timed over at a time.
SUBSTEPS = 150
ALL, LAST_BIT = "all effects", "all effects, last bit of the load changed"
STEPS = {"blast": 4e-7, "spheres": 3e-5, "automaton": 1e-4}
#: Scenes of a filling by its options: as it is, then with an effect left out of it, or added.
FILLINGS = {
    "spheres": {
        "spheres as they are": {},
        "friction of spheres": {"friction": 0.0},
        "friction at walls": {"wall_friction": 0.0},
        "rotation": {"rotation": True},
    },
    "automaton": {
        "automaton as they are": {},
        "static contact": {"accounting": "landing+ejection"},
        "ejection and static contact": {"accounting": "landing"},
    },
}
#: Rows in which another contact takes the place of that of broken faces through spheres.
CONTACTS = {"contact of all surfaces": "surface_contact", "contact with faces": "face_contact"}
ADDED = ("rotation", *CONTACTS)
#: Columns of what an effect adds, and their units.
ADDS = {"run_s": "s", "memory_MB": "MB", "compiled_kB": "kB"}
HIDDEN = ("group", "failed", "run_s", "spared_least_percent", "spared_most_percent")
#: Threads are processes side by side.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def run(options):
    """Measure, then write and print."""
    folder = study.begin(options)
    calls = {**blasts(options), **dampers(options)}
    workers = options.threads or min(2, os.cpu_count() or 1)
    with ProgressBar("measuring") as bar:
        results = study.call_rounds(calls, options.repeats, workers, bar.count)
    elastic = study.call_in_process(absent, substeps=SUBSTEPS, repeats=options.again)
    tables, complete = {}, {}
    for scene, repeats in results.items():
        group = calls[scene][1].get("filling", "blast")
        complete.setdefault(group, repeats)
        tables.setdefault(group, []).append(row_of(group, scene, repeats, complete[group]))
    rows = tables["spheres"] + tables["automaton"]
    study.write_rows(folder / "blast.csv", tables["blast"])
    study.write_rows(folder / "damper.csv", rows)
    picture_effects(folder / "effects.png", tables)
    show(tables["blast"], "The blast: hole's displacement [mm] and broken faces")
    show(rows, "The damper: peak of the response [mm]; first rows: what two seeds may differ by")
    compiling = sum(found[0].get("compile_s", 0.0) for found in results.values())
    study.finish(options, NAME, figures_of(tables, elastic), compiling)


def blasts(options):
    """All effects, without each, and from the load alone up to all; none of them twice."""
    scenes = {ORDER: ALL}
    for name in options.left_out:
        gone = (name, *ALONG.get(name, ()))
        scenes[tuple(e for e in ORDER if e not in gone)] = f"without {' and '.join(gone)}"
    scenes[()] = "gas pressure alone"
    for k, name in enumerate(options.added):
        scenes.setdefault(ORDER[: k + 1], f"up to {name}")
    shared = {"until": options.until, "step": STEPS["blast"], "ulps": 0}
    calls = {
        scene: (blast, {**shared, "names": ["gas_pressure", *names]})
        for names, scene in scenes.items()
    }
    for scene, contact in CONTACTS.items():
        names = [contact if name == "sphere_contact" else name for name in ORDER]
        calls[scene] = blast, {**shared, "names": ["gas_pressure", *names]}
    if options.repeats > 1:
        calls[LAST_BIT] = blast, {**calls[ALL][1], "ulps": 1}
    return calls


def dampers(options):
    """Each filling as it is, and with each effect left out or added."""
    shared = {"particles": 30, "seeds": (1, 2), "ratios": options.ratios, "cycles": options.cycles}
    return {
        scene: (damper, {"filling": filling, "step": STEPS[filling], "options": chosen, **shared})
        for filling, scenes in FILLINGS.items()
        for scene, chosen in scenes.items()
    }


def row_of(group, scene, repeats, complete):
    """Row of a scene's table; complete: results of the group's first scene."""
    failed = repeats[0].get("failed", "")
    result = blast_result if group == "blast" else damper_result
    known = complete if failed else repeats
    columns = {**costs(known, complete), **result(scene, known[0], complete[0])}
    row = {"group": group, "scene": scene, "failed": failed}
    return {**row, **(dict.fromkeys(columns) if failed else columns)}


def costs(repeats, complete):
    """What a run cost, and what share of a step of the complete scene it spares."""
    first = repeats[0]
    times, others = ([1e3 * r["run_s"] / r["steps"] for r in some] for some in (repeats, complete))
    low, high, least, most = min(times), max(times), min(others), max(others)
    return {
        "step_ms": low,
        "step_ms_most": high,
        "run_s": 1e-3 * low * first["steps"],
        "spared_percent": 100.0 * (1.0 - low / least),
        # From the slowest of its repeats beside the fastest of the others to the reverse.
        "spared_least_percent": 100.0 * (1.0 - high / least),
        "spared_most_percent": 100.0 * (1.0 - low / most),
        "memory_MB": first["memory_MB"],
        "before_first_step_s": first["compile_s"],
        "compiled_kB": first["compiled_kB"],
    }


def blast_result(scene, found, complete):
    """Result of a blast; the share of energy is that of the first effect that is left out."""
    share = complete["shares"].get(scene.replace("without ", "").split()[0])
    hole, wanted = found["hole_mm"], complete["hole_mm"]
    return {
        "hole_mm": hole,
        "broken_faces": found["broken_faces"],
        "energy_percent": None if share is None else 100.0 * share,
        "change_percent": 100.0 * abs(hole - wanted) / abs(wanted),
    }


def damper_result(scene, found, complete):
    """Peak of a response; the change is the distance to that of the complete filling.

    For the complete filling it is half of the distance of two seeds: what the mean over them may
    owe to chance.
    """
    curve, (one, other) = np.mean(found["rms_mm"], axis=0), complete["rms_mm"]
    change = 100.0 * curve_distance(curve, np.mean(complete["rms_mm"], axis=0))
    if found is complete:
        change = 50.0 * curve_distance(one, other)
    return {"peak_mm": float(curve.max()), "change_percent": change}


def effects_in(rows):
    """(Name, row, sign) of each effect that was left out alone, or added: then the sign is -1."""
    for row in rows[1:]:
        name = row["scene"].replace("without ", "")
        if row["group"] != "blast" or name != row["scene"] or name in ADDED:
            yield name, row, -1.0 if name in ADDED else 1.0


def chance_in(rows):
    """Change of the result by chance [%]: seeds, or the last bit of the load; None if not tried."""
    scene = LAST_BIT if rows[0]["group"] == "blast" else rows[0]["scene"]
    return next((row["change_percent"] for row in rows if row["scene"] == scene), None)


def figures_of(tables, elastic):
    """Overhead of what is absent; for each effect what it adds, and what its absence changes."""
    # Each against its neighbour in time: a machine is never equally fast for long.
    ratio = np.array(elastic["composed"]) / np.array(elastic["by_hand"])
    low, middle, high = 100.0 * (np.percentile(ratio, [25, 50, 75]) - 1.0)
    overhead = {"": middle, "_low": low, "_high": high}
    found = {f"overhead_absent{end}_percent": (value, "%") for end, value in overhead.items()}
    found["blast_seconds"] = tables["blast"][0]["run_s"], "s"
    if chance_in(tables["blast"]) is not None:
        found["blast_chance_percent"] = chance_in(tables["blast"]), "%"
    for group, rows in tables.items():
        for name, row, sign in effects_in(rows):
            own, known = group == "blast", not row["failed"]
            key = f"{group}_{name.replace(' ', '_')}"
            if own:
                key = CONTACTS.get(name, name.split()[0])
            for column, unit in ADDS.items():
                more = sign * (rows[0][column] - row[column]) if known else None
                found[f"{key}_{column.replace('run_s', 'seconds')}"] = more, unit
            what = "displacement" if own else "response"
            found[f"{key}_{what}_change_percent"] = row["change_percent"], "%"
            if own:
                more = row["broken_faces"] - rows[0]["broken_faces"] if known else None
                found[f"{key}_broken_faces_change"] = more, "1"
    return {key: study.figure(value, unit) for key, (value, unit) in found.items()}


def show(rows, title):
    """Print the rows, and why some of them failed."""
    print(f"\n{title}")
    forms = {"scene": "", "broken_faces": ""}
    names = [name for name in rows[0] if name not in HIDDEN]
    study.show_rows(rows, {name: (name, forms.get(name, ".3g")) for name in names})
    for row in rows:
        if row["failed"]:
            print(f"{row['scene']}: {row['failed']}")


def picture_effects(path, tables):
    """Bars, a row of panels for each table: what an effect costs, what changes without it."""
    titles = ("Blast of the paper's block", "Damper, spheres", "Damper, automaton")
    shown = [[one for one in effects_in(rows) if not one[1]["failed"]] for rows in tables.values()]
    heights = [max(1, len(effects)) for effects in shown]
    size = (9.4, 1.6 + 0.42 * sum(heights) + 0.7 * len(heights))
    ratios = {"height_ratios": heights, "width_ratios": [1, 1.25]}
    with picture(path, len(heights), 2, size, squeeze=False, gridspec_kw=ratios) as (figure, axes):
        for (left, right), title, effects, rows in zip(axes, titles, shown, tables.values()):
            left.set_title(title, fontweight="bold")
            left.sharex(axes[0, 0])
            draw_costs(left, effects)
            draw_changes(right, effects, chance_in(rows) or 0.0)
        single = all(row["step_ms"] == row["step_ms_most"] for row in tables["blast"])
        unknown = ": unknown, one run each" * single
        marks = [
            line_key(f"range of the repeats{unknown}", color=BLACK, lw=1.0),
            area_key("no cost told: that range holds 0", fc=SKY),
            area_key("change by chance alone (round-off, seeds)", fc=GREY, alpha=0.3),
        ]
        figure.legend(handles=marks, loc="outside lower right", ncols=3)
        figure.suptitle("What does an effect cost, and what is it good for?")


def draw_costs(axes, effects):
    """Bars with the range of the repeats; pale where that holds 0, so that no cost is told."""
    for place, (_, row, sign) in enumerate(effects):
        cost, *ends = (sign * row[f"spared_{end}percent"] for end in ("", "least_", "most_"))
        least, most = sorted(ends)
        hidden = least <= 0.0 <= most
        axes.barh(place, cost, color=SKY if hidden else BLUE, height=0.6)
        axes.plot([least, most], [place, place], color=BLACK, linewidth=1.0)
        words = f"  {cost:.0f} %, within the spread" if hidden else f"  {cost:.0f} %"
        axes.text(max(most, 0.0), place, words, va="center", fontsize=8.5)
    names = [f"{name} (added)" if sign < 0.0 else name for name, _, sign in effects]
    names = [name.replace("_", " ").replace(" and ", "\nand ") for name in names]
    axes.set(yticks=range(len(names)), yticklabels=names)
    axes.set_xlabel("cost: share of a step's time [%], below 0: slower without it")
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.margins(x=0.3)
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)


def draw_changes(axes, effects, chance):
    """Bars on a logarithmic scale, over a stripe of what chance changes."""
    changes, ticks = [row["change_percent"] for _, row, _ in effects], (0.01, 0.1, 1.0, 10.0, 100.0)
    axes.axvspan(ticks[0], max(chance, ticks[0]), color=GREY, alpha=0.3, linewidth=0)
    bars = axes.barh(range(len(changes)), np.maximum(changes, ticks[0]), color=RED, height=0.6)
    words = [f"{value:.0f} %" if value >= 10.0 else f"{value:.2g} %" for value in changes]
    axes.bar_label(bars, words, padding=3, fontsize=8.5)
    axes.set(xscale="log", xlim=(ticks[0], 2e3), yticks=[])
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.invert_yaxis()
    axes.set_xlabel("use: change of the result without it [%]")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
