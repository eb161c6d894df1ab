"""Simulated workers that share a recorded workload (``blast_scaling.py``), and their pictures.

All workers wait for the slowest at the end of every tick, as a body's step needs the impulses of
all that touch it; the cost of waiting itself is left out. A share is a run of neighbours in the
order of the work; cuts are places in it, (workers + 1,) whole numbers that never fall: the paper's
rebalancing (Konno et al., 3.2, Figs 8 and 9).
"""

from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, PURPLE, RED

#: Way of sharing -> words. Those with cuts give every worker a run of bodies.
WAYS = {
    "static": "fixed shares, by N - i",
    "polyline": "rebalanced by workers' times (the paper)",
    "rebalanced": "rebalanced by bodies' costs",
    "due": "equal parts of what is due",
}
#: Colour and line by way of sharing.
LOOK = dict(zip(WAYS, ((RED, "-."), (PURPLE, "--"), (BLUE, "-"), (GREEN, (0, (8, 2))))))


@dataclass(frozen=True, eq=False)
class SharedWork:
    """Work shared in a way. total: seconds of one worker. elapsed: of all, with waiting [s].

    seconds: of each worker for its own work (workers,). cuts: (intervals, workers + 1), None where
    there are none.
    """

    way: str
    total: float
    seconds: np.ndarray
    elapsed: float
    cuts: np.ndarray | None = None

    @property
    def workers(self):
        """Number of workers."""
        return len(self.seconds)

    @property
    def imbalance(self):
        """Time of the slowest worker over that of the fastest (Fig. 15); infinite if one rests."""
        slowest, fastest = self.seconds.max(), self.seconds.min()
        return float(slowest / fastest) if fastest > 0.0 else np.inf

    def acceleration(self, serial=0.0):
        """Time of one worker over that of all; serial: share of one's time that is not shared."""
        alone = self.total * serial / (1.0 - serial)
        return (self.total + alone) / (self.elapsed + alone)


class Workers:
    """Simulates workers on a workload.

    cost: seconds of every body and class of ticks, (intervals, bodies, classes). total: their sum.
    """

    def __init__(self, workload):
        self.workload, self.prices = workload, workload.prices()
        self.cost = workload.counts @ self.prices[: workload.counts.shape[-1]]
        self.total = float(self.cost.sum())

    def share(self, way, workers):
        """Work of a number of workers that share it in one of WAYS."""
        if way == "due":
            return self._equal_parts(workers)
        # Body i meets at most N - i others, of higher number: all that is known beforehand.
        cuts = even_cuts(np.arange(self.cost.shape[1], 0, -1) - 1.0, workers)
        seconds, elapsed, used = np.zeros(workers), 0.0, []
        for cost in self.cost:
            shares = share_costs(cost, cuts)
            used.append(cuts)
            seconds += shares.sum(axis=1)
            elapsed += float(shares.max(axis=0).sum())
            if way == "polyline":
                cuts = recut(cuts, shares.sum(axis=1))
            elif way == "rebalanced":
                cuts = even_cuts(cost.sum(axis=1), workers)
        return SharedWork(way, self.total, seconds, elapsed, np.array(used))

    def _equal_parts(self, workers):
        """Equal parts of the due bonds, then of the due pairs, of every tick."""
        counts, ticks = self.workload.counts.sum(axis=1), self.workload.ticks
        # A pair counts with the mean number of its spheres.
        spheres = counts[..., 2] / np.maximum(counts[..., 1], 1)
        prices = np.full(ticks.shape, self.prices[0]), self.prices[1] + self.prices[2] * spheres
        seconds, elapsed = np.zeros(workers), 0.0
        for due, price in zip((counts[..., 0], counts[..., 1]), prices):
            each = due / np.maximum(ticks, 1)
            full, rest = np.divmod(each, workers)
            for w in range(workers):
                mine = full + np.clip(rest - w, 0.0, 1.0)
                seconds[w] += float((ticks * price * mine).sum())
            elapsed += float((ticks * price * np.ceil(each / workers)).sum())
        return SharedWork("due", self.total, seconds, elapsed)


def even_cuts(cost, workers):
    """Cuts that divide the cumulative curve of the cost, (items,), evenly.

    The share of each worker takes at most the mean of the shares and the dearest item; together
    they hold every item once.
    """
    curve = np.concatenate([[0.0], np.cumsum(cost)])
    inner = curve[-1] * np.arange(1, workers) / workers
    return np.concatenate([[0], np.searchsorted(curve[1:], inner, side="right"), [len(curve) - 1]])


def recut(cuts, seconds):
    """Cuts after an interval in which every worker's share took some time, (workers,) [s].

    Only a worker's whole time is known, so that within a share all items count alike: the
    cumulative curve is a polyline with a corner at each cut, as in Figs 8 and 9.
    """
    workers, curve = len(seconds), np.concatenate([[0.0], np.cumsum(seconds)])
    # A share without items, or that took no time, leaves two corners at one place of an axis.
    _, corner = np.unique(curve, return_index=True)
    inner = np.interp(curve[-1] * np.arange(1, workers) / workers, curve[corner], cuts[corner])
    return np.concatenate([cuts[:1], np.rint(inner).astype(int), cuts[-1:]])


def share_costs(cost, cuts):
    """Cost of every share, (workers, ...); cost (items, ...)."""
    start = np.zeros((1, *np.shape(cost)[1:]))
    return np.diff(np.concatenate([start, np.cumsum(cost, axis=0)])[cuts], axis=0)


def draw_acceleration(axes, shared, most=np.inf, serial=0.0):
    """Acceleration over the number of workers by way of sharing, and the bound of all ways.

    shared: by way and number of workers. most: of the workers. serial: share of one worker's time
    that is not shared.
    """
    for way, by_count in shared.items():
        counts = np.array([count for count in by_count if count <= most])
        gains = [by_count[count].acceleration(serial) for count in counts]
        colour, line = LOOK[way]
        axes.plot(counts, gains, ls=line, color=colour, label=WAYS[way])
    bound = counts / (1.0 + serial * (counts - 1.0))
    axes.plot(counts, bound, ":", color=GREY, label="bound: nobody ever waits")
    axes.set(xlabel="workers [1]", ylabel="acceleration [1]")


def draw_shares(axes, chosen):
    """Time of every worker over the mean by way, of one number of them, without equal parts."""
    for way, one in chosen.items():
        if way != "due":
            colour, line = LOOK[way]
            share, words = one.seconds / one.seconds.mean(), f"{WAYS[way]}: {one.imbalance:.3g}"
            look = {"where": "mid", "color": colour, "label": words, "ls": line}
            axes.step(np.arange(1, one.workers + 1), share, **look)
    axes.set(xlabel="number of the worker [1]", ylabel="time of its work / mean [1]")
    axes.set(xlim=(0.5, one.workers + 0.5), ylim=(0.0, 1.4 * axes.get_ylim()[1]))
    axes.legend(loc="upper right")


def draw_cuts(axes, one, time_s):
    """Lines between the bodies of one worker and the next, over the ends of intervals [s]."""
    axes.plot(1e3 * time_s, one.cuts[:, 1:-1], color=BLUE, linewidth=0.5)
    axes.set(xlabel="time [ms]", ylabel="number of the body [1]")
    axes.set(xlim=(0.0, 1e3 * time_s[-1]), ylim=(0, one.cuts[0, -1]))
