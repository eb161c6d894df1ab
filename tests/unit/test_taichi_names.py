"""Private names of Taichi: what only saves time may be missing, the rest is named in a sentence."""

import ast
import inspect
import json
import os
import subprocess
import sys

import pytest

from taichi_dem.kit import allocation, kernel_source_cache, launch
from taichi_dem.kit.taichi_names import NEEDED, WANTED, named
from tests.attack import bits
from tests.scenes import ROOT
from tests.unit.test_source_rules import PATHS, parsed

#: All that saves time only, but for what Taichi itself looks up on a class, or promises.
SAVING = {
    path.removesuffix(".get_pos_info")
    for place, name, _, more in kernel_source_cache._REPLACED
    for path in (f"{place}.{name}", *more.split())
    if place != "taichi"
} | {launch._ERRORS, allocation._PLACES[0]}
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


def without(names, version, *works):
    """What a program of these works says and warns of, without some names of Taichi."""
    given = json.dumps(sorted(names)), json.dumps(version)
    environment = {**os.environ, "PYTHONPATH": ROOT, "ENABLE_TAICHI_HEADER_PRINT": "0"}
    line = [sys.executable, "-c", _WITHOUT, *given, *works]
    return subprocess.run(line, capture_output=True, text=True, cwd=ROOT, env=environment)


def of_the_version(done):
    """Lines of its errors that say which Taichi is wanted."""
    return [line for line in done.stderr.splitlines() if "taichi must be 1.7.4" in line]


@pytest.mark.parametrize(
    ("names", "version", "works"),
    [(SAVING, WANTED, ("blast", "damper")), ((), (1, 7, 5), ("damper",))],
    ids=["names", "version"],
)
def test_without_what_saves_time_the_bits_are_the_same_and_one_sentence_says_it(
    names, version, works
):
    done = without(names, version, *works)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == [getattr(bits, work)() for work in works]
    (sentence,) = of_the_version(done)
    assert "got {}.{}.{}".format(*version) in sentence


def test_without_a_name_that_is_needed_a_sentence_says_which_taichi_is():
    done = without(["taichi.lang.util.to_numpy_type"], WANTED)
    assert done.returncode == 1
    (sentence,) = of_the_version(done)
    assert sentence == done.stderr.splitlines()[-1]
    assert "taichi.lang.util.to_numpy_type" in sentence


KNOWN = {f"{place}.{name}" for place in NEEDED for name in NEEDED[place].split()}


def test_every_private_name_that_a_module_takes_is_looked_for():
    """Modules of Taichi are private; what is imported from them, or taken of one, is in a table."""
    known = KNOWN | {*NEEDED}
    modules, missing = {}, set()
    for path in PATHS:
        tree = parsed(path)
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("taichi."):
                for one in node.names:
                    full = f"{node.module}.{one.name}"
                    if inspect.ismodule(named(full)):
                        modules[path, one.asname or one.name] = full
                    elif full not in known:
                        missing.add(full)
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                module = modules.get((path, node.value.id))
                if module and f"{module}.{node.attr}" not in known:
                    missing.add(f"{module}.{node.attr}")
    assert missing == set()
