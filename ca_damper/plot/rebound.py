"""Fall and rebound of one particle in a container at rest (Komatsuzaki et al., Fig. 8)."""

import numpy as np

from taichi_dem.kit.plot_style import BLACK, VIOLET, picture, styles_of

#: Errors below this [ms] would lengthen a logarithmic axis for nothing.
_SHORTEST = 5e-3
#: First impact to fourth: light to dark, as no colour of a filling is meant.
_SHADES = ("#D0D0D0", "#A0A0A0", "#6A6A6A", "#2A2A2A")


def plot_rebound(path, falls, errors, allowed_ms):
    """Height over time beside the closed form, and errors of the times of impact.

    falls: name of the filling -> (time [s], height [m], time and height of the closed form, its
    title).
    errors: title -> errors of the impacts [ms], as many as there were. allowed_ms: the largest
    that passes, a line.
    """
    mosaic = [["first", "errors"], ["second", "errors"]]
    with picture(path, 0, 0, size=(10.4, 4.6)) as (figure, _):
        panels = figure.subplot_mosaic(mosaic, width_ratios=[1.7, 1.0])
        until = max(time[-1] for time, *_ in falls.values())
        pair = (panels["first"], panels["second"])
        for axes, (name, fall) in zip(pair, falls.items()):
            _plot_fall(axes, styles_of(falls)[name], fall)
            axes.set(xlim=(0.0, until), ylim=(-3.0, None), ylabel="height over floor [mm]")
        panels["first"].tick_params(labelbottom=False)
        panels["second"].set_xlabel("time [s]")
        _plot_errors(panels["errors"], errors, allowed_ms)


def _plot_fall(axes, style, fall):
    time, height, exact_time, exact_height, exact_title = fall
    axes.plot(exact_time, 1e3 * exact_height, color=BLACK, linewidth=0.9, label=exact_title)
    every = max(1, len(time) // 130)
    points = time[::every], 1e3 * height[::every]
    look = {"color": style.colour, "markersize": 3.6, "markerfacecolor": "none"}
    axes.plot(*points, style.marker, label=style.label, **look)
    axes.legend(loc="upper right")


def _plot_errors(axes, errors, allowed_ms):
    titles = list(errors)
    count = max(len(values) for values in errors.values())
    for k in range(count):
        there = [row for row, title in enumerate(titles) if k < len(errors[title])]
        values = [max(_SHORTEST, abs(errors[titles[row]][k])) for row in there]
        rows = np.array(there) + 0.19 * (k - 0.5 * (count - 1))
        axes.barh(rows, values, 0.17, color=_SHADES[k % len(_SHADES)], label=f"impact {k + 1}")
    words = f"most that passes, {allowed_ms:g} ms"
    axes.axvline(allowed_ms, color=VIOLET, linewidth=1.0, linestyle="--", label=words)
    axes.set_yticks(range(len(titles)), titles)
    axes.set(xscale="log", xlabel="error of the time of impact [ms]")
    axes.set_xlim(_SHORTEST, None)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=2, columnspacing=1.2)
