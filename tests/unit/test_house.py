"""House rules that can be read off the source: who imports whom, who owns what, how long it is.

Every rule is a function from a Source to offences (line, sentence). The self-tests at the end show
that each rule refuses a small bad source and lets a good one pass.
"""

import ast
import re
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]

# Who may import whom. A module imports from its own row and from the rows above it, never from a
# row below. A folder counts as one module. A new module needs a place here.
LAYERS = {
    "taichi_dem": (
        ("kit",),
        ("meshes", "mesh", "shapes"),
        ("elasticity",),
        ("materials", "body_materials"),
        ("physics", "timeline", "closed_forms", "wave_moduli"),
        ("effects", "initial_motion"),
        ("scene",),
        ("stability",),
        ("methods",),
        ("contact_search",),
        ("step",),
        ("diagnostics",),
        ("engine",),
        ("simulation",),
        ("output", "measured_speedup", "measured_overhead", "paired_cost", "observers", "run_plan"),
        ("plot",),
        ("viewer",),
        ("result", "scene_pictures"),
        ("simulate", "needed_effects", "outcome"),
        ("workload", "step_study", "goals"),
        ("accuracy", "calibration"),
        ("solve",),
        ("demo",),
        ("__init__",),
        ("__main__",),
    ),
    "ca_damper": (
        (
            *("errors", "random_numbers", "progress", "measures", "report", "contracts"),
            *("certificate", "checked_range", "steady_state"),
        ),
        ("rk45", "oscillator", "structure", "record", "excitation", "bouncing"),
        ("gravity", "collect_and_collide", "decay", "impact_damper"),
        ("checks", "scenes"),
        ("window",),
        ("filling", "lattice"),
        ("fixed_mass", "automaton", "spheres"),
        ("combined",),
        ("engine",),
        ("activation",),
        ("batch", "needed_effects"),
        ("plot",),
        ("viewer",),
        ("film",),
        ("amplitude_response", "response", "shake", "shake_structure", "damper_map"),
        ("frequency_sweep", "force_check", "goals"),
        ("accuracy",),
        ("solve_response",),
        ("step_study",),
        ("demo_pictures",),
        ("demo",),
        ("__init__",),
        ("__main__",),
    ),
}
# What one package may take from another.
ACROSS = {"ca_damper": ("taichi_dem.kit",)}

# Libraries and the only places that import them.
OWNERS = {
    "matplotlib": ("taichi_dem/plot/", "taichi_dem/kit/plot_style.py", "ca_damper/plot/"),
    "gmsh": ("taichi_dem/mesh/gmsh.py",),
    "meshio": ("taichi_dem/mesh/files.py",),
    "scipy": ("experiments/",),
}
STARTER = "taichi_dem/kit/runtime.py"
# Sums in floating point depend on their order, and an atomic sum has none.
ATOMIC_SUMS = ("atomic_add", "atomic_sub")
FILE_LINES = 400
FUNCTION_LINES = 60
# Scripts that are read to learn: the science stands in them, words and pictures in a helper _x.py.
SHOWN = ("experiments/demo_*.py", "experiments/lessons/[!_]*.py")
SHOWN_LINES = 100
PYTHON = (3, 9)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


class Source(NamedTuple):
    """A parsed file. path: relative to the root, with slashes."""

    path: str
    text: str
    tree: ast.Module

    @property
    def package(self):
        return self.path.split("/")[0]

    @property
    def module(self):
        return self.path.split("/")[1].replace(".py", "")


def parsed(path, text):
    return Source(path, text, ast.parse(text, filename=path, feature_version=PYTHON))


