"""How a case is assessed, with methods made up for it."""

import math

import pytest

from _hard_cases import registry
from ca_damper import InputError
from taichi_dem.kit.study.cases import FAILED, PASSED, REFUSED, Case, assess, cases_named


def case(value=0.5, raises=None, warnings=(), **options):
    def run(trial):
        if raises is not None:
            raise raises
        trial.limit("kept", 0.0, 0.0, "nothing")
        trial.limit("asked", [0.0, value], 1.0, "one")
        trial.warnings += warnings

    return Case("made_up", "damper", "Nothing.", run, ("able",), **options)


def test_figure_within_its_bound_passes_with_the_margin_of_the_worst():
    result = assess(case(0.5), "able", True)
    assert result.status == PASSED
    assert result.worst.name == "asked"
    assert result.margin == 2.0
    assert "0.5 of at most 1" in result.words


@pytest.mark.parametrize("value", [1.001, math.inf, math.nan])
def test_figure_beyond_its_bound_or_no_number_fails(value):
    assert assess(case(value), "able", True).status == FAILED


def test_method_that_claims_a_case_and_refuses_it_fails():
    assert assess(case(raises=InputError("dt must be short")), "able", True).status == FAILED


def test_method_that_refuses_in_the_words_that_are_due_is_refused():
    unable = {"unable": "dt must"}
    assert (
        assess(case(raises=InputError("dt must"), refused=unable), "unable", True).status == REFUSED
    )
    assert assess(case(raises=InputError("no"), refused=unable), "unable", True).status == FAILED


def test_numbers_where_a_method_should_decline_are_a_failure():
    result = assess(case(refused={"unable": "dt must"}), "unable", True)
    assert result.status == FAILED
    assert "should have refused" in result.words


def test_numbers_with_the_warning_that_is_due_are_refused():
    unable = {"unable": "too long"}
    said = case(warnings=("first", "the step is too long"), refused=unable)
    result = assess(said, "unable", True)
    assert (result.status, result.words) == (REFUSED, "the step is too long")
    assert assess(case(warnings=("first",), refused=unable), "unable", True).status == FAILED


def test_names_of_cases_are_unique_and_unknown_ones_refused():
    cases = registry()
    names = [one.name for one in cases]
    assert len(set(names)) == len(names)
    assert cases_named(cases, names[1:2]) == cases[1:2]
    with pytest.raises(InputError, match="dust"):
        cases_named(cases, ["dust"])


def test_every_case_says_what_is_hard_and_asks_somebody():
    for one in registry():
        assert one.question.endswith(".")
        assert one.asked
        assert not set(one.methods) & set(one.refused)
