"""The hard cases of the blast at quick size: what is claimed holds, what is not is refused.

Compiling is what they cost. The experiment asks all methods; here those of a case that shares its
run with others are the two that share least code, and a case with a run of its own is asked of the
first method that claims it and the first that refuses it, among the slow tests.
"""

import pytest

from _hard_cases import blast, judge, registry
from tests.figures import UNIT

SHARED = ("multirate_drifted", "implicit")


def methods_of(case):
    if case in blast.CASES:
        return [method for method in case.asked if method in SHARED]
    return [*case.methods[:1], *list(case.refused)[:1]]


ASKED = [
    pytest.param(
        *(case, method),
        id=f"{case.name}-{method}",
        marks=() if case in blast.CASES else pytest.mark.slow,
    )
    for case in registry()
    if case.package == "blast"
    for method in methods_of(case)
]


@pytest.mark.parametrize(("case", "method"), ASKED)
def test_method_bears_the_case_or_refuses_it_in_words(case, method):
    result = judge(case, method, quick=True)
    wanted = "refused" if method in case.refused else "passed"
    assert result.status == wanted, result.words
    shown = result.shown
    assert shown is None or all(map(UNIT.search, (shown.xlabel, shown.ylabel)))


def test_there_are_enough_cases():
    assert len({param.values[0].name for param in ASKED}) >= 28