def imported_names(source, tree=None):
    """(line, full dotted name) of everything imported, anywhere in the file or a tree of it."""
    for node in ast.walk(source.tree if tree is None else tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            folders = source.path.split("/")[: -node.level] if node.level else []
            base = [*folders, node.module] if node.module else folders
            for alias in node.names:
                yield node.lineno, ".".join([*base, alias.name])


def row_of(package, module):
    rows = [index for index, row in enumerate(LAYERS[package]) if module in row]
    return rows[0] if rows else None


def modules_have_a_layer(source):
    if source.package in LAYERS and row_of(source.package, source.module) is None:
        yield 1, f"'{source.module}' is not in LAYERS: add it to a row in tests/unit/test_house.py"


def imports_for_types(source):
    """What is imported in ``if TYPE_CHECKING`` blocks, as by imported_names."""
    for node in ast.walk(source.tree):
        if isinstance(node, ast.If) and last_name(node.test) == "TYPE_CHECKING":
            for statement in node.body:
                yield from imported_names(source, statement)


def imports_go_one_way(source):
    """Nothing is imported from a later layer, unless annotations alone need its name."""
    types = set(imports_for_types(source))
    for line, name in imported_names(source):
        parts = name.split(".")
        if (line, name) in types and parts[0] == source.package:
            continue
        if parts[0] in ("experiments", "tests"):
            yield line, f"imports {name}: nothing imports {parts[0]}"
        elif source.package in LAYERS and parts[0] in LAYERS:
            yield from refused_import(source, line, parts)


def refused_import(source, line, parts):
    package, target = source.package, ".".join(parts[:2])
    if parts[0] != package:
        if target not in ACROSS.get(package, ()):
            yield line, f"imports {target}: {package} takes nothing of that package"
        return
    # What is no module of the table comes from the package's front page, which sees them all.
    known = len(parts) > 1 and row_of(package, parts[1]) is not None
    row_target = row_of(package, parts[1] if known else "__init__")
    row = row_of(package, source.module)
    if row is not None and row_target > row:
        yield line, f"imports {target}, which lies in a later layer than {source.module}"


def libraries_stay_with_their_owners(source):
    for line, name in imported_names(source):
        owners = OWNERS.get(name.split(".")[0])
        if owners is not None and not source.path.startswith(owners):
            yield line, f"imports {name}, which only {' and '.join(owners)} may"


def no_star_imports(source):
    for line, name in imported_names(source):
        if name.endswith("*"):
            yield line, f"star import of {name[:-2]}"


def taichi_is_started_in_one_place(source):
    starts = [line for line, name in imported_names(source) if name == "taichi.init"]
    for node in ast.walk(source.tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node) in ("ti.init", "taichi.init"):
            starts.append(node.lineno)
    if source.path != STARTER:
        yield from ((line, f"ti.init outside {STARTER}") for line in starts)
    elif starts and not list(settings_named(source.tree, "fast_math")):
        yield starts[0], "ti.init without fast_math=False (taichi's default is True)"


def settings_named(tree, name):
    """(line, value) wherever something called name is set; value None for a parameter."""
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == name:
            yield node.value.lineno, node.value
        elif isinstance(node, ast.arg) and node.arg == name:
            yield node.lineno, None
        elif isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values):
                if isinstance(key, ast.Constant) and key.value == name:
                    yield value.lineno, value
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if name in [last_name(target) for target in targets]:
                yield node.lineno, node.value


def last_name(node):
    """The name in `name`, `any.thing.name` and `anything["name"]`."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return node.slice.value
    return getattr(node, "id", getattr(node, "attr", None))


def fast_math_stays_off(source):
    for line, value in settings_named(source.tree, "fast_math"):
        if not (isinstance(value, ast.Constant) and value.value is False):
            yield line, "fast_math must be the literal False: other values change the bits"


def counts_one(node):
    """Whether a call adds a literal whole number: counting has no rounding, in whatever order."""
    if not isinstance(node, ast.Call) or len(node.args) != 2:
        return False
    added = node.args[1]
    return isinstance(added, ast.Constant) and type(added.value) is int


def no_atomic_sums(source):
    if source.package not in LAYERS:
        return
    names = [(line, name.split(".")[-1]) for line, name in imported_names(source)]
    counters = {id(node.func) for node in ast.walk(source.tree) if counts_one(node)}
    for node in ast.walk(source.tree):
        if isinstance(node, (ast.Attribute, ast.Name)) and id(node) not in counters:
            names.append((node.lineno, last_name(node)))
    for line, name in names:
        if name in ATOMIC_SUMS:
            yield line, f"{name}: gather in a fixed order instead"


def section_lines(source):
    """Number of lines in sections of NumPy style: reference pages, which do not count as code."""
    found = 0
    for node in ast.walk(source.tree):
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and ast.get_docstring(node):
            lines = ast.get_docstring(node).split("\n")
            rules = [k for k, line in enumerate(lines) if re.fullmatch("-{3,}", line)]
            found += len(lines) - rules[0] + 1 if rules else 0
    return found


def on_device(function):
    """Whether a function is compiled by Taichi."""
    wrappers = {ast.unparse(one).split("(")[0] for one in function.decorator_list}
    return bool(wrappers & {"ti.func", "ti.kernel", "ti.pyfunc"})


def products_are_our_own(source):
    """Taichi's ``@`` computes and stores more than its sums: slower to run and to compile."""
    if source.package not in LAYERS:
        return
    compiled = [n for n in ast.walk(source.tree) if isinstance(n, FUNCTIONS) and on_device(n)]
    for function in compiled:
        for node in ast.walk(function):
            if isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, ast.MatMult):
                yield node.lineno, "@ in a kernel: use kit/products.py"


