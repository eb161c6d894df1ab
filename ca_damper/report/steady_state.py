"""End of the transient, and error of the mean, from values cycle by cycle.

The beginning is cut off where the standard error of the rest is least (rule MSER). A t test then
compares the halves of the rest, by the spread of the seeds, or of an autoregressive series. Where
they differ, three thirds give the limit of an exponential approach.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from taichi_dem.kit.bars.chance import LEAST_SEEDS, f_outside, t_outside, t_quantile

#: Fewer cycles are never called steady.
LEAST_CYCLES = 16
#: Fewer cycles have no halves that could be compared.
LEAST_TESTED = 8
#: Cycles after which seeds that differ by more than their cycles tell are taken as they are: they
#: may all leave motions that look steady for hundreds of cycles.
LONG_CYCLES = 512
#: Batches of a window; each half has half of them.
BATCHES = 8
#: Share of steady series that the test of the halves sends on.
FALSE_ALARMS = 0.05
# Share of groups of steady seeds that are said to wander.
_RARELY = 0.01
# A transient that ends later may not have ended: as a share of the series.
_LATEST = 0.4
# What is cut off beside the transient, as the inverse of a share of the rest: its last remains.
_MARGIN = 5
# Differences between cycles that are rounding, as a share of the mean.
ROUNDING = 1e-9
# Windows of a slow approach that are tried, as shares of the series.
_WINDOWS = (2, 4, 8)
# Largest correlation of neighbours that is believed; beyond, a series is too short for its own.
_MOST_CORRELATED = 0.98


@dataclass(frozen=True)
class SteadyPart:
    """The steady part of a series, from cycle ``begin`` on."""

    is_steady: bool
    begin: int
    mean: float
    error: float
    freedom: int
    drift: float
    more: int


def steady_part(
    series: np.ndarray, allowed: float = 0.0, false_alarms: float = FALSE_ALARMS
) -> SteadyPart:
    """Steady part of values of successive cycles, (cycles,), or of their mean over seeds."""
    # At most the share ``false_alarms`` of steady series (128 cycles or more, correlated by up to
    # 0.5 from cycle to cycle) is sent on; twice as many at 0.8.
    rows = np.atleast_2d(np.asarray(series, dtype=np.float64))
    x = rows.mean(axis=0)
    if len(x) < LEAST_CYCLES:
        return _part(x, 0, math.inf, LEAST_CYCLES - len(x), False)
    begin, allowed = _least_error(x), max(allowed, ROUNDING)
    rest = rows[:, begin:]
    if _seeds_wander(rest, allowed) or (len(x) < LONG_CYCLES and _seeds_differ(rest, allowed)):
        part = _approach(x, allowed)
        return replace(part, is_steady=False, more=max(part.more, len(x)))
    if begin < _LATEST * len(x) and not _halves_differ(rest, false_alarms):
        return _part(x, begin + (len(x) - begin) // _MARGIN, _drift(rest), 0, True)
    return _approach(x, allowed)


def change_of_halves(series: np.ndarray) -> tuple[float, bool]:
    """Change of a mean from the first to the second half, and whether it may be chance."""
    rows = np.asarray(series, dtype=np.float64)[None]
    change = float((_means_of_halves(rows) @ [-1.0, 1.0])[0])
    mean = float(rows.mean())
    return change / mean if mean else 0.0, not _halves_differ(rows, FALSE_ALARMS)


def half_width(series: np.ndarray, confidence: float) -> float:
    """Half-width of the bar of a mean over cycles, (cycles,); infinite where it still changes."""
    if len(series) < LEAST_TESTED or not change_of_halves(series)[1]:
        return math.inf
    _, error, freedom = mean_and_error(series)
    return t_quantile(confidence, freedom) * error


def period(series: np.ndarray, tolerance: float) -> int:
    """Least number of cycles after which all values repeat, up to a third of them; 0 for none."""
    x = np.asarray(series)
    allowed = tolerance * float(np.abs(x).max())
    for cycles in range(1, max(1, len(x) // 3) + 1):
        alike = np.reshape(x[len(x) % cycles :], (-1, cycles))
        if np.abs(alike - alike[-1]).max() <= allowed:
            return cycles
    return 0


def mean_and_error(series: np.ndarray) -> tuple[float, float, int]:
    """Mean of correlated values, its standard error, and the degrees of freedom of that error."""
    means, length = batch_means(series)
    count = len(means)
    if count < 2:
        return float(np.mean(series)), math.inf, 1
    more = correlation_factor(series, count, length)
    return float(np.mean(series)), math.sqrt(more * means.var(ddof=1) / count), count - 1


def batch_means(series: np.ndarray, batches: int = BATCHES) -> tuple[np.ndarray, int]:
    """Means over equal parts of a series, (batches,), and their length; first values left over."""
    count = min(batches, len(series))
    length = len(series) // max(1, count)
    return np.reshape(series[len(series) - count * length :], (count, length)).mean(axis=1), length


def correlation(series: np.ndarray) -> float:
    """Correlation of neighbours in a series, in [0, 0.98], corrected for its length."""
    apart = series - series.mean()
    total, rounding = float(apart @ apart), ROUNDING * abs(float(series.mean()))
    if total <= rounding * rounding * len(series):
        return 0.0
    value = float(apart[1:] @ apart[:-1]) / total
    return min(_MOST_CORRELATED, max(0.0, value + (1.0 + 3.0 * value) / len(series)))


def _least_error(x):
    """Where to cut a transient off so that the mean of the rest has the least standard error."""
    latest = len(x) // 2
    tail = x[::-1] - x.mean()
    counts = np.arange(1, len(x) + 1)
    sums, squares = np.cumsum(tail), np.cumsum(tail**2)
    error = (squares - sums**2 / counts) / counts.astype(np.float64) ** 2
    # error[k - 1] belongs to the last k cycles.
    return int(np.argmin(error[::-1][: latest + 1]))


def _halves_differ(rows, false_alarms):
    """Whether the means of both halves, over the seeds, differ by more than chance."""
    halves = _means_of_halves(rows)
    changes = halves @ [-1.0, 1.0]
    change = abs(float(changes.mean()))
    if change <= ROUNDING * abs(float(halves[:, 1].mean())):
        return False
    error, freedom = _error_of_change(rows, changes)
    return error == 0.0 or t_outside(change / error, freedom) < false_alarms


def _seeds_wander(rows, allowed):
    """Whether seeds change from half to half, each its own way, by more than their cycles tell."""
    # Seeds that change motion so slowly show few motions in their cycles: means of more seeds would
    # miss what comes later.
    changes = _means_of_halves(rows) @ [-1.0, 1.0]
    known = [_error_off_trend(half) for half in _halves(rows)]
    square = sum(error**2 for error, _ in known) / len(rows)
    return _spread_shows(changes, rows, allowed, square, sum(free for _, free in known))


def _seeds_differ(rows, allowed):
    """Whether the means of seeds differ by more than their cycles tell: each has its own motion."""
    known = [mean_and_error(row) for row in rows]
    square = sum(error**2 for _, error, _ in known) / len(rows)
    means = np.array([mean for mean, _, _ in known])
    return _spread_shows(means, rows, allowed, square, sum(free for _, _, free in known))


def _spread_shows(values, rows, allowed, square, freedom):
    """Whether a value of each seed varies by more than its mean error square tells, and matters."""
    count = len(values)
    if count < LEAST_SEEDS:
        return False
    spread = float(values.std(ddof=1))
    if spread <= allowed * abs(float(rows.mean())):
        return False
    ratio = spread**2 / square if square > 0.0 else math.inf
    return f_outside(ratio, count - 1, freedom) < _RARELY


def _drift(rows):
    """By how much the later half of the cycles is off the mean over all, of enough seeds."""
    if len(rows) < LEAST_SEEDS:
        return 0.0
    return 0.5 * abs(float((_means_of_halves(rows) @ [-1.0, 1.0]).mean()))


def _means_of_halves(rows):
    """Means of both halves of the cycles of each seed, (seeds, 2)."""
    return np.array([batch_means(row, 2)[0] for row in rows])


def _halves(rows):
    """First and second half of each row, whose first value is left over where they are odd."""
    return [half for row in rows for half in np.split(row[len(row) % 2 :], 2)]


def _error_of_change(rows, changes):
    """Standard error of the mean change from half to half, and its degrees of freedom."""
    # From seed to seed where there are enough: a seed may leave a motion at any time, of which its
    # earlier cycles tell nothing.
    count = len(rows)
    if count >= LEAST_SEEDS:
        return float(changes.std(ddof=1)) / math.sqrt(count), count - 1
    known = [_error_off_trend(half) for half in _halves(rows)]
    return math.hypot(*(error for error, _ in known)) / count, sum(free for _, free in known)


def _error_off_trend(x):
    """Standard error of a mean, from values less their trend, and its degrees of freedom."""
    place = np.arange(len(x)) - 0.5 * (len(x) - 1)
    apart = x - x.mean()
    straight = apart - place * float(place @ apart) / float(place @ place)
    rho = correlation(straight)
    free = max(1.0, (len(x) - 2) * (1.0 - rho) / (1.0 + rho))
    return math.sqrt(float(straight @ straight) / (len(x) - 2) * _variance(rho, len(x))), free


def correlation_factor(x: np.ndarray, count: int, length: int) -> float:
    """Variance of the mean of all by that of independent batches of the observed variance."""
    rho = correlation(x)
    return max(1.0, count * _variance(rho, count * length) / _variance(rho, length))


def _variance(rho, count):
    """Variance of the mean of so many values of an autoregressive series of unit variance."""
    far = 1.0 - rho
    return ((1.0 + rho) / far - 2.0 * rho * (1.0 - rho**count) / (count * far**2)) / count


def _approach(x, allowed):
    """The longest of our windows that an exponential approach has left no further than allowed."""
    count, size = len(x), abs(float(x[len(x) // 2 :].mean()))
    # Three thirds of four cycles each at least.
    limit, error, time = _limit(x[min(count // 2, count - 12) :])
    windows = [min(count, max(LEAST_CYCLES, count // share)) for share in _WINDOWS]
    drifts = [float(abs(x[count - tail :].mean() - limit) + 2.0 * error) for tail in windows]
    for window, drift in zip(windows, drifts):
        if drift <= allowed * size:
            return _part(x, count - window, drift, 0, True)
    more, last = count // 2, drifts[-1]
    if math.isfinite(last) and size > 0.0:
        more = min(2 * count, math.ceil(time * math.log(max(2.0, 2.0 * last / (allowed * size)))))
    return _part(x, count - windows[0], drifts[0], max(LEAST_CYCLES, more), False)


def _limit(x):
    """(limit, its standard error, time constant in cycles) of the means of three thirds."""
    # Means that go to and fro have as limit the farthest of them from the last.
    (a, b, c), length = batch_means(x, 3)
    if abs(c - b) <= ROUNDING * abs(c):
        return c, 0.0, 1.0
    ratio = (c - b) / (b - a) if b != a else math.inf
    if ratio >= 1.0:
        return math.inf, math.inf, math.inf
    if ratio <= 0.0:
        return (
            (a if abs(a - c) > abs(b - c) else b),
            _error_off_trend(x[-length:])[0],
            float(length),
        )
    # Derivatives of c + (c - b) q / (1 - q) after a, b and c, for q = (c - b) / (b - a).
    slopes = np.array([ratio**2, -2.0 * ratio, 1.0]) / (1.0 - ratio) ** 2
    error = _error_off_trend(x[-length:])[0] * math.sqrt(float(slopes @ slopes))
    return c + (c - b) * ratio / (1.0 - ratio), error, -length / math.log(ratio)


def _part(x, begin, drift, more, is_steady):
    mean, error, freedom = mean_and_error(x[begin:]) if len(x) else (math.nan, math.inf, 1)
    return SteadyPart(is_steady, begin, mean, error, freedom, drift, int(more))
