"""Picture of ``cost_of_effects.py``: what an effect costs, what changes without it."""

import numpy as np

from _effects_tables import ADDED, CONTACTS, chance_in, cost_in, effects_in
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, SKY, area_key, line_key, picture


def picture_effects(path, tables):
    """Bars, a row of panels for each table: what an effect costs, what changes without it."""
    titles = ("Blast of the paper's block", "Damper, spheres", "Damper, automaton")
    shown = [[one for one in effects_in(rows) if not one[1]["failed"]] for rows in tables.values()]
    heights = [max(1, len(effects)) for effects in shown]
    size = (9.2, 1.6 + 0.42 * sum(heights) + 0.7 * len(heights))
    ratios = {"height_ratios": heights, "width_ratios": [1, 1.25]}
    with picture(path, len(heights), 2, size, squeeze=False, gridspec_kw=ratios) as (figure, axes):
        for (left, right), title, effects, rows in zip(axes, titles, shown, tables.values()):
            left.set_title(title, fontweight="bold")
            left.sharex(axes[0, 0])
            draw_costs(left, effects)
            draw_changes(right, effects, chance_in(rows) or 0.0)
        marks = [
            line_key("95 % interval, from the same states", color=BLACK, lw=1.0),
            area_key("not resolved: that interval holds 0", fc=SKY),
            area_key("change by chance alone (round-off, seeds)", fc=GREY, alpha=0.3),
        ]
        figure.legend(handles=marks, loc="outside lower right", ncols=3)
        figure.suptitle("What does an effect cost, and what is it good for?")


def draw_costs(axes, effects):
    """Bars with the interval; pale where that holds 0, so that the cost is not resolved."""
    for place, (_, row, sign) in enumerate(effects):
        cost, least, most = cost_in(row, sign)
        hidden = least <= 0.0 <= most
        axes.barh(place, cost, color=SKY if hidden else BLUE, height=0.6)
        axes.plot([least, most], [place, place], color=BLACK, linewidth=1.0, marker="|")
        digits = int(abs(cost) < 10.0)
        # A zero has no sign.
        words = f"  {round(cost, digits) + 0.0:.{digits}f} %" + ", not resolved" * hidden
        axes.text(max(most, 0.0), place, words.replace("-", "−"), va="center", fontsize=8.5)
    words = {name: "instead" if name in CONTACTS else "added" for name in ADDED}
    names = [f"{name}\n({words[name]})" if name in words else name for name, *_ in effects]
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
