"""What Taichi reads of kernels, kept: the same lines, and looked for once."""

import inspect
import textwrap

import pytest
import taichi as ti
from taichi.lang import kernel_impl

from taichi_dem.kit.kernel_source_cache import RememberingWrapper, broken, remembering

LINES = ("", " ", "    a = b", "    " + "^" * 9, "x" * 200, "    word " * 30, "\ta\n b")


@ti.func
def doubled(number):
    return number + number


@ti.kernel
def twice_doubled(number: ti.i32) -> ti.i32:
    return doubled(doubled(number))


@ti.kernel
def unknown_name(number: ti.i32) -> ti.i32:
    return number + nobody_knows_this  # noqa: F821


@pytest.mark.parametrize("text", LINES)
@pytest.mark.parametrize("width", [80, 11])
def test_lines_are_broken_as_the_library_breaks_them(text, width):
    """Twice: the second time they are looked up, in a list of their own."""
    wrapper, expected = RememberingWrapper(width=width), textwrap.wrap(text, width)
    first = wrapper.wrap(text)
    first.append("not kept")
    assert wrapper.wrap(text) == expected


def test_source_of_a_function_is_looked_for_once():
    asked = []

    def find(function):
        asked.append(function)
        return inspect.getsourcelines(function)

    lines = remembering(find)
    for _ in range(2):
        assert lines(remembering) == inspect.getsourcelines(remembering)
        assert lines(broken.__wrapped__) == inspect.getsourcelines(broken.__wrapped__)
    assert len(asked) == 2


def test_taichi_reads_kernels_that_way():
    """Names in Taichi that change would leave all as slow as before, and nobody would see it."""
    before = broken.cache_info()
    assert twice_doubled(3) == 12
    after = broken.cache_info()
    assert after.hits > before.hits
    found = [code.co_name for _, code in kernel_impl.getsourcelines.cached]
    assert found.count("doubled") == 1


def test_an_error_in_a_kernel_still_shows_its_place():
    with pytest.raises(ti.TaichiCompilationError) as raised:
        unknown_name(1)
    shown = str(raised.value).splitlines()
    mark = next(k for k, line in enumerate(shown) if "^" in line)
    assert "return number + nobody_knows_this" in shown[mark - 1]
    start = shown[mark - 1].index("nobody_knows_this")
    assert shown[mark].index("^") == start
    assert shown[mark].rstrip().endswith("^" * len("nobody_knows_this"))
