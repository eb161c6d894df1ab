"""Every public call of both packages, with valid arguments.

What a package offers is called by itself; METHODS names what its objects are asked. An argument is
found by the name of its parameter, or by those of call and parameter where it has to be another.
"""

import inspect
import re
from typing import Any, NamedTuple

from tests.bad_input.arguments import ALWAYS, BOUND, BY_TYPE, OBJECTS, OWN, VALUES

#: Classes that users are given and do not make.
GIVEN = """goals.Result Answer Branch Progress Received RunView AmplitudeResponse
    BestDamper Certificate CollectAndCollide DamperMap Report Response SimulationDiverged
    StructureHistory Sweep TimeHistory runtime.Settings""".split()
#: Functions that need more than values to be tried: processes, an STL file, or a session.
APART = ("sweep", "parameter_grid", "shapes.from_surface")
#: Methods that the packages call themselves.
INSIDE = {"values", "take_up", "checkpointed", "record"}


class Call(NamedTuple):
    """A call by its name in the docs; valid: arguments; types: of the parameters that are tried."""

    name: str
    function: Any
    valid: dict
    types: dict


def offered(package):
    """Classes and functions of a package and of the modules that it lists, by name in the docs."""
    found = {name: getattr(package, name) for name in package.__all__}
    for part, module in [one for one in found.items() if inspect.ismodule(one[1])]:
        for name in getattr(module, "__all__", None) or vars(module):
            one = getattr(module, name)
            if inspect.isclass(one) or inspect.isfunction(one):
                found.update({} if one in found.values() else {f"{part}.{name}": one})
    here = {n: one for n, one in found.items() if inspect.isclass(one) or inspect.isfunction(one)}
    return {n: one for n, one in here.items() if one.__module__.startswith(package.__name__)}


def parameters(thing):
    """Types of the parameters in a docstring of NumPy style, by name."""
    pattern = r"^Parameters\n-{3,}\n(.*?)(?=^\S[^\n]*\n-{3,}$|\Z)"
    section = re.search(pattern, inspect.getdoc(thing) or "", re.DOTALL | re.MULTILINE)
    return dict(re.findall(r"^(\S.*?) : (.*)$", section[1] if section else "", re.MULTILINE))


def methods(thing):
    """Names of what users call of an object: methods whose parameters are described."""
    names = {name for name in dir(thing) if not name.startswith("_")} - INSIDE
    own = {name: getattr(type(thing), name, None) for name in names}
    return sorted(name for name, one in own.items() if inspect.isroutine(one) and parameters(one))


def calls(package):
    """All calls of a package, each variant of one after those that are tried as a whole."""
    things = {name: one for name, one in offered(package).items() if name not in (*GIVEN, *APART)}
    made = {**things, **BOUND}
    for owner, make in OBJECTS[package].items():
        one = make()
        things.update({f"{owner}.{name}": getattr(one, name) for name in methods(one)})
        made.update({f"{owner}.{name}": _method(make, name) for name in methods(one)})
    own = OWN[package]()
    variants = {label: label.partition("#")[0] for label in own if "#" in label}
    whole = [name for name in things if name in own or name not in variants.values()]
    for label, name in {**dict(zip(whole, whole)), **variants}.items():
        types = parameters(things[name])
        if types:
            yield _call(package, label, made[name], things[name], types, own.get(label, {}))


def _method(made, name):
    return lambda *args, **options: getattr(made(), name)(*args, **options)


def _call(package, label, function, thing, types, own):
    signature, valid = inspect.signature(thing).parameters, {}
    for name in [name for name in types if name in signature]:
        value = signature[name].default
        if value is inspect.Parameter.empty:
            value = VALUES.get(name, BY_TYPE.get(types[name].partition(" ")[0]))
        valid[name] = ALWAYS[package].get(name, value)
    valid.update(own)
    others = next((kind for name, kind in types.items() if name.startswith("**")), "Any")
    tried = own if "#" in label else valid
    return Call(label.partition("#")[0], function, valid, {n: types.get(n, others) for n in tried})
