"""Error of the step, from runs at falling steps (grid convergence index, Roache 1994)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.bars.chance import t_quantile

#: Factor on the error of a finest run whose order has been seen.
SAFETY = 1.25
#: Share of the error that is allowed below which two runs support no bar: they may agree by luck.
SUPPORTED = 1.0 / 3.0
#: Orders that are believed: from the least one to the declared one and so much, which is more where
#: chance blurs it.
_LEAST_ORDER, _MORE, _MORE_BLURRED = 0.5, 0.5, 1.5
# Standard errors beyond which a difference is not chance, and changes are not those of an order.
_SEEN, _OTHER_ORDER = 2.0, 2.5
# Differences that are rounding, as a share of the value.
_ROUNDING = 1e-9
#: Degrees of freedom of Student's t with whose quantiles all errors grow with the confidence.
_FREEDOM = 4
_BISECTIONS = 50


@dataclass(frozen=True)
class StepError:
    """Error of the finest of several runs at falling steps: half-width about its value.

    order: NaN where differences do not shrink.
    """

    error: float
    order: float = math.nan

    @property
    def regular(self) -> bool:
        """Whether an order was seen."""
        return not math.isnan(self.order)


def step_error(
    values: Sequence[float],
    declared: float = 2.0,
    steps: Sequence[float] | None = None,
    *,
    least: float = 0.0,
    smooth: bool = False,
    confidence: float = 0.95,
) -> StepError:
    """Error of the last of at least two values, at falling steps."""
    # Without an order the error is that of first order; of a smooth run 1.1 times the declared one.
    if steps is None:
        steps = [2.0**-k for k in range(len(values))]
    wider = t_quantile(confidence, _FREEDOM) / t_quantile(0.95, _FREEDOM)
    last = max(abs(values[-1] - values[-2]), least)
    shrinking = steps[-2] / steps[-1]
    if len(values) > 2:
        order = _order(values[-3:], steps[-3:], declared + _MORE)
        if order > _LEAST_ORDER:
            trusted = min(order, declared)
            return StepError(wider * SAFETY * last / (shrinking**trusted - 1.0), trusted)
    unseen = 1.1 / (shrinking**declared - 1.0) if smooth else 1.0 / (shrinking - 1.0)
    return StepError(wider * unseen * last)


def _order(values, steps, most):
    """Order that three values at falling steps show, NaN for none in (0, most]."""
    before, after = values[1] - values[0], values[2] - values[1]
    if after == 0.0:
        return math.nan
    found, low, high = before / after, 1e-3, most
    if not _ratio(steps, low) <= found <= _ratio(steps, high):
        return math.nan
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _ratio(steps, middle) < found else (low, middle)
    return high


def _ratio(steps, order):
    """First over second difference of three values whose error is a power of the step."""
    a, b, c = (step**order for step in steps)
    return (a - b) / (b - c)


@dataclass(frozen=True, eq=False)
class StepPart:
    """A value (places,) as its steps give it, and the half-width of its bar by the step."""

    value: np.ndarray
    error: np.ndarray
    regular: np.ndarray
    is_seen: bool

    @property
    def is_regular(self) -> bool:
        """Whether steps have an order in all places."""
        return bool(self.regular.all())


def step_part(
    steps: Sequence[float],
    values: np.ndarray,
    errors: np.ndarray,
    order: float,
    confidence: float,
) -> StepPart:
    """Error by the step of values (steps, places) with standard errors of the same shape."""
    noise = np.hypot(errors, _ROUNDING * np.abs(values))
    near, far = (list(steps).index(k) if k in steps else -1 for k in (2.0, 4.0))
    change = values[0] - values[near]
    seen = np.abs(change) > _SEEN * np.hypot(noise[0], noise[near])
    if far < 0:
        error = _richardson(change, order)
        return StepPart(values[0], error, np.full(seen.shape, True), bool(seen.any()))
    three = [0, near, far]
    regular = _in_range(values[three], noise[three], order)
    error = _by_order(values[three], noise[three], seen, order)
    spread = _prediction(values, confidence)
    value = np.where(regular, values[0], values.mean(axis=0))
    found = np.where(regular, error, spread)
    return StepPart(value, found, regular, bool(seen.any()))


def _richardson(change, order):
    """Half-width of the finer of two values by their difference."""
    return SAFETY * np.abs(change) / (2.0**order - 1.0)


def _in_range(values, noise, order):
    """Whether values at 1, 2 and 4 steps may be those of an order in range, (places,)."""
    # The change to the finest step must be a share of the change before, up to chance.
    high, low = (_beyond(values, noise, power) for power in (_LEAST_ORDER, order + _MORE_BLURRED))
    return (high * low <= 0.0) | (np.minimum(np.abs(high), np.abs(low)) < _OTHER_ORDER)


def _beyond(values, noise, order):
    """Standard errors by which the change to the finest is off the share that an order has."""
    share = 0.5**order
    gap = values[0] - values[1] - share * (values[1] - values[2])
    blur = np.sqrt(noise[0] ** 2 + ((1.0 + share) * noise[1]) ** 2 + (share * noise[2]) ** 2)
    return gap / np.where(blur > 0.0, blur, 1.0)


def _by_order(values, noise, seen, order):
    """Half-width of the finest of values at 1, 2 and 4 steps."""
    # All three runs count where they agree with the method's order, the last change where it is
    # larger beyond chance; elsewhere the order seen, if lower than the method's.
    near, far = np.abs(values[0] - values[1]), np.abs(values[1] - values[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        observed = np.log2(far / near)
    trusted = np.clip(np.where(near > 0.0, observed, order), _LEAST_ORDER, order)
    whole = SAFETY * np.abs(values[0] - values[2]) / (4.0**order - 1.0)
    agree = np.abs(_beyond(values, noise, order)) < _OTHER_ORDER
    last = np.where(seen, _richardson(near, order), 0.0)
    return np.where(agree, np.maximum(whole, last), _richardson(near, trusted))


def _prediction(values, confidence):
    """Half-width about the mean of values that are draws, of one more draw."""
    count = len(values)
    t = t_quantile(confidence, count - 1)
    return t * values.std(axis=0, ddof=1) * math.sqrt(1.0 + 1.0 / count)
