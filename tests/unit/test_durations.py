"""A duration of NumPy, which has a unit of its own, passes no check for a number."""

import numpy as np
import pytest

from ca_damper import excitation
from taichi_dem import InputError
from taichi_dem.kit import validation
from taichi_dem.kit.checkpoint import identity_of

DURATION = np.timedelta64(5, "ms")
CHECKS = {
    "positive": lambda x: validation.positive("x", x),
    "zero allowed": lambda x: validation.positive("x", x, zero_allowed=True),
    "between": lambda x: validation.between("x", x, 0.0, 10.0),
    "fraction": lambda x: validation.fraction("x", x - x),
    "whole": lambda x: validation.whole("x", x, 0, 10),
    "direction": lambda x: validation.direction("x", [x, x, x]),
    "samples": lambda x: excitation.from_samples(np.arange(8) * x, np.arange(8.0)),
    "nodes": lambda x: excitation.Signal(1.0, np.arange(8) * x, np.zeros(8)),
    "numbers": lambda x: validation.real_numbers("x", np.array([x, x])),
}


@pytest.mark.parametrize("check", CHECKS)
def test_a_duration_is_refused(check):
    with pytest.raises(InputError, match="must"):
        CHECKS[check](DURATION)


def test_a_duration_stays_what_it_is_where_it_is_only_passed_on():
    assert validation.plain(DURATION) is DURATION and not validation.finite(DURATION)
    assert identity_of(DURATION) != identity_of(5)
