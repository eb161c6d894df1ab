"""Public functions of the host modules say the types of what they take and give.

mypy (``make lint``) checks calls against these types; a function without them is not checked.
Kernels are left out, as Taichi reads their annotations itself.
"""

import ast

import pytest

from tests.unit.test_house import FUNCTIONS, ROOT, last_name, parsed

# Folders and files, relative to the root. Others are added as they are annotated.
ANNOTATED = (
    *("taichi_dem/kit", "taichi_dem/mesh", "taichi_dem/output"),
    *("taichi_dem/scene.py", "taichi_dem/methods.py", "taichi_dem/materials.py"),
    *("taichi_dem/needed_effects.py", "taichi_dem/result.py", "taichi_dem/workload"),
    *("taichi_dem/stability/mesh_limits.py", "taichi_dem/stability/quality.py"),
    "taichi_dem/stability/step_report.py",
    *("ca_damper/measures.py", "ca_damper/report.py", "ca_damper/record.py"),
    *("ca_damper/scenes/table.py", "ca_damper/lattice.py", "ca_damper/oscillator.py"),
)
ON_THE_DEVICE = ("func", "kernel", "pyfunc", "real_func")
# Dunder methods whose types a caller depends on; the others have those that Python demands.
CALLED = ("__init__", "__call__", "__enter__")


def annotated_paths():
    """Source files that ANNOTATED names, in order."""
    for name in ANNOTATED:
        place = ROOT / name
        yield from [place] if place.is_file() else sorted(place.rglob("*.py"))


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


@pytest.mark.parametrize("path", [path.relative_to(ROOT).as_posix() for path in annotated_paths()])
def test_public_functions_are_annotated(path):
    found = list(unannotated(parsed(path, (ROOT / path).read_text(encoding="utf-8"))))
    assert not found, "\n" + "\n".join(f"{path}:{line}: {text}" for line, text in found)


@pytest.mark.parametrize("name", ANNOTATED)
def test_names_of_annotated_places_exist(name):
    assert (ROOT / name).exists()


@pytest.mark.parametrize("name", ANNOTATED)
def test_bodies_of_annotated_places_are_checked_too(name):
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    module = name.replace(".py", "").replace("/", ".") + ("" if name.endswith(".py") else ".*")
    blocks = settings.split("[[tool.mypy.overrides]]")
    (checked,) = [block for block in blocks if "check_untyped_defs = true" in block]
    assert f'"{module}"' in checked


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
