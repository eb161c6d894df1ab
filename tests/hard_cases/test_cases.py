"""How a hard case is assessed: kept bounds pass, refusals must be those that are due."""

import math

import pytest

from ca_damper import InputError
from taichi_dem.kit.study.cases import FAILED, PASSED, REFUSED, Case, assess

UNABLE = {"unable": "dt must"}


def status(method, value=0.5, raises=None, warnings=(), **options):
    """Status of a case made up for a method, of a figure that may be 1."""

    def run(trial):
        if raises is not None:
            raise InputError(raises)
        trial.limit("asked", [0.0, value], 1.0, "one")
        trial.warnings += warnings

    case = Case("made_up", "damper", "Nothing.", run, ("able",), **options)
    return assess(case, method, True).status


def test_a_figure_within_its_bound_passes_and_no_other():
    assert status("able", 0.5) == PASSED
    assert {status("able", value) for value in (1.001, math.inf, math.nan)} == {FAILED}


def test_a_method_that_claims_a_case_may_not_refuse_it():
    assert status("able", raises="dt must be short") == FAILED


@pytest.mark.parametrize(
    ("how", "found"),
    [
        ({"raises": "dt must be short"}, REFUSED),
        ({"raises": "no"}, FAILED),
        ({"warnings": ("first", "the dt must be short")}, REFUSED),
        ({"warnings": ("first",)}, FAILED),
        ({}, FAILED),
    ],
)
def test_a_method_that_refuses_a_case_says_the_words_that_are_due(how, found):
    assert status("unable", refused=UNABLE, **how) == found
