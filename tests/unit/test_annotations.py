"""Public functions of the host modules say the types of what they take and give.

mypy (``make lint``) checks calls against these types; a function without them is not checked.
Kernels are left out, as Taichi reads their annotations itself.
"""

import ast

import pytest

from tests.unit.test_house import FUNCTIONS, ROOT, last_name, parsed

# Every module of these counts.
PACKAGES = ("taichi_dem", "ca_damper")
ON_THE_DEVICE = ("func", "kernel", "pyfunc", "real_func")
# Dunder methods whose types a caller depends on; the others have those that Python demands.
CALLED = ("__init__", "__call__", "__enter__")


def annotated_paths():
    """Source files of the packages that must have types, relative to the root, in order."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path.relative_to(ROOT).as_posix()


def is_public(node):
    return node.name in CALLED or not node.name.startswith("_")


def public_functions(body, owner=""):
    """(dotted name, function) of the public functions of a module and its public classes."""
    for node in body:
        if isinstance(node, ast.ClassDef) and is_public(node):
            yield from public_functions(node.body, f"{owner}{node.name}.")
        elif isinstance(node, FUNCTIONS) and is_public(node) and not is_on_device(node):
            yield f"{owner}{node.name}", node


def is_on_device(function):
    return any(last_name(decorator) in ON_THE_DEVICE for decorator in function.decorator_list)


def unannotated(source):
    """(line, sentence) for each public function that lacks the type of an argument or result."""
    for name, function in public_functions(source.tree.body):
        missing = [argument.arg for argument in bare_arguments(function, "." in name)]
        if function.returns is None and function.name != "__init__":
            missing.append("the result")
        if missing:
            yield function.lineno, f"{name} lacks types: {', '.join(missing)}"


def bare_arguments(function, is_method):
    """Arguments without a type; a method's first one needs none."""
    given = function.args
    positional = [*given.posonlyargs, *given.args]
    static = any(last_name(d) == "staticmethod" for d in function.decorator_list)
    first = 1 if is_method and not static else 0
    others = [given.vararg, *given.kwonlyargs, given.kwarg]
    several = [*positional[first:], *(argument for argument in others if argument is not None)]
    return [argument for argument in several if argument.annotation is None]


@pytest.mark.parametrize("path", list(annotated_paths()))
def test_public_functions_are_annotated(path):
    found = list(unannotated(parsed(path, (ROOT / path).read_text(encoding="utf-8"))))
    assert not found, "\n" + "\n".join(f"{path}:{line}: {text}" for line, text in found)


def test_modules_of_every_folder_count():
    found = list(annotated_paths())
    assert {"taichi_dem/simulate.py", "taichi_dem/step/implicit/bonds.py"} < set(found)
    assert {"ca_damper/frequency_sweep.py", "ca_damper/automaton/accounting/protocol.py"} < set(
        found
    )


def test_no_module_is_left_unchecked_and_bodies_without_types_are_checked_too():
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    general, *overrides = settings.partition("[tool.mypy]")[2].split("[[tool.mypy.overrides]]")
    assert "check_untyped_defs = true" in general and "ignore_errors" not in settings
    assert not any("check_untyped_defs" in block for block in overrides)


BAD = {
    "def f(x): pass": "f lacks types: x, the result",
    "def f(x: int): pass": "f lacks types: the result",
    "def f(*x, y: int = 1, **z) -> None: pass": "f lacks types: x, z",
    "class C:\n    def __init__(self, x): pass": "C.__init__ lacks types: x",
    "class C:\n    def __enter__(self): pass": "C.__enter__ lacks types: the result",
    "class C:\n    @property\n    def f(self): pass": "C.f lacks types: the result",
    "class C:\n    @staticmethod\n    def f(x) -> int: pass": "C.f lacks types: x",
}


@pytest.mark.parametrize("text", BAD)
def test_what_lacks_a_type_is_found(text):
    assert [sentence for _, sentence in unannotated(parsed("a.py", text))] == [BAD[text]]


GOOD = (
    "def f(x: int, *y: int, z: int = 1) -> None: pass",
    "def _f(x): pass",
    "class _C:\n    def f(self, x): pass",
    "class C:\n    def __init__(self): pass\n    def __repr__(self): pass",
    "@ti.func\ndef f(x): pass",
    "class C:\n    @ti.kernel\n    def f(self, x): pass",
    "def f() -> None:\n    def g(x): pass",
)


@pytest.mark.parametrize("text", GOOD)
def test_private_and_device_functions_need_no_types(text):
    assert list(unannotated(parsed("a.py", text))) == []
