"""A list of the kernels that are compiled, as a fixture."""

import pytest
from taichi.lang.kernel_impl import Kernel


@pytest.fixture
def compilations(monkeypatch):
    """Names of the kernels that are compiled from here on, in their order."""
    names, materialize = [], Kernel.materialize

    def noted(self, *arguments, **options):
        before = len(_programs_of(self))
        result = materialize(self, *arguments, **options)
        names.extend([self.func.__name__] * (len(_programs_of(self)) - before))
        return result

    monkeypatch.setattr(Kernel, "materialize", noted)
    return names


def _programs_of(kernel):
    """The compiled forms of a kernel; the second name is that of Quadrants."""
    return getattr(kernel, "compiled_kernels", None) or getattr(kernel, "materialized_kernels", ())
