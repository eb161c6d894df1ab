"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py          # about four minutes on two cores
    python experiments/cost_of_effects.py --quick

Effects are left out one by one of the blast of the paper's block, and of a response curve of the
damper by spheres and by the automaton.

- What an effect costs: CPU seconds of a step with and without it, from the same states. States of
  the run with all effects are loaded into every other scene. All scenes take turns in one process,
  in random order, until the 95 % interval of the ratio is small or the rounds are used up. The
  interval is that of the timing; the states represent equal parts of the run. Contacts of another
  kind start from states of their own run, as their lists must be equally old.
- What else it takes: every scene also runs in a process of its own with an empty cache of kernels:
  memory of all fields, CPU seconds before the first step, size of the compiled kernels.
- What it is good for: the displacement of the hole and the broken faces, or the response, of those
  runs.

An effect that is left out of a scene must cost nothing: an elastic block is timed against a step
stripped by hand. For some scenes the shortest sufficient list of effects is known: the cost of all
effects there is listed too.

Writes effects.png, blast.csv, spheres.csv, automaton.csv, lists.csv and summary.json to
results/cost_of_effects/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

from _effects import KNOWN_LISTS, ORDER, absent, blast, costs_of_blast, costs_of_damper, damper
from ca_damper.report.measures import curve_distance
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, SKY, area_key, line_key, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.timing import median_interval

NAME = "cost_of_effects"
ALL, LAST_BIT = "all effects", "all effects, last bit of the load changed"
#: What is left out together: nothing sticks without contact.
LEFT_OUT = [(name, "sticking_friction") if name == "body_contact" else (name,) for name in ORDER]
LESS = {f"without {' and '.join(out)}": [e for e in ORDER if e not in out] for out in LEFT_OUT}
#: Contact and friction in the place of those of bodies, by row: the paper's, then on all faces.
CONTACTS = {"contact of spheres": "sphere_contact", "spheres on all faces": "surface_contact"}
INSTEAD = {scene: [*ORDER[:3], contact, "friction"] for scene, contact in CONTACTS.items()}
ADDED = {"rotation": "added", **dict.fromkeys(CONTACTS, "instead")}
#: Scenes by group, the complete one first: arguments of a run that are its own.
SCENES = {
    "blast": {name: {"names": one} for name, one in {ALL: ORDER, **LESS, **INSTEAD}.items()},
    "spheres": {
        "spheres as they are": {"options": {}},
        "friction of spheres": {"options": {"friction": 0.0}},
        "friction at walls": {"options": {"wall_friction": 0.0}},
        "rotation": {"options": {"rotation": True}},
    },
    "automaton": {
        "automaton as they are": {"options": {}},
        "static contact": {"options": {"accounting": "landing+ejection"}},
        "ejection and static contact": {"options": {"accounting": "landing"}},
    },
}
SCENES["blast"][LAST_BIT] = {"names": ORDER, "ulps": 1}
#: In the quick job every scene compiles in a process of its own.
QUICK = {"blast": (ALL, [*LESS][3]), "spheres": ("spheres as they are", "friction of spheres")}
SETTINGS = {
    "until": (2.5e-4, 1e-4, study.number(0, 1), "simulated time of the blast [s], default 2.5e-4"),
    "rounds": (60, 10, study.whole(1, 10_000), "most rounds from the same states, default 60"),
    "half_width": (0.01, 0.02, study.number(0, 1), "of the 95 % interval of a cost, default 0.01"),
    "states": (8, 4),
    "substeps": (16, 8),
    "lists": ((*KNOWN_LISTS,), ("blast",)),
    "certified": (5e-4, 1e-4),
    "ratios": ((0.88, 0.91, 0.94, 0.96, 0.98, 1.0, 1.03), (0.92, 0.98)),
    "cycles": ((60, 20), (10, 4)),
    "again": (100, 20),
    "scenes": (SCENES, QUICK),
}
#: Substeps that the elastic block is timed over at a time, and fewest rounds of turns.
SUBSTEPS, FEWEST = 150, 8
STEPS = {"blast": 4e-7, "spheres": 3e-5, "automaton": 1e-4}
#: Steps of a damper from a state, about a tenth of a cycle.
TENTH = {"spheres": 600, "automaton": 180}
TITLES = {"spheres": "Damper, spheres", "automaton": "Damper, automaton"}
TITLES["blast"] = "Blast of the paper's block"
#: Ends of the interval of an effect's cost, and the cost between them.
STEP = ("step_low_percent", "step_percent", "step_high_percent")
#: Results of a run that are no columns.
UNTOLD = ("run_s", "steps", "rms_mm")
#: Threads are processes side by side.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def shared_of(group, options):
    """Arguments that the runs of a group share."""
    if group == "blast":
        return {"until": options.until, "step": STEPS[group]}
    table = {"particles": 30, "seeds": (1, 2), "ratios": options.ratios, "step": STEPS[group]}
    table["measured_cycles"] = options.cycles[1]
    return {"filling": group, "table": table, "transient": options.cycles[0]}


