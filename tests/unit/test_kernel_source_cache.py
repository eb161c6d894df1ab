"""What is found once for Taichi says what Taichi finds: places of errors, methods of a class."""

import re
import textwrap
from pathlib import Path

import pytest
import taichi as ti

import taichi_dem.step
from taichi_dem.kit.kernel_source_cache import filled


@ti.func
def _unknown(x):
    return x + _nowhere  # noqa: F821


@ti.kernel
def _calls_it():
    for i in range(2):
        _unknown(i)


def test_an_error_names_its_place_in_every_function_on_the_way():
    for _ in range(2):
        with pytest.raises(ti.TaichiCompilationError) as caught:
            _calls_it()
        said = str(caught.value)
        assert re.findall(r"in (_\w+):\n", said) == ["_calls_it", "_unknown"], said
        assert "return x + _nowhere" in said and 'Name "_nowhere" is not defined' in said


def test_lines_of_the_package_are_filled_as_by_textwrap():
    for path in Path(taichi_dem.step.__file__).parent.rglob("*.py"):
        for line in path.read_text().splitlines(True):
            assert filled(line, 4, 9999) == textwrap.fill(line, tabsize=4, width=9999), line
