"""Kernels of the default scenes keep their size: what is added to them, all wait for at each start.

Taichi walks through the trees of all functions that a kernel calls, 25 us a node, and LLVM works on
what comes of it. The number of nodes is the same on every machine; its budget is that of the day on
which it was last renewed, and a twentieth more.
"""

import pytest

from _bench_waits import sizes_of_kernels
from taichi_dem.kit.study import call_in_process

#: Nodes on 27 November 2026 by kernel, of those with more than a thousand; of all others together.
BUDGET = {
    "Resident._steps": 26784,
    "Resident._search": 10114,
    "Readings._visit": 3528,
    "Step.start": 3148,
    "_find_pairs": 2266,
    "Coupling.advance": 16068,
    "Coupling.start": 1765,
}
OTHERS = 1500


@pytest.fixture(scope="module")
def nodes():
    """Nodes of each kernel of the default scenes, read in a process of its own."""
    return {name: count for name, count, *_ in call_in_process(sizes_of_kernels)}


@pytest.mark.parametrize("name", BUDGET)
def test_a_kernel_of_the_default_scenes_keeps_its_size(nodes, name):
    assert 0 < nodes[name] <= 1.05 * BUDGET[name]


def test_no_other_kernel_of_the_default_scenes_is_large(nodes):
    assert sum(count for name, count in nodes.items() if name not in BUDGET) <= 1.05 * OTHERS
