"""No option of either package takes what it cannot mean: it is refused by name, value and range."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem.kit.validation import shown
from tests.bad_input.options import BLAST, DAMPER
from tests.bad_input.refusals import DRAWN, WRONG, assert_names, steady

OPTIONS = [*BLAST, *DAMPER]
IDS = [f"{option.owner}.{option.name}" for option in OPTIONS]


def wrong_values(option):
    """The listed values of its kind without those that this option takes."""
    taken = [shown(value) for value in option.allowed]
    return [value for value in WRONG[option.kind] if shown(value) not in taken]


def test_there_are_more_than_a_thousand_distinct_bad_values():
    pairs = {(name, shown(value)) for name, o in zip(IDS, OPTIONS) for value in wrong_values(o)}
    assert len(pairs) > 1000


@pytest.mark.parametrize("option", OPTIONS, ids=IDS)
def test_a_wrong_value_is_refused_by_name(option):
    for value in wrong_values(option):
        assert_names(lambda value=value: option.build(value), option.name, value)


DRAWABLE = [option for option in OPTIONS if option.kind in DRAWN]


@steady
@given(data=st.data())
@pytest.mark.parametrize("option", DRAWABLE, ids=lambda option: f"{option.owner}.{option.name}")
def test_a_drawn_value_is_refused_by_name(option, data):
    taken = [shown(value) for value in option.allowed]
    value = data.draw(DRAWN[option.kind].filter(lambda value: shown(value) not in taken))
    assert_names(lambda: option.build(value), option.name, value)
