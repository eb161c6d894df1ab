"""Kernels of the default scenes keep their size, and errors of kernels name their place.

Taichi walks through the trees of all functions that a kernel calls, 25 us a node, and LLVM works on
what comes of it. The number of nodes is the same on every machine; its budget is that of the day on
which it was last renewed, and a twentieth more.
"""

import re
import textwrap
from collections import Counter
from pathlib import Path

import pytest
import taichi as ti
from taichi.lang.ast.ast_transformer_utils import Builder
from taichi.lang.kernel_impl import Kernel

import taichi_dem.step
from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene, effects, read_mesh, simulate
from taichi_dem.kit.kernel_source_cache import filled
from taichi_dem.kit.study import call_in_process

#: Nodes on 28 November 2026 by kernel, of those with more than a thousand; of all others together.
BUDGET = {
    "Resident._steps": 31694,
    "Resident._search": 15835,
    "Readings._visit": 4060,
    "Step._start": 6918,
    "Coupling.advance": 16068,
    "Coupling.start": 1765,
}
OTHERS = 3211
#: Step of the blast [s].
STEP = 4e-7


def nodes_of_kernels():
    """Tree nodes of every kernel of the default scenes, by name."""
    found, now = Counter(), [""]
    visit, read = Builder.__call__, Kernel.materialize

    def counting(self, context, node):
        found[now[0]] += 1
        return visit(self, context, node)

    def named(self, *given, **more):
        now[0] = self.func.__qualname__.replace(".<locals>", "")
        return read(self, *given, **more)

    Builder.__call__, Kernel.materialize = counting, named
    blast = Scene(read_mesh(PAPER_BLOCK), CONCRETE, "auto", loads=[effects.GasPressure()])
    simulate(blast, method=ImplicitDashpots(STEP), until=STEP, progress=None)
    batch = Batch(Automaton(), SceneTable(30, 1, 1e-4))
    batch.start()
    batch.advance(1)
    return found


@pytest.fixture(scope="module")
def nodes():
    """Those nodes, counted in a process of its own."""
    return call_in_process(nodes_of_kernels)


@pytest.mark.parametrize("name", BUDGET)
def test_a_kernel_of_the_default_scenes_keeps_its_size(nodes, name):
    assert 0 < nodes[name] <= 1.05 * BUDGET[name]


def test_no_other_kernel_of_the_default_scenes_is_large(nodes):
    assert sum(count for name, count in nodes.items() if name not in BUDGET) <= 1.05 * OTHERS


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
