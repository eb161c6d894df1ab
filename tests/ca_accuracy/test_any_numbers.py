"""Whatever runs of the damper give, what is made of it is a number, NaN in words, or a refusal."""

import numpy as np
import pytest

from ca_damper import goals
from ca_damper.accuracy.goal_estimate import SeedValues, estimate
from ca_damper.accuracy.peak_search import PeakSearch
from ca_damper.steady_state import steady_part
from taichi_dem.kit.errors import InputError
from tests.accuracy.test_any_numbers import numbers


@pytest.mark.parametrize("seed", range(5))
def test_no_number_ends_in_another_exception(seed):
    """Series by cycle, peaks with plateaus and zeros, and estimates at two, three or five steps."""
    random = np.random.default_rng(seed)
    for _ in range(20):
        with np.errstate(all="ignore"):
            steady_part(np.array(numbers(random, int(random.integers(1, 120)))))
            steps = [1.0, 2.0, 4.0][: int(random.integers(2, 4))]
            levels = [_level(random) for _ in steps]
            made = estimate(goals.rms_at(1.0), steps, levels, np.zeros(1), 1.0, 0.95)
            assert str(made.parts)
            _search(random)


def _level(random):
    """Values of three seeds of any size, and the error of their sampling."""
    values = np.array([numbers(random, 1) for _ in range(3)])
    return SeedValues(values, np.abs(numbers(random, 1)), 21, np.abs(numbers(random, 1)))


def _search(random):
    """A search of a peak of a response that is drawn."""
    some, known = np.abs(numbers(random, 3)), {}

    def rms(ratios):
        return [known.setdefault(one, float(random.choice(some))) for one in ratios]

    try:
        ratio, lattice = PeakSearch(rms, 0.8, 1.2, True).run()
    except InputError as refusal:
        assert "must hold the peak" in str(refusal)
    else:
        assert np.isfinite(ratio) and 0 <= lattice.level <= 24
