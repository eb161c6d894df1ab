"""Error of the step, from runs of which each has half the step of the one before.

Richardson's extrapolation as the grid convergence index takes it (Roache 1994): an order is read
off three runs and believed only where their differences shrink as an order in range would let them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

#: Orders that are believed: between these and the declared one plus the last.
_LEAST_ORDER, _MORE = 0.5, 0.5
#: Factor on the error of a finest run whose order has been seen, and on differences where not.
SEEN, UNSEEN = 1.25, 1.0


@dataclass(frozen=True)
class StepError:
    """What runs at falling steps say of the finest one.

    error: half-width about its value. order: that was seen, NaN where differences do not shrink as
    those of an order would.
    """

    error: float
    order: float = math.nan

    @property
    def regular(self) -> bool:
        """Whether an order was seen."""
        return not math.isnan(self.order)


def step_error(values: Sequence[float], declared: float = 2.0) -> StepError:
    """Error of the last of at least two values, at steps h, h/2, h/4 and so on.

    declared: order of the method where all is smooth. With two values, or where no order is seen,
    the error is that of first order: the last difference, or as much as the one before lets expect.
    """
    last = abs(values[-1] - values[-2])
    if len(values) == 2:
        return StepError(UNSEEN * last)
    before = values[-2] - values[-3]
    after = values[-1] - values[-2]
    if before * after > 0.0:
        order = math.log2(before / after)
        if _LEAST_ORDER <= order <= declared + _MORE:
            trusted = min(order, declared)
            return StepError(SEEN * last / (2.0**trusted - 1.0), trusted)
    return StepError(UNSEEN * max(last, 0.25 * abs(before)))
