"""Several ends of one question: values of its runs that fall into clusters."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.accuracy.answer import Answer
from taichi_dem.kit.accuracy.student import mean_and_deviation, t_quantile
from taichi_dem.kit.display import counted

#: Seeds below which no clusters are looked for.
LEAST_SEEDS = 6
# A gap between clusters is larger than the widest cluster, and than the errors of its seeds, by:
_APART, _BEYOND_ERRORS = 2.0, 5.0
_MOST_BRANCHES = 4


@dataclass(frozen=True)
class Branch:
    """One of several ends of a question.

    Parameters
    ----------
    value : float
        Mean over its runs, in the unit of the goal.
    error : float
        Half-width of the bar of the mean, in the unit of the goal.
    share : float
        Share of all runs that came to it.
    share_error : float
        Half-width of the bar of that share.
    seeds : tuple of int
        Seeds of its runs.
    """

    value: float
    error: float
    share: float
    share_error: float
    seeds: tuple[int, ...]

    def in_words(self, unit: str, runs: str) -> str:
        """Value, bar and share in words.

        Parameters
        ----------
        unit : str
            Unit of the value.
        runs : str
            Word for the runs, in the plural.

        Returns
        -------
        str
            A part of a sentence.
        """
        end = f" {unit}" if unit != "1" else ""
        share = f"{100.0 * self.share:.0f} +- {100.0 * self.share_error:.0f} %"
        return f"{self.value:.6g} +- {self.error:.2g}{end} for {share} of the {runs}"


@dataclass(frozen=True, eq=False, repr=False)
class BranchedAnswer(Answer):
    """Answer of a question with several ends: its value is that of the most frequent.

    All other parameters are those of ``Answer``.

    Parameters
    ----------
    branches : tuple of Branch, default ()
        All ends, the most frequent first.
    """

    branches: tuple[Branch, ...] = ()


def clusters_of(values: Sequence[float], error: float, least: float) -> list[np.ndarray]:
    """Numbers of the values in each cluster, the largest cluster first.

    error: standard error of a value. least: gap below which no two clusters are told apart. One
    cluster unless every gap stands out from the widths of the clusters and from the errors.
    """
    x = np.asarray(values, dtype=np.float64)
    order = np.argsort(x, kind="stable")
    if len(x) < LEAST_SEEDS or not np.isfinite(x).all():
        return [order]
    with np.errstate(over="ignore"):
        return _clusters(x, order, error, least)


def _clusters(x, order, error, least):
    """Clusters of values by their order."""
    gaps = np.diff(x[order])
    for count in range(_MOST_BRANCHES, 1, -1):
        ends = np.sort(np.argsort(-gaps, kind="stable")[: count - 1]) + 1
        parts = np.split(order, ends)
        widest = max(float(np.ptp(x[part])) for part in parts)
        gap = float(gaps[ends - 1].min())
        if gap > max(_APART * widest, _BEYOND_ERRORS * error, least):
            return sorted(parts, key=lambda part: (-len(part), part.min()))
    return [order]


def branches_of(
    values: np.ndarray, clusters: Sequence[np.ndarray], seeds: Sequence[int], error: float, t: float
) -> tuple[Branch, ...]:
    """Branches of clusters; error: standard error of a value by sampling, t: its quantile."""
    return tuple(_branch(values[part], part, seeds, error, t) for part in clusters)


def _branch(values, part, seeds, error, t):
    count, share = len(part), len(part) / len(seeds)
    half = t * error / math.sqrt(count)
    mean, deviation = mean_and_deviation(values)
    if count > 1:
        half = max(half, t_quantile(0.95, count - 1) * deviation / math.sqrt(count))
    width = _share_error(count, len(seeds))
    named = tuple(seeds[k] for k in sorted(part.tolist()))
    return Branch(mean, half, share, width, named)


def _share_error(count, total):
    """Half-width of Wilson's interval of a share, 95 %."""
    z = t_quantile(0.95, math.inf)
    share = count / total
    inside = share * (1.0 - share) / total + z**2 / (4.0 * total**2)
    return z * math.sqrt(inside) / (1.0 + z**2 / total)


def sentence(
    branches: Sequence[Branch], unit: str, run: str = "seed", ends: str = "took {} steady motions"
) -> str:
    """One sentence that no single number answers the question.

    run: what a seed stands for, in the singular. ends: what they did, with a place for how many.
    """
    total = counted(sum(len(branch.seeds) for branch in branches), run)
    each = "; ".join(branch.in_words(unit, f"{run}s") for branch in branches)
    return f"no single number: {total} {ends.format(len(branches))}: {each}"
