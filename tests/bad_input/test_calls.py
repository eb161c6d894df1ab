"""No public call of either package takes a value that it cannot mean: one sentence refuses it."""

import functools
import inspect

import numpy as np
import pytest

from taichi_dem import InputError
from taichi_dem.kit.validation import shown
from tests.bad_input.blast_calls import blast_calls
from tests.bad_input.damper_calls import damper_calls
from tests.bad_input.kinds import wrong_values
from tests.bad_input.refusals import ends_within
from tests.public_api import PACKAGES, declared, entries, parameters, returned

CALLS = {"taichi_dem": functools.cache(blast_calls), "ca_damper": functools.cache(damper_calls)}
#: Classes that users are given and do not make.
GIVEN = """Answer Branch Progress Received RunView AmplitudeResponse
    BestDamper Certificate CollectAndCollide DamperMap Report Response SimulationDiverged
    StructureHistory Sweep TimeHistory runtime.Settings""".split()
#: Functions that need more than values to be tried: processes, an STL file, or a session.
APART = """sweep parameter_grid shapes.from_surface methods.order_of methods.structure_of
    runtime.check_session runtime.check_thread runtime.when_cleared""".split()


@functools.cache
def documented(package):
    """(entry, types of its parameters) by name, of all that the docs of a package describe."""
    found = {}
    for entry in [*entries(package), *returned(package)]:
        types = parameters(declared(entry).text)
        if types:
            found[entry.name] = entry, types
    return found


def calls(package):
    """Rows (name, function, valid arguments, types of the parameters)."""
    for label, function, given in CALLS[package]():
        name = label.partition("#")[0]
        entry, types = documented(package)[f"{package}.{name}"]
        signature = inspect.signature(entry.function or entry.thing).parameters
        defaults = {key: one.default for key, one in signature.items() if key in types}
        valid = {key: one for key, one in defaults.items() if one is not inspect.Parameter.empty}
        valid.update(given)
        others = next((kind for key, kind in types.items() if key.startswith("**")), "Any")
        tried = given if "#" in label else valid
        yield name, function, valid, {key: types.get(key, others) for key in tried}


def fault(function, valid, name, value, text):
    """What is wrong with how a value is refused, in words; "" where nothing is.

    The sentence names the parameter, the value and what must be; where more than one number is
    asked for, the parameter or the part of the value.
    """
    try:
        with ends_within(60.0):
            function(**{**valid, name: value})
    except InputError as refusal:
        sentence = str(refusal)
    except Exception as error:
        return f"ends in {error!r} at"
    else:
        return "takes"
    parts = value if isinstance(value, list) else []
    told = [name in sentence, any(shown(part) in sentence for part in (value, *parts))]
    of_one_number = text.split(",")[0] in ("float", "int", "bool")
    enough = all(told) and " must " in sentence if of_one_number else any(told)
    return (
        "" if enough and "\n" not in sentence and len(sentence) < 700 else f"says {sentence!r} of"
    )


def faults(package, count, seed):
    """Faults of so many wrong values of each parameter, drawn by a seed."""
    draw = np.random.default_rng(seed)
    for name, function, valid, types in calls(package):
        function(**valid)
        for key, text in types.items():
            wrong = wrong_values(name, key, text)
            if wrong is None:
                yield f"{name}.{key} has no kind"
                continue
            for k in draw.permutation(len(wrong))[:count]:
                why = fault(function, valid, key, wrong[k], text)
                if why:
                    yield f"{name}.{key} {why} {shown(wrong[k])}"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_parameter_takes_what_it_cannot_mean(package, tmp_path, monkeypatch):
    """Some of the wrong values of its kind; ``make attack`` tries all."""
    monkeypatch.chdir(tmp_path)
    assert not [*faults(package, 4, seed=0)]


def test_every_public_call_is_listed():
    listed, public = set(), {}
    for package in PACKAGES:
        known = documented(package)
        listed |= {
            known[f"{package}.{call[0].partition('#')[0]}"][0].thing for call in CALLS[package]()
        }
        made = [entry for entry in entries(package) if entry.owner is None]
        public.update({one.name.partition(".")[2]: one.thing for one in made if one.name in known})
    assert {name for name, thing in public.items() if thing not in listed} == {*GIVEN, *APART}
