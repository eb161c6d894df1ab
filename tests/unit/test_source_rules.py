"""No module imports a later layer, no sum depends on threads, and Taichi starts in one place.

The wheel carries all files of both packages; every mutant of the table can be made.
"""

import ast
import tomllib
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

from tests.mutants import faults, table

ROOT = Path(__file__).resolve().parents[2]
# A module imports from its own layer and those before it; a folder counts as one module.
LAYERS = {
    "taichi_dem": """
        kit | meshes mesh shapes | materials | elasticity | physics | state
        | laws | loads | effects | scene | step_control | methods | contact
        | stability | step | report | engine | simulation
        | output observers | plot | viewer
        | result saved_run | simulate needed_effects | goals
        | accuracy | solve | demo | __init__ | __main__""",
    "ca_damper": """
        errors report | oscillator excitation | theory | scenes | filling structure
        | engine | fixed_mass automaton spheres | batch | plot
        | runs | goals | accuracy | solve_response
        | demo_pictures | demo | __init__ | __main__""",
}
ROWS = {
    package: {name: k for k, row in enumerate(text.split("|")) for name in row.split()}
    for package, text in LAYERS.items()
}
PATHS = [
    path.relative_to(ROOT).as_posix()
    for package in LAYERS
    for path in sorted((ROOT / package).rglob("*.py"))
]


def text_of(path):
    return (ROOT / path).read_text(encoding="utf-8")


def parsed(path):
    return ast.parse(text_of(path))


def imported(tree):
    """Full names of all that is imported anywhere, also for types alone."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def later(path):
    """Names that a module imports from a later layer, or from where it may not."""
    package, module = path.removesuffix(".py").split("/")[:2]
    for name in imported(parsed(path)):
        parts = [*name.split("."), "__init__"]
        if parts[0] == package:
            # What is no module comes from the package's front page, which sees them all.
            row = ROWS[package].get(parts[1], ROWS[package]["__init__"])
            allowed = row <= ROWS[package][module]
        else:
            # Of the other package ca_damper may take the kit.
            allowed = parts[0] not in ("tests", "experiments", *LAYERS)
            allowed = allowed or (package == "ca_damper" and parts[:2] == ["taichi_dem", "kit"])
        if not allowed:
            yield path, name


def test_every_module_has_a_layer_and_imports_nothing_from_a_later_one():
    assert [found for path in PATHS for found in later(path)] == []


def test_no_module_imports_itself_by_way_of_others():
    named = [path.removesuffix(".py").removesuffix("/__init__").replace("/", ".") for path in PATHS]
    paths, before = dict(zip(named, PATHS)), {}
    for module, path in paths.items():
        names = set(imported(parsed(path)))
        modules = {name if name in paths else name.rpartition(".")[0] for name in names}
        before[module] = modules & {*paths} - {module}
    TopologicalSorter(before).prepare()  # raises CycleError


#: Classes that users know by the same name in both packages.
OF_BOTH = {"Certificate", "Goal", "Report", "SimulationDiverged"}


def test_a_class_name_stands_once():
    nodes = [node for path in PATHS for node in ast.walk(parsed(path))]
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    assert {name for name, count in names.items() if count > 1} == OF_BOTH


def atomic_sums(tree):
    """Lines where threads may add to one entry of a field in any order, or hide it from a read."""
    for function in ast.walk(tree):
        marks = [ast.unparse(mark) for mark in getattr(function, "decorator_list", ())]
        if {"ti.func", "ti.kernel"} & set(marks):
            own = variables(function)
            for node in ast.walk(function):
                if isinstance(node, ast.AugAssign) and is_of_a_field(node.target, own):
                    yield node.lineno
                elif isinstance(node, ast.Call) and "atomic_add" in ast.unparse(node.func):
                    # Counting has no rounding, in whatever order.
                    if not isinstance(getattr(node.args[1], "value", None), int):
                        yield node.lineno


def variables(function):
    """Names that a function assigns; what ti.static gives may be a field."""
    made = [node for node in ast.walk(function) if isinstance(node, ast.Assign)]
    plain = [node for node in made if "static" not in ast.unparse(node.value)]
    parts = [part for node in plain for one in node.targets for part in ast.walk(one)]
    return {p.id for p in parts if isinstance(p, ast.Name) and isinstance(p.ctx, ast.Store)}


def is_of_a_field(target, own):
    has_index = any(isinstance(node, ast.Subscript) for node in ast.walk(target))
    return has_index and ast.unparse(target).split("[")[0].split(".")[0] not in own


def test_no_kernel_adds_to_a_field_in_place():
    kernels = [path for path in PATHS if "@ti." in text_of(path)]
    assert [(path, line) for path in kernels for line in atomic_sums(parsed(path))] == []


def test_taichi_starts_in_one_place():
    """With fast_math off, as other settings change the bits."""
    paths = [path for path in PATHS if "ti.init(" in text_of(path)]
    assert paths == ["taichi_dem/kit/runtime.py"]
    assert "fast_math=False" in text_of(paths[0])


#: Endings of what a package has without being named, and of what Python leaves there.
OF_PACKAGES = ".py", ".typed", ".pyc"


def test_the_wheel_carries_all_files_of_both_packages():
    """Those that are no modules are named, and every folder is a package."""
    named = tomllib.loads(text_of("pyproject.toml"))["tool"]["setuptools"]["package-data"]
    folders = [(ROOT / package.replace(".", "/"), named[package]) for package in named]
    carried = {path for folder, names in folders for name in names for path in folder.glob(name)}
    found = [path for package in LAYERS for path in (ROOT / package).rglob("*") if path.is_file()]
    assert {path for path in found if path.suffix not in OF_PACKAGES} == carried
    assert all((path.parent / "__init__.py").exists() for path in found if path.suffix == ".py")


def test_every_mutant_can_be_made_and_names_tests_that_are_there():
    assert [fault for mutant in table() for fault in faults(mutant)] == []


#: Functions that no device has in doubles, or each in bits of its own: ``kit.elementary`` has some.
ELEMENTARY = {"sin", "cos", "tan", "asin", "acos", "atan2", "exp", "log", "pow", "tanh"}


def test_kernels_call_no_elementary_function_of_a_device():
    nodes = [(path, node) for path in PATHS for node in ast.walk(parsed(path))]
    calls = [(path, node) for path, node in nodes if isinstance(node, ast.Attribute)]
    of_taichi = [(path, one) for path, one in calls if ast.unparse(one.value) in ("ti", "ti.math")]
    assert [(path, one.lineno) for path, one in of_taichi if one.attr in ELEMENTARY] == []
