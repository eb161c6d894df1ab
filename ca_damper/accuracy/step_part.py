"""Error of the step, from values at several steps that chance blurs.

Where twice and four times the step change a value as an order would let them, that order says how
far the finest is off. Where they do not, the method has no limit to be seen at these steps: each
value is then a draw, and another step, however fine, would give another.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.display import by_fields

#: Error of the finest step by Richardson: times this.
SAFETY = 1.25
# Orders that are in range: from the least one to the declared one and so much.
_LEAST_ORDER, _MORE = 0.5, 1.5
# Standard errors beyond which a difference is not chance, and changes are not those of an order.
_SEEN, _OTHER_ORDER = 2.0, 2.5
# Differences that are rounding, as a share of the value.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class StepPart:
    """A value as its steps give it (places,), and the half-width of its bar by the step (places,).

    value: at the finest step, or the mean over all where they have no order. regular: whether they
    have one, as far as chance lets see (places,). is_seen: whether steps differ beyond chance.
    """

    value: np.ndarray
    error: np.ndarray
    regular: np.ndarray
    is_seen: bool

    def __repr__(self) -> str:
        return by_fields(self)

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
    """Error by the step of values (steps, places) with standard errors of the same shape.

    steps: as multiples of the finest, ascending from 1, with 2; an order can be checked with 4.
    order: of the method.
    """
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
    """Whether values at 1, 2 and 4 steps may be those of an order in range, (places,).

    Then the change to the finest is a share of the one before, between two bounds; chance as a
    whole may take it out of them.
    """
    high, low = (_beyond(values, noise, power) for power in (_LEAST_ORDER, order + _MORE))
    return (high * low <= 0.0) | (np.minimum(np.abs(high), np.abs(low)) < _OTHER_ORDER)


def _beyond(values, noise, order):
    """Standard errors by which the change to the finest is off the share that an order has."""
    share = 0.5**order
    gap = values[0] - values[1] - share * (values[1] - values[2])
    blur = np.sqrt(noise[0] ** 2 + ((1.0 + share) * noise[1]) ** 2 + (share * noise[2]) ** 2)
    return gap / np.where(blur > 0.0, blur, 1.0)


def _by_order(values, noise, seen, order):
    """Half-width of the finest of values at 1, 2 and 4 steps.

    All three tell it where they agree with the order of the method as far as chance lets see, and
    the last change does where it is seen beyond chance and larger. Elsewhere the order is that of
    the differences, if it is lower than the method's.
    """
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
