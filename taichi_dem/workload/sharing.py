"""Time of simulated workers for a recorded workload, by the way in which they share it.

All workers wait for the slowest at the end of every tick, as a body's step needs the impulses of
all that touch it; the cost of waiting itself is left out.
"""

from dataclasses import dataclass
from typing import Optional

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.validation import choice
from taichi_dem.mesh.partition import even_cuts, imbalance, recut, share_costs
from taichi_dem.workload.record import Workload

#: Way of sharing -> words. Those with cuts give every worker a run of bodies.
WAYS = {
    "static": "fixed shares, by N - i",
    "polyline": "rebalanced by workers' times (the paper)",
    "rebalanced": "rebalanced by bodies' costs",
    "due": "equal parts of what is due",
}


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
    cuts: Optional[np.ndarray] = None

    def __repr__(self) -> str:
        return by_fields(self)

    @property
    def workers(self) -> int:
        """Number of workers."""
        return len(self.seconds)

    @property
    def imbalance(self) -> float:
        """Time of the slowest worker over that of the fastest."""
        return imbalance(self.seconds)

    def acceleration(self, serial: float = 0.0) -> float:
        """Time of one worker over that of all; serial: share of one's time that is not shared."""
        alone = self.total * serial / (1.0 - serial)
        return (self.total + alone) / (self.elapsed + alone)


class Workers:
    """Simulates workers on a workload.

    cost: seconds of every body and class of ticks, (intervals, bodies, classes). total: their sum.
    """

    def __init__(self, workload: Workload):
        self.workload, self.prices = workload, workload.prices()
        self.cost = workload.counts @ self.prices[: workload.counts.shape[-1]]
        self.total = float(self.cost.sum())

    def share(self, way: str, workers: int) -> SharedWork:
        """Work of a number of workers that share it in one of WAYS."""
        if choice("way", way, tuple(WAYS)) == "due":
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