def files_stay_short(source):
    count = len(source.text.splitlines()) - section_lines(source)
    if count > FILE_LINES:
        yield count, f"{count} lines, at most {FILE_LINES} are allowed"


def shown_scripts_stay_short(source):
    count = len(source.text.splitlines())
    if count > SHOWN_LINES and any(fnmatchcase(source.path, pattern) for pattern in SHOWN):
        yield (
            count,
            f"{count} lines, at most {SHOWN_LINES}: words and pictures go to a helper _x.py",
        )


def functions_stay_short(source):
    for node in ast.walk(source.tree):
        if isinstance(node, FUNCTIONS):
            count = node.end_lineno - node.lineno + 1
            if ast.get_docstring(node) is not None:
                count -= node.body[0].end_lineno - node.body[0].lineno + 1
            if count > FUNCTION_LINES:
                yield node.lineno, f"{node.name} has {count} lines, at most {FUNCTION_LINES}"


def public_names_have_docstrings(source):
    if source.package not in LAYERS:
        return
    for node in source.tree.body:
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and not node.name.startswith("_"):
            if not ast.get_docstring(node):
                yield node.lineno, f"{node.name} has no docstring"


RULES = (
    modules_have_a_layer,
    imports_go_one_way,
    libraries_stay_with_their_owners,
    no_star_imports,
    taichi_is_started_in_one_place,
    fast_math_stays_off,
    no_atomic_sums,
    products_are_our_own,
    files_stay_short,
    shown_scripts_stay_short,
    functions_stay_short,
    public_names_have_docstrings,
)


def offences(source):
    found = [(line, sentence) for rule in RULES for line, sentence in rule(source)]
    return [f"{source.path}:{line}: {sentence}" for line, sentence in dict.fromkeys(found)]


def source_paths():
    folders = [*LAYERS, "experiments"]
    return [
        path.relative_to(ROOT).as_posix()
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*.py"))
    ]


@pytest.mark.parametrize("path", source_paths())
def test_source_keeps_the_house_rules(path):
    found = offences(parsed(path, (ROOT / path).read_text(encoding="utf-8")))
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize("package", LAYERS)
def test_layer_table_names_each_module_once(package):
    modules = [module for row in LAYERS[package] for module in row]
    assert len(modules) == len(set(modules))


# Self-tests: (rule, path, source, part of the sentence).
PHYSICS = "taichi_dem/physics/bond.py"
SCRIPT = "experiments/blast.py"
DEMO, LESSON = "experiments/demo_bar.py", "experiments/lessons/why_it_damps.py"
BAD = [
    (modules_have_a_layer, "taichi_dem/novelty.py", "", "'novelty' is not in LAYERS"),
    (imports_go_one_way, PHYSICS, "import taichi_dem.engine.model", "later layer"),
    (imports_go_one_way, PHYSICS, "from taichi_dem.engine.model import Model", "later layer"),
    (imports_go_one_way, PHYSICS, "from taichi_dem import step", "later layer"),
    (imports_go_one_way, PHYSICS, "from ..engine.model import Model", "later layer"),
    (imports_go_one_way, PHYSICS, "from .. import engine", "later layer"),
    (imports_go_one_way, PHYSICS, "from taichi_dem import CONCRETE", "later layer"),
    (imports_go_one_way, PHYSICS, "import taichi_dem", "later layer"),
    (imports_go_one_way, "taichi_dem/step/a.py", "from taichi_dem.engine import x", "later layer"),
    (imports_go_one_way, "taichi_dem/step/a.py", "def f():\n    from .. import simulate", "later"),
    (imports_go_one_way, PHYSICS, "if TYPE_CHECKING:\n    import ca_damper", "takes nothing"),
    (
        imports_go_one_way,
        PHYSICS,
        "if TYPE_CHECKING:\n    pass\nelse:\n    from .. import step",
        "later",
    ),
    (imports_go_one_way, "taichi_dem/scene.py", "from ca_damper import x", "takes nothing"),
    (imports_go_one_way, "ca_damper/batch.py", "from taichi_dem import mesh", "takes nothing"),
    (imports_go_one_way, "taichi_dem/plot.py", "import experiments.blast", "nothing imports"),
    (imports_go_one_way, SCRIPT, "from experiments import blast", "nothing imports"),
    (libraries_stay_with_their_owners, SCRIPT, "import matplotlib.pyplot as plt", "matplotlib"),
    (libraries_stay_with_their_owners, "taichi_dem/mesh/mesh.py", "import gmsh", "mesh/gmsh.py"),
    (
        libraries_stay_with_their_owners,
        "taichi_dem/mesh/mesh.py",
        "from meshio import x",
        "mesh/files",
    ),
    (libraries_stay_with_their_owners, PHYSICS, "import scipy.linalg", "experiments/"),
    (no_star_imports, SCRIPT, "from numpy import *", "star import of numpy"),
    (taichi_is_started_in_one_place, SCRIPT, "import taichi as ti\nti.init()", "outside"),
    (taichi_is_started_in_one_place, SCRIPT, "import taichi\ntaichi.init()", "outside"),
    (taichi_is_started_in_one_place, SCRIPT, "from taichi import init", "outside"),
    (taichi_is_started_in_one_place, STARTER, "import taichi as ti\nti.init()", "without fast"),
    (fast_math_stays_off, STARTER, "start(fast_math=True)", "literal False"),
    (fast_math_stays_off, STARTER, "start(fast_math=chosen)", "literal False"),
    (fast_math_stays_off, SCRIPT, "settings = {'fast_math': True}", "literal False"),
    (fast_math_stays_off, SCRIPT, "settings['fast_math'] = 1", "literal False"),
    (fast_math_stays_off, SCRIPT, "cfg().fast_math = True", "literal False"),
    (fast_math_stays_off, SCRIPT, "def start(fast_math=False): ...", "literal False"),
    (no_atomic_sums, PHYSICS, "ti.atomic_add(x[0], 1.0)", "atomic_add"),
    (no_atomic_sums, PHYSICS, "ti.atomic_add(x[0], y)", "atomic_add"),
    (no_atomic_sums, PHYSICS, "from taichi import atomic_sub as s", "atomic_sub"),
    (products_are_our_own, PHYSICS, "@ti.func\ndef f(a, b):\n    return a @ b", "kit/products"),
    (products_are_our_own, PHYSICS, "@ti.kernel\ndef f():\n    a @= b", "kit/products"),
    (files_stay_short, SCRIPT, "x = 1\n" * (FILE_LINES + 1), "401 lines"),
    (shown_scripts_stay_short, DEMO, "x = 1\n" * (SHOWN_LINES + 1), "101 lines"),
    (shown_scripts_stay_short, LESSON, "x = 1\n" * (SHOWN_LINES + 1), "101 lines"),
    (functions_stay_short, SCRIPT, "def f():\n" + "    x = 1\n" * FUNCTION_LINES, "61 lines"),
    (public_names_have_docstrings, PHYSICS, "def f():\n    return 1", "f has no docstring"),
    (public_names_have_docstrings, PHYSICS, "class C:\n    x = 1", "C has no docstring"),
]