def costs_of(group, options, results):
    """Costs of a step by scene, under the group's name, of scenes whose own run ended well."""
    job = {**shared_of(group, options), "rounds": (FEWEST, options.rounds)}
    job.update(half_width=options.half_width, states=options.states)
    good = [scene for scene in options.scenes[group] if "failed" not in results[group, scene]]
    job["scenes"] = {scene: SCENES[group][scene] for scene in good if scene != LAST_BIT}
    if group != "blast":
        return study.call_in_process(costs_of_damper, **job, substeps=TENTH[group])
    job.update(lists=options.lists, certified=options.certified, substeps=options.substeps)
    return study.call_in_process(costs_of_blast, **job)


def table_of(group, results, costs):
    """Table of a group, the complete scene first. sign: -1 of what was added."""
    own = {scene: found for (of, scene), found in results.items() if of == group}
    rows, complete = [], next(iter(own.values()))
    for scene, found in own.items():
        name = scene.removeprefix("without ")
        key = CONTACTS.get(name, name.split()[0]) if group == "blast" else f"{group} {name}"
        row = {"group": group, "scene": scene, "key": key.replace(" ", "_")}
        row["sign"] = sign = -1.0 if name in ADDED else 1.0
        row.update(effect="" if scene in (ALL, LAST_BIT) else name, failed=found.get("failed", ""))
        rows.append(row)
        if scene in costs:
            # By ratio and not by seconds, which differ from round to round with the machine's load.
            base, cost = next(iter(costs.values()))["seconds"], costs[scene]
            spared = sorted(sign * (1.0 - cost[end]) for end in ("low", "ratio", "high"))
            row.update(zip(STEP, np.multiply(100.0, spared)), step_ms=1e3 * base * cost["ratio"])
            row["seconds"] = spared[1] * base * found["steps"]
        if not row["failed"]:
            row.update({name: found[name] for name in found if name not in UNTOLD})
            row.update(change_of(found, complete))
    return pd.DataFrame(rows).dropna(axis=1, how="all")


def change_of(found, complete):
    """By how much a result differs from that of the complete scene."""
    if "hole_mm" in found:
        hole, wanted = found["hole_mm"], complete["hole_mm"]
        return {"change_percent": 100.0 * abs(hole - wanted) / abs(wanted)}
    # Of the complete filling half of the distance of two seeds: what the mean may owe to chance.
    curve, (one, other) = np.mean(found["rms_mm"], axis=0), complete["rms_mm"]
    change = 100.0 * curve_distance(curve, np.mean(complete["rms_mm"], axis=0))
    if found is complete:
        change = 50.0 * curve_distance(one, other)
    return {"change_percent": change, "peak_mm": curve.max()}


def figures_of(table):
    """What each effect adds to a run and to a step, and what its absence changes."""
    figures, first = {}, table.iloc[0]
    for _, row in effects_in(table).iterrows():
        for column, unit in {"memory_MB": "MB", "compiled_kB": "kB"}.items():
            figures[f"{row.key}_{column}"] = row.sign * (first[column] - row[column]), unit
        units = {"seconds": "s", **dict.fromkeys(STEP, "%")}
        figures.update({f"{row.key}_{name}": (row[name], unit) for name, unit in units.items()})
        what = "displacement" if row.group == "blast" else "response"
        figures[f"{row.key}_{what}_change_percent"] = row.change_percent, "%"
        if row.group == "blast":
            more = row.broken_faces - first.broken_faces
            figures[f"{row.key}_broken_faces_change"] = more if pd.isna(more) else int(more), "1"
    return figures


def effects_in(table):
    """Rows of effects that were left out alone, or added; not the complete scene."""
    return table.iloc[1:][table.effect.iloc[1:] != ""]


def draw(path, tables):
    """Bars, a row of panels for each table: what an effect costs, what changes without it."""
    shown = [effects_in(one)[lambda rows: rows.failed == ""] for one in tables.values()]
    heights = [max(1, len(rows)) for rows in shown]
    size = (9.2, 1.6 + 0.42 * sum(heights) + 0.7 * len(heights))
    ratios = {"height_ratios": heights, "width_ratios": [1, 1.25]}
    with picture(path, len(heights), 2, size, squeeze=False, gridspec_kw=ratios) as (figure, axes):
        for (left, right), (group, table), rows in zip(axes, tables.items(), shown):
            left.set_title(TITLES[group], fontweight="bold")
            left.sharex(axes[0, 0])
            chance = table[table.scene == (LAST_BIT if group == "blast" else table.scene[0])]
            draw_costs(left, rows)
            draw_changes(right, rows.change_percent, max([0.01, *chance.change_percent]))
        marks = [
            line_key("95 % interval, from the same states", color=BLACK, lw=1.0),
            area_key("not resolved: that interval holds 0", fc=SKY),
            area_key("change by chance alone (round-off, seeds)", fc=GREY, alpha=0.3),
        ]
        figure.legend(handles=marks, loc="outside lower right", ncols=3)
        figure.suptitle("What does an effect cost, and what does it change?")


