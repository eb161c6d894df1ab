"""The hard cases: what is claimed holds, what is not is refused in words.

At quick size; ``experiments/hard_cases.py`` draws what the cases give. Of the blast the two methods
that share least code take turns in the fast tests; all others are slow.
"""

import math

import pytest

from ca_damper import InputError
from cases.hard import Case, assess
from hard_cases import CASES

pytestmark = pytest.mark.experiment

LEAST_ALIKE = ("multirate_drifted", "implicit")
#: They differ from others by one law or account, which other tests are about.
VARIANTS = ("spheres_printed", "automaton_ejection")
#: Cases that compile an engine of their own; the pyramid is large.
OF_ITS_OWN = """jump_of_ten_levels stiffness_ratio_1e4 many_steps_at_rest step_beyond_all_limits
    sudden_pressure_on_sleepers step_ratio_resonance step_ratio_beyond_resonance funnel pyramid_100
    levels_that_flip vertices_at_coarse_faces vertices_between_spheres grains_of_two_sizes
    grains_by_place_full drop_with_full_restitution box_upside_down zeno_ball
    mass_on_a_floor_below_1_g""".split()


def is_fast(number, case, method):
    able = [one for one in LEAST_ALIKE if one in case.asked]
    in_turn = case.package == "damper" or (able and method == able[number % len(able)])
    return in_turn and method not in VARIANTS and case.name not in OF_ITS_OWN


ASKED = [
    pytest.param(
        *(case, method),
        id=f"{case.name}-{method}",
        marks=() if is_fast(number, case, method) else pytest.mark.slow,
    )
    for number, case in enumerate(CASES)
    for method in case.asked
]


@pytest.mark.parametrize(("case", "method"), ASKED)
def test_method_bears_the_case_or_refuses_it_in_words(case, method):
    trial = assess(case, method, quick=True)
    assert trial.status == ("refused" if method in case.refused else "passed"), trial.words


def status(method, value=0.5, raises=None, warnings=()):
    """Status of a case made up for a method, of a figure that may be 1."""

    def run(trial):
        if raises is not None:
            raise InputError(raises)
        trial.limit("asked", [0.0, value], 1.0, "one")
        trial.warnings += warnings

    case = Case("made_up", "damper", "Nothing.", run, (), ("able",), {"unable": "dt must"})
    return assess(case, method, True).status


@pytest.mark.parametrize(
    ("method", "how", "found"),
    [
        ("able", {}, "passed"),
        *(("able", {"value": value}, "failed") for value in (1.001, math.inf, math.nan)),
        ("able", {"raises": "dt must be short"}, "failed"),
        ("unable", {"raises": "dt must be short"}, "refused"),
        ("unable", {"raises": "no"}, "failed"),
        ("unable", {"warnings": ("first", "the dt must be short")}, "refused"),
        ("unable", {"warnings": ("first",)}, "failed"),
        ("unable", {}, "failed"),
    ],
)
def test_a_method_keeps_its_bounds_or_says_the_words_that_are_due(method, how, found):
    """One that claims the case may not refuse it."""
    assert status(method, **how) == found