@pytest.mark.parametrize(("rule", "path", "text", "part"), BAD)
def test_rule_refuses_a_bad_source(rule, path, text, part):
    sentences = [sentence for _, sentence in rule(parsed(path, text))]
    assert len(sentences) == 1
    assert part in sentences[0]


DOCUMENTED = '"""One.\n' + "Long.\n" * 100 + '"""\n'
GOOD = {
    STARTER: "import taichi as ti\nti.init(fast_math=False)\nimport taichi_dem.kit.errors",
    PHYSICS: "from taichi_dem.kit.types import x\nfrom . import rotation\nti.atomic_add(n[0], 1)",
    "taichi_dem/closed_forms.py": "def _f(a, b):\n    return a @ b",
    "taichi_dem/contact_search/reach.py": "if TYPE_CHECKING:\n    from ..engine.state import State",
    "taichi_dem/engine/model.py": "from ..physics.bond import f\nfrom taichi_dem import materials",
    "taichi_dem/kit/plot_style.py": "import matplotlib\ndef _hidden():\n    pass",
    # Sections of docstrings are reference pages.
    "taichi_dem/kit/long.py": 'def f():\n    """A.\n\n    Notes\n    -----\n'
    + 400 * "    b\n"
    + '    """\n',
    "taichi_dem/__init__.py": "from taichi_dem.simulate import simulate",
    "ca_damper/batch.py": "from taichi_dem.kit import runtime\nfrom ca_damper.lattice import x",
    SCRIPT: "import _cli\nfrom taichi_dem import CONCRETE, plot\nimport scipy\nplot.init()",
    DEMO: "x = 1\n" * SHOWN_LINES,
    "experiments/_demo_bar.py": "x = 1\n" * (SHOWN_LINES + 1),
    "experiments/lessons/_bar.py": "x = 1\n" * (SHOWN_LINES + 1),
    "taichi_dem/step/parallel.py": "def f():\n    " + DOCUMENTED + "    x = 1\n" * 59,
}


@pytest.mark.parametrize("path", GOOD)
def test_rules_pass_a_good_source(path):
    assert offences(parsed(path, GOOD[path])) == []


def test_source_that_python_3_9_cannot_read_is_refused():
    with pytest.raises(SyntaxError):
        parsed(PHYSICS, "match x:\n    case 1:\n        pass")
