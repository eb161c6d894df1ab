"""The picture of ``cost_of_effects.py``: what an effect costs beside what it is good for."""

from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED, area_key, line_key, picture

#: Changes are drawn from the first on [%].
_TICKS = (0.01, 0.1, 1.0, 10.0, 100.0)


def picture_effects(path, parts):
    """Bars in two columns, a row of panels for each part.

    parts: (title, effects, chance): effects as (name, cost [%] with its least and most over the
    repeats, change [%]); chance [%]: what the result owes to round-off or to its seed.
    """
    heights = [max(1, len(effects)) for _, effects, _ in parts]
    size = (9.4, 1.6 + 0.42 * sum(heights) + 0.7 * len(parts))
    options = {"gridspec_kw": {"height_ratios": heights, "width_ratios": [1, 1.25]}}
    with picture(path, len(parts), 2, size, squeeze=False, **options) as (figure, axes):
        for (left, right), (title, effects, chance) in zip(axes, parts):
            left.set_title(title, fontweight="bold")
            _costs(left, effects)
            _changes(right, effects, chance)
        low = min(ax.get_xlim()[0] for ax in axes[:, 0])
        high = max(ax.get_xlim()[1] for ax in axes[:, 0])
        for ax in axes[:, 0]:
            ax.set_xlim(low, 1.2 * high)
        for left, right in axes:
            left.set_xlabel("cost: share of a step's time [%], below 0: slower without it")
            right.set_xlabel("use: change of the result without it [%]")
        marks = [line_key("range of the repeats", color=BLACK, lw=1.0)]
        marks.append(area_key("change by chance alone (round-off, seeds)", fc=GREY, alpha=0.3))
        figure.legend(handles=marks, loc="outside lower right", ncols=2)
        figure.suptitle("What does an effect cost, and what is it good for?")


def _costs(ax, effects):
    names = [name.replace("_", " ").replace(" and ", "\nand ") for name, _, _ in effects]
    ax.barh(names, [cost for _, (cost, _, _), _ in effects], color=BLUE, height=0.6)
    for place, (_, (cost, least, most), _) in enumerate(effects):
        ax.plot([least, most], [place, place], color=BLACK, linewidth=1.0)
        ax.text(max(most, 0.0) + 2.0, place, f"{cost:.0f} %", va="center", fontsize=8.5)
    ax.axvline(0.0, color=GREY, linewidth=0.8)
    ax.invert_yaxis()
    ax.grid(axis="y", visible=False)


def _changes(ax, effects, chance):
    changes = [change for _, _, change in effects]
    ax.axvspan(_TICKS[0], max(chance, _TICKS[0]), color=GREY, alpha=0.3, linewidth=0)
    shown = [max(change, _TICKS[0]) for change in changes]
    bars = ax.barh(range(len(effects)), shown, color=RED, height=0.6)
    ax.bar_label(bars, [_percent(change) for change in changes], padding=3, fontsize=8.5)
    ax.set_xscale("log")
    ax.set_xlim(_TICKS[0], 2e3)
    ax.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
    ax.set_xticks([], minor=True)
    ax.set_yticks([])
    ax.invert_yaxis()


def _percent(value):
    return f"{value:.0f} %" if value >= 10.0 else f"{value:.2g} %"
