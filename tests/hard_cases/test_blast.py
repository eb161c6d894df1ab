"""The hard cases of the blast at quick size: what is claimed holds, what is not is refused.

The experiment asks all methods; here they are the two that share least code, the first that claims
a case and the first that refuses it. Those two take turns; what is left, and cases that compile an
engine of their own, are among the slow tests.
"""

import pytest

from _hard_cases import registry
from taichi_dem.kit.study.cases import assess

pytestmark = pytest.mark.experiment

LEAST_ALIKE = ("multirate_drifted", "implicit")
#: Cases with effects, methods or limits of their own compile an engine; the pyramid is large.
OF_ITS_OWN = (
    *("jump_of_ten_levels", "stiffness_ratio_1e4", "many_steps_at_rest", "step_beyond_all_limits"),
    *("sudden_pressure_on_sleepers", "step_ratio_resonance", "step_ratio_beyond_resonance"),
    *("funnel", "levels_that_flip", "vertices_at_coarse_faces", "vertices_between_spheres"),
    "pyramid_100",
)


def methods_of(case):
    chosen = [method for method in case.asked if method in LEAST_ALIKE]
    return dict.fromkeys((*chosen, *case.methods[:1], *list(case.refused)[:1]))


def quick_method(number, case):
    able = [method for method in LEAST_ALIKE if method in case.asked]
    return able[number % len(able)] if able and case.name not in OF_ITS_OWN else None


CASES = [case for case in registry() if case.package == "blast"]
ASKED = [
    pytest.param(
        *(case, method),
        id=f"{case.name}-{method}",
        marks=() if method == quick_method(number, case) else pytest.mark.slow,
    )
    for number, case in enumerate(CASES)
    for method in methods_of(case)
]


@pytest.mark.parametrize(("case", "method"), ASKED)
def test_method_bears_the_case_or_refuses_it_in_words(case, method):
    result = assess(case, method, quick=True)
    wanted = "refused" if method in case.refused else "passed"
    assert result.status == wanted, result.words
