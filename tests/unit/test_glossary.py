"""The glossary: words that have been replaced name nothing in the packages any more.

Names are those of modules, classes, functions, attributes and arguments where they are defined;
local variables are free. Case and underscores at the ends do not count.
"""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("taichi_dem", "ca_damper")

#: No part of any name, by what stands for them now.
PARTS = {
    "acted": "effect_activity, is_active",
    "askings": "runs",
    "blow": "wall_impulse, impact",
    "declines": "refused",
    "encounters": "collisions",
    "gave": "impulse",
    "health": "divergence",
    "keeper": "CheckpointWriter",
    "leeway": "skin",
    "lookout": "pair_store",
    "missed": "missing",
    "news": "new_faces",
    "owes": "is_pending",
    "paid": "applied_until",
    "payments": "applied_until",
    "quicker": "auto_driver",
    "realised": "measured_speedup",
    "rivals": "conflict_resolution",
    "room": "capacity",
    "rough": "exposed",
    "rouse": "wake_up",
    "tally": "event_counts",
}
#: No name as a whole.
NAMES = {
    "due": "active",
    "due_list": "active_list",
    "everything": "AllImpulses",
    "fields_first": "field_tree",
    "flight": "transport",
    "gained": "impulse",
    "gone": "escaped",
    "judge": "check_convergence",
    "ledger": "energy_balance",
    "monitor": "hole_monitor",
    "near": "contact_limits, neighbours",
    "near_spheres": "narrow_phase",
    "put_in_order": "reorder",
    "rates": "stability_limits, limits",
    "resolution": "step_resolution",
    "settle": "apply_changes",
    "source_lines": "kernel_source_cache",
    "take_bond": "apply_bond",
    "then": "engine.load",
    "tick_on": "advance_clock",
    "time_limit": "timeout",
    "touch": "contact_force",
    "wake": "wake_up",
    "watch": "missing_effects",
    "within": "run_with_timeout",
}
#: No module and no class, by package.
TITLES = {
    "taichi_dem": {
        "candidates": "the pair store",
        "cells": "cell_grid",
        "fields": "allocation",
        "motion": "velocities",
        "neighbours": "verlet_list",
        "numbering": "the pair store",
        "old_pairs": "the pair store",
        "saved": "RunSnapshot",
    },
    "ca_damper": {
        "bound": "device",
        "laws": "collision_laws",
        "numbers": "Parameters",
        "parts": "components",
    },
}
#: No function and no method: each has a verb that names its effect.
VERBS = ("act", "ahead", "full", "happen", "keep", "known", "look", "place", "take", "tell")

#: Names that are left, by file. This list is to shrink: a name in it that no longer exists fails.
REMAINING = {
    # Options that users give.
    ("taichi_dem/stability/step_control.py", "wake"),
    ("ca_damper/automaton/options.py", "ledger"),
}


def definitions(path, text):
    """(kind, name) of all that a file defines and others can name: the module is the first."""
    name = Path(path).stem
    found = [("title", Path(path).parent.name if name == "__init__" else name)]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ClassDef):
            found.append(("title", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", node.name)))
            found += [("name", entry) for entry in class_fields(node)]
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            found.append(("verb", node.name))
        elif isinstance(node, ast.arg):
            found.append(("name", node.arg))
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.append(("name", node.attr))
    return [(kind, name.strip("_").lower()) for kind, name in found]


def class_fields(node):
    """Names that the body of a class assigns or annotates."""
    for entry in node.body:
        targets = entry.targets if isinstance(entry, ast.Assign) else [entry]
        for target in targets:
            target = getattr(target, "target", target)
            if isinstance(target, ast.Name):
                yield target.id


def holds_replaced_word(package, kind, name):
    """Whether a name holds a word that has been replaced."""
    if PARTS.keys() & set(name.split("_")) or name in NAMES:
        return True
    if kind == "title":
        return name in TITLES[package]
    return kind == "verb" and name in VERBS


def replaced_in(path, text):
    """Names with replaced words that a file defines."""
    package = path.split("/")[0]
    return {
        name for kind, name in definitions(path, text) if holds_replaced_word(package, kind, name)
    }


@pytest.fixture(scope="module")
def found():
    """(path, name) of all names in the packages that hold a replaced word."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return {
        (path.relative_to(ROOT).as_posix(), name)
        for path in paths
        for name in replaced_in(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"))
    }


def test_replaced_words_name_nothing(found):
    assert sorted(found - REMAINING) == []


def test_names_that_are_left_are_still_there(found):
    assert sorted(REMAINING - found) == []


BAD = [
    ("taichi_dem/step/near.py", "", "near"),
    ("taichi_dem/step/cells.py", "", "cells"),
    ("taichi_dem/watch/__init__.py", "", "watch"),
    ("taichi_dem/a.py", "class OldPairs: ...", "old_pairs"),
    ("taichi_dem/a.py", "class A:\n    acted: int = 0", "acted"),
    ("taichi_dem/a.py", "class A:\n    MOST_ROOM = 3", "most_room"),
    ("taichi_dem/a.py", "def _keep(): ...", "keep"),
    ("taichi_dem/a.py", "def f(old_leeway): ...", "old_leeway"),
    ("taichi_dem/a.py", "def f(self):\n    self.b.rates = 1", "rates"),
    ("taichi_dem/a.py", "def f(self):\n    self.a, self.due = 1, 2", "due"),
    ("ca_damper/a.py", "class Parts: ...", "parts"),
]


@pytest.mark.parametrize(("path", "text", "name"), BAD)
def test_a_replaced_word_is_found(path, text, name):
    assert replaced_in(path, text) == {name}


GOOD = [
    ("ca_damper/cells.py", "class Motion: ..."),
    ("taichi_dem/mesh/parts.py", "def bond_rates(nearest, roomy): ..."),
    ("taichi_dem/a.py", "def f(near_by):\n    room = near_by.room\n    return room.look()"),
    ("taichi_dem/a.py", "def take_step(self):\n    self.known = self.ahead = 1"),
]


@pytest.mark.parametrize(("path", "text"), GOOD)
def test_other_names_pass(path, text):
    assert replaced_in(path, text) == set()
