"""Pictures of simulated workers: acceleration over their number, the time of each, their cuts."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, PURPLE, RED
from taichi_dem.workload.sharing import WAYS, SharedWork

#: Colour and line by way of sharing.
LOOK = dict(zip(WAYS, ((RED, "-."), (PURPLE, "--"), (BLUE, "-"), (GREEN, (0, (8, 2))))))


def draw_acceleration(
    axes: Any,
    shared: Mapping[str, Mapping[int, SharedWork]],
    most: float = np.inf,
    serial: float = 0.0,
) -> None:
    """Acceleration over the number of workers by way of sharing, and the bound of all ways.

    axes: of matplotlib. shared: by way and number of workers. most: of the workers. serial: share
    of one worker's time that is not shared.
    """
    counts = np.array([])
    for way, by_count in shared.items():
        counts = np.array([count for count in by_count if count <= most])
        gains = [by_count[count].acceleration(serial) for count in counts]
        colour, line = LOOK[way]
        axes.plot(counts, gains, ls=line, color=colour, label=WAYS[way])
    bound = counts / (1.0 + serial * (counts - 1.0))
    axes.plot(counts, bound, ":", color=GREY, label="bound: nobody ever waits")
    axes.set(xlabel="workers [1]", ylabel="acceleration [1]")


def draw_shares(axes: Any, chosen: Mapping[str, SharedWork]) -> None:
    """Time of every worker over the mean, by way of sharing; equal parts are left out.

    axes: of matplotlib. chosen: by way, of the same number of workers.
    """
    most = 1
    for way, one in chosen.items():
        if way != "due":
            (colour, line), most = LOOK[way], one.workers
            share, words = one.seconds / one.seconds.mean(), f"{WAYS[way]}: {one.imbalance:.3g}"
            look: Any = {"where": "mid", "color": colour, "label": words}
            axes.step(np.arange(1, most + 1), share, ls=line, **look)
    axes.set(xlabel="number of the worker [1]", ylabel="time of its work / mean [1]")
    axes.set(xlim=(0.5, most + 0.5), ylim=(0.0, 1.4 * axes.get_ylim()[1]))
    axes.legend(loc="upper right")


def draw_cuts(axes: Any, one: SharedWork, time_s: np.ndarray) -> None:
    """Lines between the bodies of one worker and the next, over time.

    axes: of matplotlib. one: work in a way that has cuts. time_s: ends of the intervals [s].
    """
    cuts: Any = one.cuts
    axes.plot(1e3 * time_s, cuts[:, 1:-1], color=BLUE, linewidth=0.5)
    axes.set(xlabel="time [ms]", ylabel="number of the body [1]")
    axes.set(xlim=(0.0, 1e3 * time_s[-1]), ylim=(0, cuts[0, -1]))
