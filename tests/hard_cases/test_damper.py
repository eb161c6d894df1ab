"""The hard cases of the damper at quick size: what is claimed holds, what is not is refused."""

import pytest

from _hard_cases import registry
from taichi_dem.kit.study.cases import assess

pytestmark = pytest.mark.experiment

#: They differ from others by one law or account, which other tests are about.
VARIANTS = ("spheres_printed", "automaton_ejection")
#: They compile an engine of their own; other cases ask the like of engines that are there.
OF_ITS_OWN = (
    *("grains_of_two_sizes", "grains_by_place_full", "drop_with_full_restitution"),
    *("box_upside_down", "zeno_ball", "mass_on_a_floor_below_1_g"),
)
ASKED = [
    pytest.param(
        case,
        method,
        id=f"{case.name}-{method}",
        marks=pytest.mark.slow if method in VARIANTS or case.name in OF_ITS_OWN else (),
    )
    for case in registry()
    if case.package == "damper"
    for method in case.asked
]


@pytest.mark.parametrize(("case", "method"), ASKED)
def test_method_bears_the_case_or_refuses_it_in_words(case, method):
    result = assess(case, method, quick=True)
    wanted = "refused" if method in case.refused else "passed"
    assert result.status == wanted, result.words
