"""The hard cases of the blast at quick size: what is claimed holds, what is not is declined."""

import pytest

from _hard_cases import judge, registry

ASKED = [
    pytest.param(case, method, id=f"{case.name}-{method}")
    for case in registry()
    if case.package == "blast"
    for method in case.asked
]


@pytest.mark.parametrize(("case", "method"), ASKED)
def test_method_bears_the_case_or_declines_it_in_words(case, method):
    result = judge(case, method, quick=True)
    wanted = "refused" if method in case.declines else "passed"
    assert result.status == wanted, result.words


def test_there_are_enough_cases():
    assert len({param.values[0].name for param in ASKED}) >= 20
