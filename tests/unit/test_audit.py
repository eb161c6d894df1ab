"""Bound of what an audit may have missed, against the binomial sums that define it."""

import math

import pytest

from taichi_dem.kit.audit import Audit, misses_bound
from taichi_dem.kit.errors import InputError


def chance_of_so_few(misses, audited, share):
    """Chance of so many misses or fewer, by the sum of the binomial distribution."""
    return sum(
        math.comb(audited, k) * share**k * (1.0 - share) ** (audited - k) for k in range(misses + 1)
    )


@pytest.mark.parametrize(
    ("misses", "audited"), [(0, 1), (0, 10), (1, 10), (9, 10), (3, 400), (120, 900)]
)
def test_so_few_misses_have_a_chance_of_five_percent_at_the_bound(misses, audited):
    # Both tails are sums of at most 900 terms, each rounded a few times.
    found = chance_of_so_few(misses, audited, misses_bound(misses, audited))
    assert found == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("audited", [1000, 10**6, 10**9])
def test_without_a_miss_the_bound_is_about_three_over_the_number(audited):
    # (1 - p)^n = 0.05; the logarithms of the beta function round at 1e-16 of n log n.
    assert misses_bound(0, audited) == pytest.approx(
        -math.expm1(math.log(0.05) / audited), rel=1e-5
    )
    # ln 20 = 2.996, less half of its square by the number.
    assert misses_bound(0, audited) == pytest.approx(3.0 / audited, rel=0.0015 + 1.5 / audited)


def test_what_was_missed_throughout_or_not_audited_may_all_be_missed():
    assert misses_bound(0, 0) == misses_bound(7, 7) == 1.0


@pytest.mark.parametrize(("misses", "audited"), [(2, 1), (-1, 5), (0, -1), (0.5, 3)])
def test_numbers_that_cannot_be_are_refused(misses, audited):
    with pytest.raises(InputError, match=r"misses|audited"):
        misses_bound(misses, audited)


def test_an_audit_says_what_it_found():
    audit = Audit(4_100_000, 4100, 0)
    assert str(audit) == "4,100 of 4,100,000 skipped evaluations, 0 misses (< 0.073 %)"
    assert audit.as_dict()["misses_bound"] == misses_bound(0, 4100)
    assert "1 miss (" in str(Audit(10, 4, 1, "contact tests"))
    assert "nothing is known" in str(Audit(10, 0, 0))
