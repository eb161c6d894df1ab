"""What kernels may not say: ``+=`` on a field, which is atomic and may hide its sum from a read.

Taichi lets several threads add to one entry. A read after that, in the same run of statements as
one before it, may be given the earlier value where ``advanced_optimization`` is off: the pass that
merges reads looks for plain writes between them only. Taichi 1.7 never shows it, because each
mention of an entry has a pointer of its own when that pass runs; Quadrants, its successor, merges
the pointers first.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("taichi_dem", "ca_damper")


def atomic_sums(text):
    """Lines of a source in which a kernel or ti.func adds to an entry of a field in place."""
    return [
        node.lineno
        for function in ast.walk(ast.parse(text))
        if isinstance(function, ast.FunctionDef) and runs_on_the_device(function)
        for node in ast.walk(function)
        if isinstance(node, ast.AugAssign) and is_of_a_field(node.target, function)
    ]


def runs_on_the_device(function):
    """Whether a function is a kernel or a ti.func."""
    marks = [getattr(mark, "attr", "") for mark in function.decorator_list]
    return "kernel" in marks or "func" in marks


def is_of_a_field(target, function):
    """Whether a target is an entry of a field: no variable of the function, nor a part of one."""
    base, is_entry = target, False
    while isinstance(base, (ast.Subscript, ast.Attribute)):
        is_entry = is_entry or isinstance(base, ast.Subscript)
        base = base.value
    name = getattr(base, "id", "")
    return name in template_parameters(function) or (is_entry and name not in values(function))


def template_parameters(function):
    """Parameters that stand for what the caller names, such as an entry of a field."""
    named = [argument for argument in function.args.args if argument.annotation is not None]
    return {argument.arg for argument in named if "template" in ast.unparse(argument.annotation)}


def values(function):
    """Variables that a function assigns; what ti.static gives may be a field."""
    assigned = [node for node in ast.walk(function) if isinstance(node, ast.Assign)]
    plain = [node for node in assigned if "static" not in ast.unparse(node.value)]
    parts = [part for node in plain for target in node.targets for part in ast.walk(target)]
    names = [part for part in parts if isinstance(part, ast.Name)]
    return {name.id for name in names if isinstance(name.ctx, ast.Store)}


def sources():
    """Paths of all modules of the packages."""
    found = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return [path.relative_to(ROOT).as_posix() for path in found]


@pytest.mark.parametrize("path", sources())
def test_no_kernel_adds_to_a_field_in_place(path):
    lines = atomic_sums((ROOT / path).read_text(encoding="utf-8"))
    assert not lines, f"{path}, lines {lines}: write x[i] = x[i] + y instead of x[i] += y"


@pytest.mark.parametrize(
    "function",
    [
        "(self, i, y):\n    self.x[i] += y",
        "(self, i, y):\n    self.x[i][2] -= y",
        "(self, i, y):\n    self.x[i].xyz += y",
        "(self, i, y):\n    self.x[i] = y\n    self.x[i] += y",
        "(self, i, y):\n    if y > 0:\n        self.n[None] |= 1 << i",
        "(x: ti.types.ndarray()):\n    for i in x:\n        x[i] += 1",
        "(x: ti.template(), i, y):\n    x[i] += y",
        "(entry: ti.template(), y):\n    entry += y",
        "(self, i, y):\n    x = ti.static(self.x)\n    x[i] += y",
        "(self, i, y):\n    for x in ti.static(self.fields):\n        x[i] += y",
    ],
)
def test_sum_in_place_is_found(function):
    for mark in ("func", "kernel"):
        assert len(atomic_sums(f"@ti.{mark}\ndef f{function}")) == 1


@pytest.mark.parametrize(
    "source",
    [
        "@ti.func\ndef f(self, i, y):\n    self.x[i] = self.x[i] + y",
        "@ti.func\ndef f(self, i, y):\n    a, b = self.x[i], 0.0\n    a[2] += y\n    b -= y",
        "@ti.func\ndef f(motion, y):\n    motion.velocity += y\n    return motion",
        "@ti.func\ndef f(self, i):\n    ti.atomic_add(self.count[None], 1)",
        "def f(self, i, y):\n    self.table[i] += y",
        "@property\ndef f(self):\n    self.table[0] += 1",
    ],
)
def test_other_sums_are_let_pass(source):
    assert atomic_sums(source) == []
