"""What workers would take for a recorded run, by how the work is shared among them.

All workers wait for the slowest at the end of every tick, as a body's step needs the impulses of
all that touch it; what waiting itself costs is left out.
"""

from dataclasses import dataclass

import numpy as np

from taichi_dem.mesh.partition import even_cuts, recut, share_costs

#: Way of sharing -> words. Those with cuts give every worker a run of bodies.
WAYS = {
    "static": "fixed shares, by N - i",
    "polyline": "rebalanced by workers' times (the paper)",
    "rebalanced": "rebalanced by bodies' costs",
    "due": "equal parts of what is due",
}


@dataclass(frozen=True, eq=False)
class Shared:
    """What workers took. seconds: each for its own work (workers,). elapsed: with waiting [s].

    cuts: (intervals, workers + 1), None where there are none.
    """

    seconds: np.ndarray
    elapsed: float
    cuts: object = None


class Workers:
    """Simulates workers on a ``Record``.

    cost: seconds of every body and class of ticks, (intervals, bodies, classes).
    """

    def __init__(self, record):
        self.record = record
        self.prices = record.prices()
        self.cost = record.counts @ self.prices[: record.counts.shape[-1]]
        self.bodies = self.cost.shape[1]
        self.total = float(self.cost.sum())

    def share(self, way, workers):
        """What some workers take when the work is shared in a way, a ``Shared``."""
        if way == "due":
            return self._equal_parts(workers)
        # Body i meets at most N - i others, of higher number: all that is known beforehand.
        cuts = even_cuts(np.arange(self.bodies, 0, -1) - 1.0, workers)
        seconds, elapsed, used = np.zeros(workers), 0.0, []
        for cost in self.cost:
            shares = share_costs(cost, cuts)
            used.append(cuts)
            seconds += shares.sum(axis=1)
            elapsed += float(shares.max(axis=0).sum())
            cuts = self._next_cuts(way, cost, cuts, shares, workers)
        return Shared(seconds, elapsed, np.array(used))

    def _next_cuts(self, way, cost, cuts, shares, workers):
        if way == "polyline":
            return recut(cuts, shares.sum(axis=1))
        return even_cuts(cost.sum(axis=1), workers) if way == "rebalanced" else cuts

    def _equal_parts(self, workers):
        """Equal parts of the due bonds, then of the due pairs, of every tick."""
        counts = self.record.counts.sum(axis=1)
        ticks = self.record.ticks
        pairs = np.maximum(counts[..., 1], 1)
        # A pair counts with the mean number of its spheres.
        price_of_pair = self.prices[1] + self.prices[2] * counts[..., 2] / pairs
        prices = (np.full(ticks.shape, self.prices[0]), price_of_pair)
        seconds, elapsed = np.zeros(workers), 0.0
        for due, price in zip((counts[..., 0], counts[..., 1]), prices):
            each = due / np.maximum(ticks, 1)
            whole, rest = np.divmod(each, workers)
            for w in range(workers):
                mine = whole + np.clip(rest - w, 0.0, 1.0)
                seconds[w] += float((ticks * price * mine).sum())
            elapsed += float((ticks * price * np.ceil(each / workers)).sum())
        return Shared(seconds, elapsed)


def acceleration(total, elapsed, serial):
    """Time of one worker over that of many; serial: share of all time that cannot be shared."""
    alone = total * serial / (1.0 - serial)
    return (total + alone) / (elapsed + alone)
