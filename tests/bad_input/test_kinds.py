"""A kind of a parameter takes what it means, as it is, and refuses the rest by name and value."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichi_dem.kit import validation as kinds
from tests.bad_input.refusals import assert_refused, steady


def is_real(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def is_size(value):
    return is_real(value) and kinds.SMALLEST <= value <= kinds.LARGEST


def is_three(value):
    return isinstance(value, list) and len(value) == 3 and all(map(is_real, value))


#: Check of each kind, and whether a value is meant.
KINDS = {
    "positive": (kinds.positive, is_size),
    "zero or positive": (
        partial(kinds.positive, zero_allowed=True),
        lambda value: is_size(value) or (is_real(value) and value == 0.0),
    ),
    "share": (kinds.fraction, lambda value: is_real(value) and 0.0 <= value <= 1.0),
    "limited": (
        lambda name, value: kinds.between(name, value, -2.0, 2.0),
        lambda value: is_real(value) and -2.0 <= value <= 2.0,
    ),
    "whole": (
        lambda name, value: kinds.whole(name, value, 0, 9),
        lambda value: type(value) is int and 0 <= value <= 9,
    ),
    "flag": (kinds.flag, lambda value: isinstance(value, bool)),
    "one of": (
        lambda name, value: kinds.choice(name, value, "ab"),
        lambda value: value in ("a", "b"),
    ),
    "text": (
        kinds.word,
        lambda value: isinstance(value, str) and value.isprintable() and "" != value != '"',
    ),
    "class": (lambda name, value: kinds.instance(name, value, dict), lambda value: value == {}),
    "direction": (kinds.direction, is_three),
    "numbers": (
        kinds.real_numbers,
        lambda value: is_real(value) or (isinstance(value, list) and all(map(is_real, value))),
    ),
}
NUMBERS = st.one_of(
    st.integers(-3, 11), st.floats(-3.0, 3.0), st.sampled_from([1e-61, 1e61, math.nan, -math.inf])
)
VALUES = st.one_of(
    NUMBERS,
    st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=4),
    st.sampled_from(
        [None, True, False, "a", "b", "c\n", "", '"', {}, 1j, b"x", [None], [math.nan]]
    ),
)


@pytest.mark.parametrize("kind", KINDS)
@settings(steady, max_examples=60)
@given(value=VALUES)
def test_a_kind_takes_what_it_means_and_refuses_the_rest_in_one_sentence(kind, value):
    check, is_meant = KINDS[kind]
    if is_meant(value) and not (is_real(value) and abs(value) > kinds.LARGEST):
        assert np.array_equal(check("drawn", value), value)
    else:
        assert_refused(lambda: check("drawn", value), "drawn must ", "got ")
