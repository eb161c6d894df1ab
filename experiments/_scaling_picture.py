"""Picture of ``blast_scaling.py``: acceleration and shares, as the paper's Figs 9, 14 and 15."""

import numpy as np

from _scaling_simulate import WAYS, acceleration
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, PURPLE, RED, picture
from taichi_dem.mesh.partition import imbalance

_LOOK = {
    "static": (RED, "-"),
    "polyline": (PURPLE, "--"),
    "rebalanced": (BLUE, "-"),
    "due": (GREEN, "-"),
}


def picture_scaling(path, workers, shared, count, serial, paper, measured):
    """Write the picture.

    workers: a ``Workers``; shared: ``Shared`` by way and number of workers. count: workers of the
    panels below. serial: share of a run that cannot be shared. paper: its
    accelerations with count, fixed and rebalanced. measured: of real threads, by what was stepped:
    (threads, acceleration).
    """
    with picture(path, 2, 2, size=(11.0, 9.0)) as (figure, panels):
        _acceleration(panels[0, 0], workers, shared, count, serial)
        for gain, filled, words in zip(paper, (RED, PURPLE), ("fixed", "rebalanced")):
            look = {"color": filled, "label": f"measured in the paper, {words}"}
            panels[0, 0].plot([count], [gain], "o", **look)
        for mark, (words, (threads, gain)) in zip("*P", measured.items()):
            look = {"color": BLACK, "ms": 9, "ls": "none", "label": f"measured here, {words}"}
            panels[0, 0].plot([threads], [gain], mark, **look)
        panels[0, 0].set(xlim=(0, count + 1), ylim=(0, None))
        words = f"Whole run, simulated workers, {100 * serial:g} % not shared (Fig 14)"
        panels[0, 0].set_title(words)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        _acceleration(panels[0, 1], workers, shared, np.inf, 0.0)
        panels[0, 1].set(xscale="log", yscale="log")
        panels[0, 1].set_title("Contact calculation alone, many simulated workers")
        _shares(panels[1, 0], shared, count)
        _cuts(panels[1, 1], workers, shared["rebalanced"][count].cuts)
        words = "Lines: simulated workers that share the work of one recorded run"
        figure.suptitle(f"{words}; points: measured times of processes or threads")


def _acceleration(axes, workers, shared, most, serial):
    """Acceleration over the number of workers, and what nobody can exceed."""
    for way, (colour, line) in _LOOK.items():
        counts = np.array([count for count in shared[way] if count <= most])
        gains = [acceleration(workers.total, shared[way][c].elapsed, serial) for c in counts]
        axes.plot(counts, gains, line, color=colour, label=WAYS[way])
    bound = counts / (1.0 + serial * (counts - 1.0))
    axes.plot(counts, bound, ":", color=GREY, label="bound: nobody ever waits")
    axes.set(xlabel="workers [1]", ylabel="acceleration [1]")


def _shares(axes, shared, count):
    """Time of every worker over the mean (Fig 15)."""
    numbers = np.arange(1, count + 1)
    for way, (colour, line) in _LOOK.items():
        if way != "due":
            seconds = shared[way][count].seconds
            label = f"{WAYS[way]}: {imbalance(seconds):.3g}"
            axes.step(
                numbers, seconds / seconds.mean(), line, where="mid", color=colour, label=label
            )
    axes.set(
        xlabel="number of the worker [1]",
        ylabel="time of its work / mean [1]",
        ylim=(0.0, 1.4 * axes.get_ylim()[1]),
    )
    axes.set(xlim=(0.5, count + 0.5))
    axes.set_title("Simulated workers: slowest over fastest in the run (Fig 15)")
    axes.legend(loc="upper right")


def _cuts(axes, workers, cuts):
    """Where the shares of bodies begin, over time (Fig 9)."""
    time_ms = 1e3 * workers.record.time
    axes.plot(time_ms, cuts[:, 1:-1], color=BLUE, linewidth=0.5)
    axes.set(xlabel="time [ms]", ylabel="number of the body [1]", ylim=(0, workers.bodies))
    axes.set(xlim=(0.0, time_ms[-1]))
    axes.set_title("Lines: where simulated workers' shares begin (Fig 9)")
