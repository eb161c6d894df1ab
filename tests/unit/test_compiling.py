"""Kernels of the default scenes keep their size, and errors of kernels name their place.

Taichi walks through the trees of all functions that a kernel calls, 25 us a node, and LLVM works on
what comes of it. The number of nodes is the same on every machine; its budget is that of the day on
which it was last renewed, and a twentieth more.
"""

import re
import textwrap
from pathlib import Path

import pytest
import taichi as ti

import taichi_dem.step
from _bench_waits import sizes_of_kernels
from taichi_dem.kit.kernel_source_cache import filled
from taichi_dem.kit.study import call_in_process

#: Nodes of all kernels of the default scenes on 28 November 2026, and of the largest of them.
ALL, LARGEST = 79551, 31694


def test_kernels_of_the_default_scenes_keep_their_size():
    nodes = [count for _, count, *_ in call_in_process(sizes_of_kernels)]
    assert 0 < max(nodes) <= 1.05 * LARGEST
    assert sum(nodes) <= 1.05 * ALL


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
