"""Bound of what an audit may have missed, against the binomial sums that define it."""

import math

import pytest

from taichi_dem.kit.audit import misses_bound


def chance_of_so_few(misses, audited, share):
    """Chance of so many misses or fewer, by the sum of the binomial distribution."""
    return sum(
        math.comb(audited, k) * share**k * (1.0 - share) ** (audited - k) for k in range(misses + 1)
    )


@pytest.mark.parametrize(("misses", "audited"), [(0, 10), (9, 10), (120, 900)])
def test_so_few_misses_have_a_chance_of_five_percent_at_the_bound(misses, audited):
    # Both tails are sums of at most 900 terms, each rounded a few times.
    found = chance_of_so_few(misses, audited, misses_bound(misses, audited))
    assert found == pytest.approx(0.05, rel=1e-9)


def test_what_was_missed_throughout_or_not_audited_may_all_be_missed():
    assert misses_bound(0, 0) == misses_bound(7, 7) == 1.0
