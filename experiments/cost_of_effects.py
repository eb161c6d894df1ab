"""What does each effect cost, and what does the result lose without it?

    python experiments/cost_of_effects.py
    python experiments/cost_of_effects.py --quick

Effects are left out one by one of the blast of the paper's block.

- What an effect costs: CPU seconds of a step with and without it, from the same states. States of
  the run with all effects are loaded into every other scene, and all scenes take turns in random
  order. The interval is that of the timing; the states represent equal parts of the run. Contacts
  of another kind start from states of their own run, as their lists must be equally old.
- What it is good for: the change of the hole's displacement in runs without it.

Writes effects.png, effects.csv and summary.json to results/cost_of_effects/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import taichi_dem as dem
from _effects import ORDER, PEAK, costs_of_blast, scene_of
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, SKY, area_key, line_key, picture
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "cost_of_effects"
#: What is left out together: nothing sticks without contact.
LEFT_OUT = [(name, "sticking_friction") if name == "body_contact" else (name,) for name in ORDER]
#: Contact and friction in the place of those of bodies, by row: the paper's, then on all faces.
CONTACTS = {"contact of spheres": "sphere_contact", "spheres on all faces": "surface_contact"}
#: Names of effects by what is left out or replaced; the complete scene first.
SCENES = {
    "": ORDER,
    **{" and ".join(out): [e for e in ORDER if e not in out] for out in LEFT_OUT},
    **{name: [*ORDER[:3], one, "friction"] for name, one in CONTACTS.items()},
}
SETTINGS = {
    "until": (2.5e-4, 1e-4, study.number(0, 1), "simulated time of the blast [s], default 2.5e-4"),
    "rounds": (40, 10, study.whole(6, 10_000), "rounds from the same states, default 40"),
    "states": (8, 4),
    "substeps": (16, 8),
    # In the quick job every scene compiles.
    "scenes": (tuple(SCENES), ("", "shear_slip")),
}
#: Step [s].
DT = 4e-7
#: Cost of a step, between the ends of its interval.
STEP = ("step_low_percent", "step_percent", "step_high_percent")
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def hole(names, until, peak=PEAK):
    """Displacement of the hole [m] with effects by name."""
    method, looks = dem.ImplicitDashpots(DT), {"samples": 1, "frames": 1}
    result = dem.simulate(scene_of(names, peak), method=method, until=until, **looks)
    return dem.goals.hole_displacement().value(result)


def rows_of(options):
    """Rows of all scenes; of the complete one the change is that by chance."""
    scenes, until = {name: SCENES[name] for name in options.scenes}, options.until
    holes = {name: hole(names, until) for name, names in scenes.items()}
    change = {name: abs(one / holes[""] - 1.0) for name, one in holes.items()}
    # A gas whose pressure differs in the last bit: nobody would notice but a chaotic run.
    change[""] = abs(hole(ORDER, until, np.nextafter(PEAK, np.inf)) / holes[""] - 1.0)
    costs = costs_of_blast(scenes, until, DT, options.states, options.substeps, options.rounds)
    rows = []
    for name, cost in costs.items():
        # A contact in the place of the complete scene's costs what that one spares.
        sign = -1.0 if name in CONTACTS else 1.0
        spared = sorted(100.0 * sign * (1.0 - one) for one in cost)
        row = {"effect": name, **dict(zip(STEP, spared))}
        rows.append({**row, "change_percent": 100.0 * change[name]})
    return rows


def draw(path, table):
    """Bars: what an effect costs, what changes without it."""
    rows, size = table.iloc[1:], (9.2, 1.8 + 0.45 * len(table))
    with picture(path, 1, 2, size, width_ratios=(1, 1.25)) as (figure, (left, right)):
        draw_costs(left, rows)
        draw_changes(right, rows.change_percent, table.change_percent.iloc[0])
        marks = [
            line_key("95 % interval, from the same states", color=BLACK, lw=1.0),
            area_key("not resolved: that interval holds 0", fc=SKY),
            area_key("change by chance alone (round-off)", fc=GREY, alpha=0.3),
        ]
        figure.legend(handles=marks, loc="outside lower right", ncols=3)
        figure.suptitle("Blast of the paper's block: what an effect costs, and what it changes")


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
    names = [f"{one}\n(instead)" if one in CONTACTS else one for one in rows.effect]
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
    folder = study.begin(options)
    with ProgressBar("comparing") as bar:
        bar.at(0.0)
        table = pd.DataFrame(rows_of(options))
    table.to_csv(folder / "effects.csv", index=False)
    draw(folder / "effects.png", table)
    figures = {}
    for row in table.itertuples():
        key = f"blast_{row.effect or 'chance'}".replace(" ", "_")
        figures[f"{key}_change_percent"] = row.change_percent, "%"
        if row.effect:
            figures.update({f"{key}_{name}": (getattr(row, name), "%") for name in STEP})
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