def draw_costs(axes, rows):
    """Bars with the interval; pale where that holds 0, so that the cost is not resolved."""
    (least, cost, most), places = rows[[*STEP]].to_numpy().T, range(len(rows))
    hidden = [bool(low <= 0.0 <= high) for low, high in zip(least, most)]
    axes.barh(places, cost, color=np.where(hidden, SKY, BLUE), height=0.6)
    axes.plot([least, most], [places, places], color=BLACK, linewidth=1.0, marker="|")
    for place, value in enumerate(cost):
        text = f"  {value:z.{int(abs(value) < 10.0)}f} %" + ", not resolved" * hidden[place]
        end = max(most[place], 0.0)
        axes.text(end, place, text.replace("-", "−"), va="center", fontsize=8.5)
    names = [f"{one}\n({ADDED[one]})" if one in ADDED else one for one in rows.effect]
    names = [name.replace("_", " ").replace(" and ", "\nand ") for name in names]
    axes.set(yticks=places, yticklabels=names)
    axes.set_xlabel("cost: share of a step's time [%], below 0: slower without it")
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.margins(x=0.3)
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)


def draw_changes(axes, changes, chance):
    """Bars on a logarithmic scale, over a stripe of what chance changes."""
    ticks = (0.01, 0.1, 1.0, 10.0, 100.0)
    axes.axvspan(ticks[0], chance, color=GREY, alpha=0.3, linewidth=0)
    bars = axes.barh(range(len(changes)), np.maximum(changes, ticks[0]), color=RED, height=0.6)
    words = [f"{value:.0f} %" if value >= 10.0 else f"{value:.2g} %" for value in changes]
    axes.bar_label(bars, words, padding=3, fontsize=8.5)
    axes.set(xscale="log", xlim=(ticks[0], 2e3), yticks=[])
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    axes.invert_yaxis()
    axes.set_xlabel("use: change of the result without it [%]")


def run(options):
    """Measure, then write and print."""
    folder, calls, costs, figures = study.begin(options), {}, {}, {}
    for group, scenes in options.scenes.items():
        work, shared = blast if group == "blast" else damper, shared_of(group, options)
        calls.update({(group, one): (work, {**shared, **SCENES[group][one]}) for one in scenes})
    with ProgressBar("compiling, measuring") as bar:
        results = study.call_all(calls, options.threads or 1, bar.count)
    with ProgressBar("comparing") as bar:
        for k, group in enumerate(options.scenes, 1):
            costs.update(costs_of(group, options, results))
            bar.count(k, len(options.scenes))
    elastic = study.call_in_process(absent, substeps=SUBSTEPS, repeats=options.again)
    # Each against its neighbour in time: a machine is never equally fast for long.
    ratio = np.array(elastic["composed"]) / np.array(elastic["by_hand"])
    for end, value in zip(("", "_low", "_high"), (np.median(ratio), *median_interval(ratio))):
        figures[f"overhead_absent{end}_percent"] = 100.0 * (value - 1.0), "%"
    figures["blast_seconds"] = results["blast", ALL]["run_s"], "s"
    tables = {group: table_of(group, results, costs[group]) for group in options.scenes}
    for row in tables["blast"].itertuples():
        if row.scene == LAST_BIT:
            figures["blast_chance_percent"] = row.change_percent, "%"
    for group, table in tables.items():
        table.to_csv(folder / f"{group}.csv", index=False)
        print(f"\n{TITLES[group]}: cost of a step, what a run without an effect saves and changes")
        hidden = ["group", "failed", "key", "sign", "effect"]
        print(table.drop(columns=hidden).to_string(float_format="{:.4g}".format))
        print(*(f"{one.scene}: {one.failed}" for one in table.itertuples() if one.failed), sep="\n")
        figures.update(figures_of(table))
    draw(folder / "effects.png", tables)
    listed = pd.concat({scene: pd.DataFrame(by).T for scene, by in costs["lists"].items()})
    listed.to_csv(folder / "lists.csv", index_label=["scene", "list"])
    over = 100.0 * (listed.ratio.xs("auto", level=1) - 1.0)
    figures["auto_overhead_percent"] = over.max(), "%"
    for scene, value in over.items():
        key = scene.replace(",", "").replace(" ", "_")
        figures[f"auto_overhead_{key}_percent"] = value, "%"
    # What comes from another process has lists for tuples.
    figures.update({key: tuple(found) for key, found in costs["certificate"].items()})
    compiling = sum(found.get("before_first_step_s", 0.0) for found in results.values())
    study.finish(options, NAME, figures, compiling)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
