"""Student's t and Fisher's F: how far chance takes a mean, and a ratio of two variances."""

import math
from collections.abc import Sequence

import numpy as np

_EPSILON, _TINY, _MOST_TERMS = 1e-15, 1e-300, 1000


def mean_and_deviation(values: Sequence[float]) -> tuple[float, float]:
    """Mean and standard deviation of numbers of any size; no deviation of a single one."""
    x = np.asarray(values, dtype=np.float64)
    # By a power of two, which changes no bit, so that no square is beyond all numbers.
    scale = 2.0 ** (math.frexp(float(np.abs(x).max()))[1] - 1)
    shares = x / scale
    deviation = float(shares.std(ddof=1)) if len(x) > 1 else 0.0
    return float(shares.mean()) * scale, deviation * scale


def t_quantile(confidence: float, freedom: float) -> float:
    """Half-width, in standard errors, of the interval that holds the truth with a confidence.

    confidence: in (0, 1). freedom: degrees, above 0; infinite for a normal distribution.
    """
    outside = 1.0 - confidence
    low, high = 0.0, 1.0
    while t_outside(high, freedom) > outside:
        low, high = high, 2.0 * high
    while high - low > _EPSILON * 4.0 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if t_outside(middle, freedom) > outside else (low, middle)
    return high


def t_outside(t: float, freedom: float) -> float:
    """Probability that |t| of Student's distribution is larger by chance."""
    if math.isinf(freedom):
        return math.erfc(abs(t) / math.sqrt(2.0))
    return beta_share(freedom / (freedom + t * t), 0.5 * freedom, 0.5)


def f_outside(ratio: float, above: float, below: float) -> float:
    """Probability that a ratio of two equal variances is larger by chance.

    above, below: degrees of freedom of numerator and denominator.
    """
    if math.isinf(ratio):
        return 0.0
    return beta_share(below / (below + above * ratio), 0.5 * below, 0.5 * above)


def beta_share(x: float, a: float, b: float) -> float:
    """Incomplete beta function as a share of the whole one, for x in [0, 1] and a, b > 0."""
    if x <= 0.0 or x >= 1.0:
        return min(1.0, max(0.0, x))
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - beta_share(1.0 - x, b, a)
    whole = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(whole + a * math.log(x) + b * math.log1p(-x)) / a
    return front * _fraction(x, a, b)


def _fraction(x, a, b):
    """Continued fraction of the incomplete beta function, by Lentz's method."""
    c, d = 1.0, 1.0 / _nonzero(1.0 - (a + b) * x / (a + 1.0))
    found = d
    for m in range(1, _MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        for term in (even, odd):
            d, c = 1.0 / _nonzero(1.0 + term * d), _nonzero(1.0 + term / c)
            found *= d * c
        if abs(d * c - 1.0) < _EPSILON:
            break
    return found


def _nonzero(value):
    return value if abs(value) > _TINY else _TINY
