"""Pictures of answers: what they cost, whether their bars hold, and twins that part."""

import numpy as np

from taichi_dem.kit.plot_style import BLUE, GREY, ORANGE, RED, line_key, picture

#: Deviations beyond this many half-widths share the last bar of the histogram.
FARTHEST = 3.0


def draw_cost(path, panels):
    """CPU time against error: answers as a line, single runs with a fixed step as points.

    panels: by title, the answers as (share of the value that the bar is, share that the value is
    off, seconds), and the fixed runs by method as lists of (share off, seconds).
    """
    with picture(path, 1, len(panels), size=(4.5 * len(panels), 4.4), squeeze=False) as (_, axes):
        for one, (title, (answers, fixed)) in zip(axes[0], panels.items()):
            _draw_fixed(one, fixed)
            bars, off, seconds = np.array(answers).T
            look = {"color": BLUE, "zorder": 3}
            one.plot(100.0 * bars, seconds, "-o", label="answer, by its bar", **look)
            one.plot(100.0 * _seen(off), seconds, "x", label="the same, by its true error", **look)
            one.set(xscale="log", yscale="log", title=title, xlabel="error / value [%]")
            one.set_ylabel("CPU time, all runs of an answer [s]")
            one.invert_xaxis()
            one.legend(loc="lower center", bbox_to_anchor=(0.5, 1.1), ncols=2)


def _draw_fixed(axes, fixed):
    for (name, runs), colour, mark in zip(fixed.items(), (ORANGE, RED, GREY), "sDv"):
        off, seconds = np.array(runs).T
        axes.plot(100.0 * _seen(off), seconds, mark, color=colour, label=name, markersize=4)


def _seen(off):
    """Errors that a logarithmic axis can show."""
    return np.maximum(off, 1e-6)


def draw_calibration(path, judged, coverage):
    """Histogram of (value - true) / half-width of its bar, by package; coverage: share inside."""
    edges = np.linspace(-FARTHEST, FARTHEST, 25)
    with picture(path, size=(6.6, 4.2)) as (_, axes):
        axes.axvspan(-1.0, 1.0, color=GREY, alpha=0.15, label="inside the bar")
        found = [np.clip(deviation, -FARTHEST, FARTHEST) for deviation in judged.values()]
        names = [f"{len(deviation)} of the {name}" for name, deviation in judged.items()]
        axes.hist(found, edges, stacked=True, label=names, color=[BLUE, ORANGE][: len(found)])
        axes.set_xlabel("(value − true value) / half-width of the bar [1]; beyond 3 at the ends")
        axes.set_ylabel("answers [1]")
        axes.locator_params(axis="y", integer=True)
        axes.set_title(f"{coverage:.1f} % of the bars hold the true value (95 % meant)")
        axes.legend(fontsize=8)


def draw_parting(path, time_ms, ways, apart, answer):
    """How far bodies have gone in runs that differ by one rounding, and how far these are apart.

    time_ms (frames,). ways (runs, frames): mean way [mm]. apart (runs - 1, frames): difference of
    the usual body, as a share of its way. answer: to the question what the way is at the end.
    """
    with picture(path, 1, 2, size=(9.0, 4.2)) as (_, (left, right)):
        left.plot(time_ms, ways.T, color=BLUE, linewidth=0.8)
        left.set(xlabel="time [ms]", ylabel="mean way of the bodies [mm]")
        left.set_title(f"{len(ways)} runs whose starts differ by one rounding")
        right.semilogy(time_ms[1:], np.maximum(apart[:, 1:].T, 1e-16), color=BLUE, linewidth=0.8)
        right.axhline(answer.tolerance, color=ORANGE)
        right.axvline(1e3 * answer.plan.parting_s, color=RED, linestyle="--")
        right.set(xlabel="time [ms]", ylabel="distance from the first run / way [1]")
        right.set_title("how far they are apart")
        keys = [line_key(f"tolerance, {100 * answer.tolerance:g} %", color=ORANGE)]
        keys.append(line_key("from here on solve sees them part", color=RED, linestyle="--"))
        right.legend(handles=keys, loc="lower right")
