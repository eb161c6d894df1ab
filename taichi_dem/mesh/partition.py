"""Shares of a row of items for several workers, equal in cost: the paper's rebalancing.

A share is a run of neighbours in the order of the work; cuts are places in it, (workers + 1,) whole
numbers from 0 to the number of items that never fall. NumPy only.
Source: Konno et al., 3.2, Figs 8 and 9.
"""

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import whole


def even_cuts(cost: ArrayLike, workers: int) -> np.ndarray:
    """Cuts that divide the cumulative curve of the cost evenly.

    cost: what every item took, (n,), in any unit; at least zero. The share of each worker takes at
    most the mean of the shares and the dearest item; together they hold every item once.
    Raises InputError for a negative or infinite cost, and for workers below one.
    """
    workers = whole("workers", workers, 1, 1 << 20)
    curve = np.concatenate([[0.0], np.cumsum(_checked(cost))])
    inner = curve[-1] * np.arange(1, workers) / workers
    return np.concatenate([[0], np.searchsorted(curve[1:], inner, side="right"), [len(curve) - 1]])


def recut(cuts: ArrayLike, seconds: ArrayLike) -> np.ndarray:
    """Cuts after an interval in which every worker's share took some time, (workers,) [s].

    Only a worker's whole time is known, so that within a share all items count alike: the
    cumulative curve is a polyline with a corner at each cut, as in Figs 8 and 9.
    Raises InputError for a negative or infinite time, or when cuts and times do not match.
    """
    cuts, seconds = np.asarray(cuts), _checked(seconds)
    workers = len(cuts) - 1
    if len(seconds) != workers:
        raise InputError(f"seconds must have one entry a worker, {workers}, got {len(seconds)}")
    curve = np.concatenate([[0.0], np.cumsum(seconds)])
    # A share without items, or that took no time, leaves two corners at one place of an axis.
    _, corner = np.unique(curve, return_index=True)
    inner = np.interp(curve[-1] * np.arange(1, workers) / workers, curve[corner], cuts[corner])
    return np.concatenate([cuts[:1], np.rint(inner).astype(int), cuts[-1:]])


def share_costs(cost: ArrayLike, cuts: ArrayLike) -> np.ndarray:
    """Cost of every share, (workers, ...); cost (n, ...)."""
    start = np.zeros((1, *np.shape(cost)[1:]))
    return np.diff(np.concatenate([start, np.cumsum(cost, axis=0)])[np.asarray(cuts)], axis=0)


def imbalance(shares: ArrayLike) -> float:
    """Time of the slowest worker over that of the fastest, as in Fig 15; infinite if one rests."""
    slowest, fastest = float(np.max(shares)), float(np.min(shares))
    return slowest / fastest if fastest > 0.0 else np.inf


def _checked(cost: ArrayLike) -> np.ndarray:
    cost = np.asarray(cost, dtype=float)
    bad = np.flatnonzero(~(np.isfinite(cost) & (cost >= 0.0)))
    if len(bad):
        place = bad[0]
        raise InputError(f"cost must be finite and at least 0, got {cost[place]} at place {place}")
    return cost
