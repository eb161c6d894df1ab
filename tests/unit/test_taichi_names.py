"""What is taken of Taichi: private names, some of which may be missing, and how it reads kernels.

What only saves time may be missing, the rest is named in a sentence. Taichi walks through the trees
of all functions that a kernel calls, 25 us a node, and LLVM works on what comes of it.
"""

import ast
import inspect
import json
import os
import re
import subprocess
import sys
from collections import Counter

import pytest
import taichi as ti
from taichi.lang.ast.ast_transformer_utils import Builder

from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene, effects, read_mesh, simulate
from taichi_dem.kit.study import call_in_process
from taichi_dem.kit.taichi_patches import kernel_source_cache
from taichi_dem.kit.taichi_patches.names import NEEDED, SWITCH, WANTED, are_on, named
from tests.attack import bits
from tests.equivalence.test_digests import STORED
from tests.scenes import ROOT
from tests.unit.test_source_rules import PATHS, parsed

#: All that saves time only, but for what Taichi itself looks up on a class, or promises.
OF_PATCHES = {
    *(f"{place}.{name}" for place, name, _ in kernel_source_cache._REPLACED if place != "taichi"),
    "taichi.lang.kernel_impl._BoundedDifferentiableMethod",
    "taichi.lang.kernel_impl._KERNEL_CLASS_STACKFRAME_STMT_RES",
    "taichi.lang.exception.handle_exception_from_cpp",
    "taichi._lib.core.SNode.cell_size_bytes",
} - {f"{kernel_source_cache._CONTEXT}.get_pos_info"}
#: Deletes names from Taichi, where Taichi itself still finds those that it needs, then imports us.
_WITHOUT = """
import builtins, importlib, json, sys
import taichi
for path in json.loads(sys.argv[1]):
    place, name = path.rsplit(".", 1)
    owner = taichi
    for part in place.split(".")[1:]:
        owner = getattr(owner, part)
    if not isinstance(owner, type):
        setattr(builtins, name, getattr(owner, name))
    delattr(owner, name)
taichi.__version__ = tuple(json.loads(sys.argv[2]))
from taichi_dem import runtime
from tests.attack import bits
runtime.start(threads=1)
print(json.dumps([getattr(bits, work)() for work in sys.argv[3:]]))
"""


def without(names, version, *works, switch="on"):
    """What a program of these works says and warns of, without some names of Taichi."""
    given = json.dumps(sorted(names)), json.dumps(version)
    environment = {**os.environ, "PYTHONPATH": ROOT, "ENABLE_TAICHI_HEADER_PRINT": "0"}
    environment[SWITCH] = switch
    line = [sys.executable, "-c", _WITHOUT, *given, *works]
    return subprocess.run(line, capture_output=True, text=True, cwd=ROOT, env=environment)


def test_without_patches_the_bits_are_the_same():
    """Nothing is said of it, as it was asked for."""
    done = without(OF_PATCHES, WANTED, "blast", "damper", switch="off")
    assert (done.returncode, done.stderr) == (0, "")
    stored = json.loads(STORED.read_text())[bits.RUN]
    assert json.loads(done.stdout.splitlines()[-1]) == [stored, bits.damper()]


def test_another_taichi_runs_without_patches_and_one_sentence_says_it():
    done = without(OF_PATCHES, (1, 7, 5))
    assert done.returncode == 0, done.stderr
    (sentence,) = [line for line in done.stderr.splitlines() if "taichi must be" in line]
    assert "got 1.7.5" in sentence


def test_the_switch_is_on_or_off():
    done = without((), WANTED, switch="of")
    assert done.returncode == 1
    assert SWITCH in done.stderr.splitlines()[-1]


def test_without_a_name_that_is_needed_a_sentence_says_which_taichi_is():
    done = without(["taichi.lang.util.to_numpy_type"], WANTED)
    assert done.returncode == 1
    sentence = done.stderr.splitlines()[-1]
    assert "taichi must be" in sentence and "taichi.lang.util.to_numpy_type" in sentence


def test_every_private_name_that_a_module_imports_is_looked_for():
    """Modules of Taichi are private; what is imported from them is in a table."""
    known = {*NEEDED} | {f"{place}.{name}" for place in NEEDED for name in NEEDED[place].split()}
    nodes = [node for path in PATHS for node in ast.walk(parsed(path))]
    taken = [node for node in nodes if isinstance(node, ast.ImportFrom)]
    private = [node for node in taken if (node.module or "").startswith("taichi.")]
    names = {f"{node.module}.{one.name}" for node in private for one in node.names}
    assert {name for name in names if not inspect.ismodule(named(name))} <= known


#: Tree nodes of all kernels of the default scenes on 29 November 2026: of the step and the search
#: of the paper's block, and of the damper's step; the same on every machine.
BUDGET = {"blast": 61003, "damper": 18505}


def nodes_of_kernels():
    """Tree nodes of the kernels of the default scenes, by package."""
    found, visit = Counter(), Builder.__call__

    def counting(self, context, node):
        found[package] += 1
        return visit(self, context, node)

    Builder.__call__ = counting
    package = "blast"
    blast = Scene(read_mesh(PAPER_BLOCK), CONCRETE, "auto", loads=[effects.GasPressure()])
    simulate(blast, method=ImplicitDashpots(4e-7), until=4e-7, progress=None)
    package = "damper"
    batch = Batch(Automaton(), SceneTable(30, 1, 1e-4))
    batch.start()
    batch.advance(1)
    return found


@pytest.mark.skipif(not are_on(), reason="without patches, Taichi also reads fields by kernels")
def test_kernels_of_the_default_scenes_keep_their_size():
    """A twentieth more than on the day on which the budget was last renewed."""
    nodes = call_in_process(nodes_of_kernels)
    assert {*nodes} == {*BUDGET}
    assert all(nodes[name] <= 1.05 * BUDGET[name] for name in BUDGET), nodes


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
