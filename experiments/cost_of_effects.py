"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py          # about four minutes on one core
    python experiments/cost_of_effects.py --quick

Effects are left out one by one of the blast of the paper's block, and of a response curve of the
damper by spheres and by the automaton.

- What an effect costs: CPU seconds of a step with and without it, from the same states. States of
  the run with all effects are loaded into every other scene, and all scenes take turns in random
  order. The interval is that of the timing; the states represent equal parts of the run. Contacts
  of another kind start from states of their own run, as their lists must be equally old.
- What it is good for: the change of the hole's displacement, or of the response, in runs without
  it.

Writes effects.png, effects.csv and summary.json to results/cost_of_effects/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import taichi_dem as dem
from _effects import ORDER, PEAK, batch_of, costs_of_blast, costs_of_damper, scene_of
from ca_damper.report.measures import curve_distance
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, SKY, area_key, line_key, picture
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "cost_of_effects"
#: What is left out together: nothing sticks without contact.
LEFT_OUT = [(name, "sticking_friction") if name == "body_contact" else (name,) for name in ORDER]
#: Contact and friction in the place of those of bodies, by row: the paper's, then on all faces.
CONTACTS = {"contact of spheres": "sphere_contact", "spheres on all faces": "surface_contact"}
ADDED = {"rotation": "added", **dict.fromkeys(CONTACTS, "instead")}
#: Names of effects, or options of a filling, by what is left out or added; the complete one first.
SCENES = {
    "blast": {
        "": ORDER,
        **{" and ".join(out): [e for e in ORDER if e not in out] for out in LEFT_OUT},
        **{name: [*ORDER[:3], one, "friction"] for name, one in CONTACTS.items()},
    },
    "spheres": {
        "": {},
        "friction of spheres": {"friction": 0.0},
        "friction at walls": {"wall_friction": 0.0},
        "rotation": {"rotation": True},
    },
    "automaton": {
        "": {},
        "static contact": {"accounting": "landing+ejection"},
        "ejection and static contact": {"accounting": "landing"},
    },
}
#: In the quick job every scene compiles.
QUICK = {"blast": ("", "shear_slip"), "spheres": ("", "friction of spheres")}
SETTINGS = {
    "until": (2.5e-4, 1e-4, study.number(0, 1), "simulated time of the blast [s], default 2.5e-4"),
    "rounds": (40, 10, study.whole(6, 10_000), "rounds from the same states, default 40"),
    "states": (8, 4),
    "substeps": (16, 8),
    "ratios": ((0.88, 0.91, 0.94, 0.96, 0.98, 1.0, 1.03), (0.92, 0.98)),
    "cycles": ((60, 20), (10, 4)),
    "scenes": (SCENES, QUICK),
}
STEPS = {"blast": 4e-7, "spheres": 3e-5, "automaton": 1e-4}
#: Steps of a damper from a state, about a tenth of a cycle.
TENTH = {"spheres": 600, "automaton": 180}
TITLES = {"spheres": "Damper, spheres", "automaton": "Damper, automaton"}
TITLES["blast"] = "Blast of the paper's block"
#: Cost of a step, between the ends of its interval.
STEP = ("step_low_percent", "step_percent", "step_high_percent")
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def rows_of_blast(scenes, options):
    """Rows of the blast: cost of each effect, and change of the hole's displacement without it."""
    until, step = options.until, STEPS["blast"]

    def hole(names, peak=PEAK):
        method = dem.ImplicitDashpots(step)
        result = dem.simulate(
            scene_of(names, peak), method=method, until=until, samples=1, frames=1
        )
        return dem.goals.hole_displacement().value(result)

    holes = {name: hole(names) for name, names in scenes.items()}
    # A gas whose pressure differs in the last bit: nobody would notice but a chaotic run.
    chance = abs(hole(ORDER, np.nextafter(PEAK, np.inf)) / holes[""] - 1.0)
    change = {name: abs(one / holes[""] - 1.0) for name, one in holes.items()}
    costs = costs_of_blast(scenes, until, step, options.states, options.substeps, options.rounds)
    return rows_of("blast", costs, {**change, "": chance})


def rows_of_damper(filling, scenes, options):
    """Rows of a filling: cost of each option, and change of the response curve without it."""
    (transient, measured), curves = options.cycles, {}
    table = {"particles": 30, "seeds": (1, 2), "ratios": options.ratios, "step": STEPS[filling]}
    table["measured_cycles"] = measured
    for name, own in scenes.items():
        rms = batch_of(filling, own, **table).run(transient, measured).rms
        curves[name] = rms.reshape(len(table["seeds"]), -1)
    change = {name: curve_distance(one.mean(0), curves[""].mean(0)) for name, one in curves.items()}
    # Half of the distance of two seeds: what the mean may owe to chance.
    change[""] = 0.5 * curve_distance(*curves[""])
    given = filling, scenes, table, transient, options.states, TENTH[filling], options.rounds
    return rows_of(filling, costs_of_damper(*given), change)


def rows_of(group, costs, change):
    """Rows of a group; of the complete scene the change is that by chance."""
    rows = []
    for name, cost in costs.items():
        # What was added costs what the complete scene spares.
        sign = -1.0 if name in ADDED else 1.0
        spared = sorted(100.0 * sign * (1.0 - one) for one in cost)
        row = {"group": group, "effect": name, **dict(zip(STEP, spared))}
        rows.append({**row, "change_percent": 100.0 * change[name]})
    return rows


def draw(path, table):
    """Bars, a row of panels for each group: what an effect costs, what changes without it."""
    groups = dict([*table.groupby("group", sort=False)])
    heights = [len(rows) - 1 for rows in groups.values()]
    size = (9.2, 1.6 + 0.42 * sum(heights) + 0.7 * len(heights))
    ratios = {"height_ratios": heights, "width_ratios": [1, 1.25]}
    with picture(path, len(heights), 2, size, squeeze=False, gridspec_kw=ratios) as (figure, axes):
        for (left, right), (group, rows) in zip(axes, groups.items()):
            left.set_title(TITLES[group], fontweight="bold")
            left.sharex(axes[0, 0])
            draw_costs(left, rows.iloc[1:])
            draw_changes(right, rows.change_percent.iloc[1:], rows.change_percent.iloc[0])
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
    axes.axvspan(ticks[0], max(ticks[0], chance), color=GREY, alpha=0.3, linewidth=0)
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
    folder, rows = study.begin(options), []
    with ProgressBar("comparing") as bar:
        for done, (group, names) in enumerate(options.scenes.items()):
            bar.count(done, len(options.scenes))
            scenes = {name: SCENES[group][name] for name in names}
            given = (scenes, options) if group == "blast" else (group, scenes, options)
            rows += (rows_of_blast if group == "blast" else rows_of_damper)(*given)
    table = pd.DataFrame(rows)
    table.to_csv(folder / "effects.csv", index=False)
    draw(folder / "effects.png", table)
    figures = {}
    for row in table.itertuples():
        key = f"{row.group}_{row.effect or 'chance'}".replace(" ", "_")
        figures[f"{key}_change_percent"] = row.change_percent, "%"
        if row.effect:
            figures.update({f"{key}_{name}": (getattr(row, name), "%") for name in STEP})
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
