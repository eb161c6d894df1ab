"""Every example of a docstring, also one that is skipped, calls what is there as it may be called.

Names are followed through an example: ``result = simulate(...)`` makes ``result`` a Result, and
``result.show(...)`` must fit its signature.
"""

import ast
import builtins
import doctest
import importlib
import inspect
import re
import textwrap
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from ca_damper import Response
from docs.site.docstrings import parsed
from docs.site.public_api import PACKAGES, ours
from taichi_dem import Material, Mesh, Scene
from taichi_dem.result import Result

ROOT = Path(__file__).parents[2]
#: What examples begin with, besides the names of their package and module; modules have these names
#: too.
GIVEN = {
    **{"scene": Scene, "result": Result, "mesh": Mesh, "material": Material},
    **{"response": Response, "blast": None, "run": None, "rows": None},
}


class Anything:
    """A value of which nothing is known."""


class Instance:
    """A value of a known class."""

    def __init__(self, kind):
        self.kind = kind


def examples():
    """(place, source, names) of every example of both packages, in prompts or an indented block."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            nodes = [*ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
            documented = [n for n in nodes if isinstance(n, (ast.FunctionDef, ast.ClassDef))]
            texts = [(n.name, parsed(ast.get_docstring(n) or "").texts) for n in documented]
            found = [(name, text["Examples"]) for name, text in texts if "Examples" in text]
            if found:
                module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
                names = vars(importlib.import_module(module.replace(".__init__", "")))
                names = {**vars(importlib.import_module(package)), **names, "np": np}
                yield from ((f"{module}.{name}", code_of(text), names) for name, text in found)


def code_of(text):
    """Source of an example."""
    prompts = doctest.DocTestParser().get_examples(text)
    if prompts:
        return "".join(example.source for example in prompts)
    return textwrap.dedent(text.partition("::\n")[2])


class Reader(ast.NodeVisitor):
    """Follows the statements of an example; what does not fit is listed in ``faults``."""

    def __init__(self, names):
        self.names = {**names, **{name: Instance(kind) for name, kind in GIVEN.items()}}
        self.faults = []

    def visit_Assign(self, node):
        value = self.value(node.value)
        for target in node.targets:
            self.take(target, value)

    def visit_For(self, node):
        self.value(node.iter)
        self.take(node.target, Anything())
        self.follow(node.body)

    def visit_With(self, node):
        for item in node.items:
            value = self.value(item.context_expr)
            if item.optional_vars:
                self.take(item.optional_vars, value)
        self.follow(node.body)

    def visit_FunctionDef(self, node):
        self.names[node.name] = Anything()
        self.names.update((one.arg, Anything()) for one in node.args.args)
        self.follow(node.body)

    def visit_ClassDef(self, node):
        self.names[node.name] = Anything()
        self.follow(node.body)

    def visit_Import(self, node):
        for one in node.names:
            top = (one.asname or one.name).partition(".")[0]
            self.names[top] = importlib.import_module(one.name if one.asname else top)

    def visit_ImportFrom(self, node):
        module = importlib.import_module(node.module)
        for one in node.names:
            if not hasattr(module, one.name):
                self.faults.append(f"{node.module} has no {one.name}")
            self.names[one.asname or one.name] = getattr(module, one.name, Anything())

    def visit_Expr(self, node):
        self.value(node.value)

    def generic_visit(self, node):
        for child in ast.iter_child_nodes(node):
            self.value(child) if isinstance(child, ast.expr) else self.visit(child)

    def follow(self, statements):
        """Read statements one after the other."""
        for statement in statements:
            self.visit(statement)

    def take(self, target, value):
        """Give a value to a target."""
        if isinstance(target, ast.Name):
            self.names[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            for one in target.elts:
                self.take(one, Anything())

    def value(self, node):
        """What an expression is: an object, an Instance, or Anything; its parts are read too."""
        if isinstance(node, ast.Name):
            return self.named(node.id)
        if isinstance(node, ast.Attribute):
            return self.member(self.value(node.value), node.attr)
        if isinstance(node, ast.Call):
            return self.call(node)
        if isinstance(node, (ast.Lambda, ast.ListComp, ast.GeneratorExp, ast.DictComp)):
            bound = [n.id for n in ast.walk(node) if isinstance(getattr(n, "ctx", 0), ast.Store)]
            bound += [n.arg for n in ast.walk(node) if isinstance(n, ast.arg)]
            self.names.update((name, Anything()) for name in bound)
        for child in ast.iter_child_nodes(node):
            if isinstance(child, (ast.expr, ast.comprehension, ast.keyword)):
                self.value(child)
        return Anything()

    def named(self, name):
        """What a name stands for."""
        if name not in self.names and not hasattr(builtins, name):
            self.faults.append(f"no name {name}")
        return self.names.get(name, Anything())

    def member(self, owner, name):
        """What an attribute is."""
        holder = owner.kind if isinstance(owner, Instance) else owner
        known = inspect.ismodule(holder) or (isinstance(holder, type) and ours(holder))
        if isinstance(owner, Anything) or not known:
            return Anything()
        if not hasattr(holder, name):
            fields = getattr(holder, "__dataclass_fields__", {})
            set_later = {*fields, *getattr(holder, "__annotations__", {})}
            sources = [
                inspect.getsource(kind) for kind in getattr(holder, "__mro__", ()) if ours(kind)
            ]
            if name not in set_later and not any(f"self.{name}" in text for text in sources):
                self.faults.append(f"{holder.__name__} has no {name}")
            return Anything()
        found = inspect.getattr_static(holder, name) if isinstance(holder, type) else None
        if isinstance(found, (property, cached_property)):
            return made_by(getattr(found, "fget", None) or found.func)
        is_method = isinstance(owner, Instance) and inspect.isfunction(found)
        return Method(getattr(holder, name)) if is_method else getattr(holder, name)

    def call(self, node):
        """What a call gives; its arguments must fit."""
        called = self.value(node.func)
        for part in (*node.args, *(word.value for word in node.keywords)):
            self.value(part)
        function = called.function if isinstance(called, Method) else called
        if not callable(function) or not ours(function):
            return Anything()
        if any(isinstance(one, ast.Starred) for one in node.args) or not all(
            word.arg for word in node.keywords
        ):
            return made_by(function)
        given = [None] * (len(node.args) + isinstance(called, Method))
        try:
            inspect.signature(function).bind(*given, **dict.fromkeys(w.arg for w in node.keywords))
        except TypeError as error:
            self.faults.append(f"{ast.unparse(node)}: {error}")
        return made_by(function)


class Method:
    """A function of an Instance, which stands for its first argument."""

    def __init__(self, function):
        self.function = function


def made_by(function):
    """What a call of a function or a class gives."""
    if isinstance(function, type):
        return Instance(function)
    function = inspect.unwrap(getattr(function, "__func__", function))
    kind = getattr(function, "__annotations__", {}).get("return")
    if isinstance(kind, str):
        kind = re.sub(r"\W", "", kind)
        kind = getattr(function, "__globals__", {}).get(kind) or of_type_checking(function, kind)
    return Instance(kind) if isinstance(kind, type) and ours(kind) else Anything()


def of_type_checking(function, name):
    """A class that the module of a function imports for its types only."""
    tree = ast.parse(inspect.getsource(inspect.getmodule(function)))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and name in [one.name for one in node.names]:
            return getattr(importlib.import_module(node.module), name, None)
    return None


def faults_of(source, names):
    """What does not fit in an example."""
    reader = Reader(names)
    reader.follow(ast.parse(source).body)
    return reader.faults


def test_examples_call_what_is_there_as_it_may_be_called():
    found = [(place, faults_of(source, names)) for place, source, names in examples()]
    assert len(found) > 70
    assert not [f"{place}: {fault}" for place, faults in found for fault in faults]


@pytest.mark.parametrize(
    "source, fault",
    [
        ("simulate(scene, until=1e-4)", "missing a required argument: 'method'"),
        ("simulate(scene, method=Uniform(1e-7), until=1e-4).shows()", "Result has no shows"),
        ("run = result.frame(1, 2)", "too many positional arguments"),
        ("simulate(shot, method=1, until=1e-4)", "no name shot"),
        ("result.plot.energy(where='x')", "got an unexpected keyword argument 'where'"),
        ("from taichi_dem import nothing", "taichi_dem has no nothing"),
    ],
)
def test_a_wrong_example_is_noticed(source, fault):
    (found,) = faults_of(source, vars(importlib.import_module("taichi_dem")))
    assert fault in found
