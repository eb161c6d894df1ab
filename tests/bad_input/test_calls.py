"""No public call takes a value that its docs do not allow: it is refused in one sentence.

What a parameter may be is read off its docstring, so that a new parameter is tried by itself.
"""

import functools
import inspect
import math
import numbers
import re
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from docs.site.docstrings import parsed
from docs.site.public_api import PACKAGES, declared, entries, returned
from taichi_dem import InputError
from taichi_dem.kit.validation import finite, shown
from tests.bad_input.blast_calls import blast_calls
from tests.bad_input.damper_calls import damper_calls
from tests.bad_input.refusals import ends_within, steady

NOTHING = object()
VALUES = [
    *(None, True, 1, 1.5, math.nan, math.inf, -math.inf, 10**400, 1j, "nonsense\0", "1", b"x"),
    *(NOTHING, np.float32("nan"), np.array("x"), [NOTHING], [math.nan], ["x"], [1j], [None]),
    *([[1.0], [2.0, 3.0]], {1: 2}, {NOTHING: 1}, "", 2**70),
]
DRAWN = st.one_of(
    *(st.none(), st.booleans(), st.floats(), st.integers(), st.text(), st.binary()),
    *(
        st.complex_numbers(),
        st.lists(st.floats() | st.text()),
        st.dictionaries(st.text(), st.text()),
    ),
)


def is_number(value):
    """Whether it is a finite number."""
    return finite(value)


def is_array(value):
    """Whether it is a number, or numbers in rows of one length."""
    try:
        found = np.asarray(value)
    except ValueError:
        return False
    return is_number(value) or (found.dtype.kind in "iuf" and bool(np.isfinite(found).all()))


def is_file_name(value):
    """Whether it can be the name of a file."""
    return isinstance(value, str) and bool(value) and "\0" not in value


#: Whether a value is of a type, by the first word of it in a docstring. Any other word is a class,
#: of which no value here is.
RIGHT = {
    "float": is_number,
    "int": lambda value: isinstance(value, numbers.Integral) and not isinstance(value, bool),
    "bool": lambda value: isinstance(value, bool),
    "str": lambda value: isinstance(value, str),
    "auto": lambda value: isinstance(value, str),
    **dict.fromkeys(("path", "file"), is_file_name),
    **dict.fromkeys(("callable", "function"), callable),
    **dict.fromkeys(("array_like", "ndarray"), is_array),
    **dict.fromkeys(("mapping", "dict"), lambda value: isinstance(value, Mapping)),
    "None": lambda value: value is None,
}


def is_list(value, text):
    """Whether it is a sequence of what a type says: numbers, text, or objects of a class."""
    if not isinstance(value, (list, tuple, str)):
        return " float" in text and is_number(value)  # one instead of several
    of = "str" if " str" in text else "float"
    return all(RIGHT[of](one) for one in value)


def is_right(value, text):
    """Whether a value is of the type of a parameter, such as "float or sequence of float"."""
    if re.search(r", (optional|default None)", text) and value is None:
        return True
    if text == "Any" or (text.endswith('default ""') and value == ""):
        return True
    heads = [re.search(r"\w+", part)[0] for part in re.split(r" or |, (?!default)", text)]
    lists = {"sequence", "list", "tuple", "iterable"} & {*heads}
    return (bool(lists) and is_list(value, text)) or any(
        RIGHT[head](value) for head in heads if head in RIGHT
    )


#: Functions that need more than values to be tried: processes, an STL file, or a session.
LEFT_OUT = {"sweep", "parameter_grid", "shapes.from_surface"} | {
    *(f"runtime.{name}" for name in ("check_session", "check_thread", "when_cleared", "start")),
    *(f"methods.{name}" for name in ("order_of", "structure_of")),
}


@functools.cache
def types(package):
    """Type of each parameter by the name of a call, for all that the docs of a package describe."""
    found = {}
    for entry in [*entries(package), *returned(package)]:
        rows = parsed(declared(entry).text).lists.get("Parameters", ())
        if rows:
            found[entry.name] = {row.name: row.type for row in rows}
    return found


def calls(package):
    """Rows (label, function, valid arguments, types of the parameters)."""
    for name, function, valid in {"taichi_dem": blast_calls, "ca_damper": damper_calls}[package]():
        of = types(package)[f"{package}.{name.partition('#')[0]}"]
        others = next((kind for key, kind in of.items() if key.startswith("**")), "Any")
        yield name, function, valid, {key: of.get(key, others) for key in valid}


def fault(function, valid, name, value):
    """What is wrong with how a value is refused, in words; "" where nothing is."""
    try:
        with ends_within(60.0):
            function(**{**valid, name: value})
    except InputError as refusal:
        text = str(refusal)
        parts = value if isinstance(value, list) else []
        told = name in text or any(shown(part) in text for part in (value, *parts))
        return "" if told and "\n" not in text and len(text) < 700 else f"says {text!r} of"
    except Exception as error:
        return f"ends in {error!r} at"
    return "takes"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_parameter_takes_what_its_docs_do_not_allow(package, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = []
    for label, function, valid, kinds in calls(package):
        function(**valid)
        for name, kind in kinds.items():
            wrong = [value for value in VALUES if not is_right(value, kind)]
            faults = ((fault(function, valid, name, value), value) for value in wrong)
            found += [f"{label}.{name} {why} {shown(value)}" for why, value in faults if why]
    assert not found, "\n".join(found)


@settings(steady, max_examples=300)
@given(data=st.data())
@pytest.mark.parametrize("package", PACKAGES)
def test_no_parameter_takes_a_drawn_value_that_its_docs_do_not_allow(package, data):
    label, function, valid, kinds = data.draw(st.sampled_from(known_calls(package)))
    name = data.draw(st.sampled_from(sorted(kinds)))
    value = data.draw(DRAWN.filter(lambda value: not is_right(value, kinds[name])))
    why = fault(function, valid, name, value)
    assert not why, f"{label}.{name} {why} {shown(value)}"


@functools.cache
def known_calls(package):
    """The calls of a package with a parameter of a type."""
    rows = [*calls(package)]
    return [row for row in rows if not all(kind == "Any" for kind in row[3].values())]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_function_is_tried(package):
    tried = {f"{package}.{label.partition('#')[0]}" for label, *_ in known_calls(package)}
    public = {entry.name for entry in entries(package) if inspect.isfunction(entry.thing)}
    public = {name for name in public if name.count(".") <= 2 and name in types(package)}
    left = {f"{package}.{name}" for name in LEFT_OUT}
    members = {entry.name for entry in entries(package) if entry.owner is not None}
    assert not public - members - tried - left
