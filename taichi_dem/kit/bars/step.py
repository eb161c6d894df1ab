"""Error of the step, from runs at falling steps (grid convergence index, Roache 1994)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from taichi_dem.kit.bars.chance import t_quantile

#: Factor on the error of a finest run whose order has been seen.
SAFETY = 1.25
#: Share of the error that is allowed below which two runs support no bar: they may agree by luck.
SUPPORTED = 1.0 / 3.0
#: Orders that are believed: from the least one to the declared one and so much.
_LEAST_ORDER, _MORE = 0.5, 0.5
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
    ratio, low, high = before / after, 1e-3, most
    if not _ratio(steps, low) <= ratio <= _ratio(steps, high):
        return math.nan
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _ratio(steps, middle) < ratio else (low, middle)
    return high


def _ratio(steps, order):
    """First over second difference of three values whose error is a power of the step."""
    a, b, c = (step**order for step in steps)
    return (a - b) / (b - c)
