"""Walk over the public API of both packages: what ``__all__`` lists, and its public members.

Dataclasses that public functions return, or that are fields of such, are public too. A member that
a base class or a Protocol declares is documented there: overrides need a summary only. Functions
that run in kernels are left out, as their contracts are those of the roles.
"""

import dataclasses
import importlib
import inspect
import re
import sys
import typing
from functools import cached_property
from typing import Any, NamedTuple, Protocol

PACKAGES = ("taichi_dem", "ca_damper")


class Entry(NamedTuple):
    """A documented object.

    name: public dotted name. thing: class, function or property. owner: its class, or None.
    """

    name: str
    thing: Any
    owner: Any = None

    @property
    def text(self):
        """Its docstring, "" where it has none."""
        return inspect.cleandoc(getattr(self.thing, "__doc__", None) or "")

    @property
    def function(self):
        """Function with its signature and body; None for a class that makes none."""
        if isinstance(self.thing, type):
            made = [vars(kind).get("__init__") for kind in self.thing.__mro__ if ours(kind)]
            found = [one for one in made if inspect.isfunction(one)]
            return found[0] if found and not is_protocol(self.thing) else None
        return plain(self.thing)


def plain(member):
    """The function behind a property or a decorated method."""
    for name in ("fget", "func", "__func__"):
        member = getattr(member, name, member) or member
    return inspect.unwrap(member)


def ours(thing):
    """Whether one of the packages defines an object."""
    return getattr(thing, "__module__", "").split(".")[0] in PACKAGES


def modules(package):
    """The public modules of a package, itself first: those that ``__all__`` lists."""
    found = [importlib.import_module(package)]
    for name in found[0].__all__:
        part = getattr(found[0], name)
        if inspect.ismodule(part):
            found.append(part)
    return found


def public_names(module):
    """(name, object) of the classes and functions that a module offers, as far as they are ours."""
    listed = getattr(module, "__all__", None)
    for name in listed or sorted(vars(module)):
        thing = getattr(module, name)
        is_object = inspect.isclass(thing) or inspect.isfunction(thing)
        here = listed is not None or getattr(thing, "__module__", "") == module.__name__
        if is_object and here and ours(thing) and not name.startswith("_"):
            yield name, thing


def entries(package):
    """Entries of a package, each class followed by its members; every object once."""
    seen = set()
    for module in modules(package):
        for name, thing in public_names(module):
            if thing not in seen:
                seen.add(thing)
                label = label_of(package, module)
                yield Entry(f"{label}.{name}", thing)
                if inspect.isclass(thing):
                    yield from members(Entry(f"{label}.{name}", thing))


def returned(package):
    """Entries of the dataclasses that users get without making them, and of their members."""
    todo = list(entries(package))
    known = {entry.thing for entry in todo if inspect.isclass(entry.thing)}
    while todo:
        for kind in results_of(todo.pop(0)):
            if kind not in known and dataclasses.is_dataclass(kind) and ours(kind):
                known.add(kind)
                found = Entry(f"{kind.__module__}.{kind.__qualname__}", kind)
                more = [found, *members(found)]
                todo += more
                yield from more


def results_of(entry):
    """Classes that a function returns, or that the fields of a class are of."""
    if inspect.isclass(entry.thing):
        for kind in filter(ours, entry.thing.__mro__):
            names = {**vars(typing), **vars(sys.modules[kind.__module__])}
            for annotation in vars(kind).get("__annotations__", {}).values():
                yield from classes_in(annotation, names)
    elif entry.function is not None:
        result = inspect.signature(entry.function).return_annotation
        yield from classes_in(result, entry.function.__globals__)


def classes_in(annotation, names):
    """Classes of an annotation; text is looked up by its names."""
    if isinstance(annotation, str):
        annotation = vars(typing).get(annotation, names.get(annotation))
    if inspect.isclass(annotation) and not typing.get_args(annotation):
        yield annotation
    for part in typing.get_args(annotation):
        yield from classes_in(getattr(part, "__forward_arg__", part), names)


def label_of(package, module):
    """Name by which a module is reached from its package."""
    if module.__name__ == package:
        return package
    names = importlib.import_module(package).__all__
    (name,) = [n for n in names if getattr(importlib.import_module(package), n) is module]
    return f"{package}.{name}"


def members(entry):
    """Entries of the public members of a class, inherited ones too, by the first that has them."""
    seen = set()
    fields = {field.name for field in _fields(entry.thing)}
    for kind in entry.thing.__mro__:
        for name, member in vars(kind).items() if ours(kind) else ():
            if name in seen or name in fields or not is_member(name, member):
                continue
            seen.add(name)
            yield Entry(f"{entry.name}.{name}", member, entry.thing)


def is_member(name, member):
    """Whether a user may call or read a member: no kernel's function, nothing private."""
    kinds = (property, cached_property, classmethod, staticmethod)
    if name.startswith("_") or not (isinstance(member, kinds) or inspect.isfunction(member)):
        return False
    marks = ("_is_taichi_function", "_is_wrapped_kernel", "_is_real_function")
    return not any(getattr(member, mark, False) for mark in marks)


def _fields(thing):
    return dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()


def declared(entry):
    """The Entry that documents a member: of the last base class or the Protocol that declares it.

    The entry itself where it overrides nothing.
    """
    if entry.owner is None:
        return entry
    name = entry.name.rsplit(".", 1)[1]
    bases = [kind for kind in entry.owner.__mro__ if ours(kind) and name in vars(kind)]
    contracts = [kind for kind in protocols() if name in vars(kind) and _keeps(entry.owner, kind)]
    owner = (contracts or bases)[-1]
    return Entry(f"{owner.__module__}.{owner.__qualname__}.{name}", vars(owner)[name], owner)


def protocols():
    """All Protocols of the packages that are loaded."""
    loaded = [module for name, module in sorted(sys.modules.items()) if _is_ours(name)]
    found = {thing for module in loaded for thing in vars(module).values() if is_protocol(thing)}
    return sorted(found, key=lambda kind: kind.__qualname__)


def _is_ours(name):
    return name.split(".")[0] in PACKAGES


def is_protocol(thing):
    """Whether an object is a Protocol of the packages."""
    return inspect.isclass(thing) and ours(thing) and Protocol in thing.__bases__


def _keeps(kind, contract):
    """Whether a class has all members of a Protocol."""
    fields = {field.name for field in _fields(kind)}
    wanted = [name for name in vars(contract) if not name.startswith("_")]
    return all(hasattr(kind, name) or name in fields for name in wanted)


def parameters(text):
    """Types of the parameters of a docstring in NumPy style, by name."""
    pattern = r"^Parameters\n-{3,}\n(.*?)(?=^\S[^\n]*\n-{3,}$|\Z)"
    section = re.search(pattern, inspect.cleandoc(text), re.DOTALL | re.MULTILINE)
    return dict(re.findall(r"^(\S.*?) : (.*)$", section[1] if section else "", re.MULTILINE))
