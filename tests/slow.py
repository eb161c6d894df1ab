"""Cases of a test that only ``make test-slow`` runs."""

import pytest


def slow_but(cases, *quick):
    """Cases for ``parametrize``: those named in ``quick`` as they are, the others marked slow."""
    absent = [case for case in quick if case not in list(cases)]
    assert not absent, f"no case {absent}"
    marked = [case for case in cases if isinstance(case, type(pytest.param()))]
    assert not marked, f"cases must not be marked already, got {marked}"
    return [case if case in quick else pytest.param(case, marks=pytest.mark.slow) for case in cases]
