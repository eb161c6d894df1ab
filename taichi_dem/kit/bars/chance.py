"""Statistics of values that differ by chance: Student's t, Fisher's F, clusters."""

import math
from collections.abc import Sequence

import numpy as np

#: Seeds below which no clusters are looked for.
LEAST_SEEDS = 6
# A gap between clusters is larger than the widest cluster, and than the errors of its seeds, by:
_APART, _BEYOND_ERRORS = 2.0, 5.0
_MOST_CLUSTERS = 4


def mean_and_deviation(values: Sequence[float] | np.ndarray) -> tuple[float, float]:
    """Mean and standard deviation; no deviation of a single value."""
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return float(np.mean(values)), deviation


def t_quantile(confidence: float, freedom: float) -> float:
    """Half-width, in standard errors, of the interval that holds the truth with a confidence."""
    from scipy.special import stdtrit

    return -float(stdtrit(freedom, 0.5 * (1.0 - confidence)))


def t_outside(t: float, freedom: float) -> float:
    """Probability that |t| of Student's distribution is larger by chance."""
    from scipy.special import stdtr

    return 2.0 * float(stdtr(freedom, -abs(t)))


def f_outside(ratio: float, above: float, below: float) -> float:
    """Probability that a ratio of two equal variances is larger by chance."""
    from scipy.special import fdtrc

    return float(fdtrc(above, below, ratio))


def share_error(count: int, total: int) -> float:
    """Half-width of Wilson's interval of a share, 95 %."""
    z = t_quantile(0.95, math.inf)
    share = count / total
    inside = share * (1.0 - share) / total + z**2 / (4.0 * total**2)
    return z * math.sqrt(inside) / (1.0 + z**2 / total)


def clusters_of(
    values: Sequence[float] | np.ndarray, error: float, least: float
) -> list[np.ndarray]:
    """Numbers of the values in each cluster, the largest cluster first."""
    x = np.asarray(values, dtype=np.float64)
    order = np.argsort(x, kind="stable")
    if len(x) < LEAST_SEEDS or not np.isfinite(x).all():
        return [order]
    gaps = np.diff(x[order])
    for count in range(_MOST_CLUSTERS, 1, -1):
        ends = np.sort(np.argsort(-gaps, kind="stable")[: count - 1]) + 1
        parts = np.split(order, ends)
        widest = max(float(np.ptp(x[part])) for part in parts)
        gap = float(gaps[ends - 1].min())
        if gap > max(_APART * widest, _BEYOND_ERRORS * error, least):
            return sorted(parts, key=lambda part: (-len(part), part.min()))
    return [order]
