"""The public API of both packages is documented in NumPy style, as its signatures say.

Every rule is a function from an Entry to offences in words; the self-tests at the end show that
each rule refuses a small bad docstring and lets a good one pass.
"""

import ast
import doctest
import importlib
import inspect
import re
import sys
import textwrap
from typing import Optional

import numpy as np
import pytest

from docs.site.docstrings import TEXTS, parsed
from docs.site.public_api import PACKAGES, Entry, declared, entries, members, returned

#: A float has its unit in brackets, or one of these words says that it has none.
UNIT = re.compile(r"\[[^\]]+\]")
PLAIN_NUMBERS = ("share", "ratio", "factor", "coefficient", "number", "exponent")
# A unit of a number stands for none where it is any: of a goal, of values that a user brings.
OF_ANOTHER = ("in the unit of", "in its unit")


def signature(entry):
    """Parameters of a function or a class by name, without the object itself, and the result."""
    function = entry.function
    if function is None and not getattr(entry.thing, "__dataclass_fields__", None):
        return {}, None
    made = inspect.signature(entry.thing if isinstance(entry.thing, type) else function)
    names = list(made.parameters)
    bound = entry.owner is not None and names[:1] in (["self"], ["cls"])
    stars = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    given = {
        f"{stars.get(one.kind, '')}{name}": one.annotation
        for name, one in made.parameters.items()
        if not (bound and name == names[0])
    }
    return given, made.return_annotation


def is_property(entry):
    return entry.owner is not None and not callable(plain_member(entry))


def plain_member(entry):
    return entry.thing.__func__ if hasattr(entry.thing, "__func__") else entry.thing


def says_summary(entry):
    summary = parsed(entry.text).summary
    if not summary.endswith(".") or summary != entry.text.split("\n")[0]:
        yield "begins with one line that ends in a full stop"


def documents_parameters(entry):
    if is_property(entry):
        return
    given, _ = signature(entry)
    found = parsed(entry.text).names("Parameters")
    if found not in (list(given), [name for name in given if name not in inherited(entry)]):
        yield f"has Parameters {', '.join(found) or 'none'}; takes {', '.join(given) or 'none'}"


def inherited(entry):
    """Fields that a dataclass has from its bases, which document them."""
    bases = entry.thing.__mro__[1:] if isinstance(entry.thing, type) else ()
    return {name for kind in bases for name in getattr(kind, "__dataclass_fields__", ())}


def types_and_describes(entry):
    for section, rows in parsed(entry.text).lists.items():
        for row in rows:
            if not row.text and section != "Returns":
                yield f"{section} says nothing of {row.name or row.type}"
            if section in ("Parameters", "Attributes") and not row.type:
                yield f"{section} gives no type of {row.name}"


def documents_returns(entry):
    if is_property(entry) or isinstance(entry.thing, type):
        return
    _, result = signature(entry)
    returns = result not in (None, "None", inspect.Signature.empty)
    sections = parsed(entry.text).lists
    if returns != bool({"Returns", "Yields"} & set(sections)):
        yield "has Returns" if not returns else "has no Returns"


def documents_raises(entry):
    named = {row.name or row.type for row in parsed(entry.text).lists.get("Raises", ())}
    missing = sorted(raised(entry) - named)
    if missing and not (is_property(entry) and set(missing) <= set(entry.text.split())):
        yield f"raises {', '.join(missing)} without saying so"


def raised(entry):
    """Names of the exceptions for the user that the body raises itself."""
    bodies = [entry.function]
    if isinstance(entry.thing, type):
        bodies.append(vars(entry.thing).get("__post_init__"))
    found = set()
    for body in filter(None, bodies):
        for node in ast.walk(ast.parse(textwrap.dedent(source(body)))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                found.add(getattr(node.exc.func, "id", ""))
    return found & {"InputError", "SimulationDiverged"}


def source(function):
    """Source of a function, "" of one that was made by ``dataclass``."""
    try:
        return inspect.getsource(function)
    except OSError:
        return ""


def gives_units(entry):
    given, result = signature(entry)
    rows = parsed(entry.text).lists
    if is_property(entry):
        if holds_float(result) and not has_unit(entry.text):
            yield "gives no unit"
        return
    for row in rows.get("Parameters", ()):
        if holds_float(given.get(row.name)) and not has_unit(row.text):
            yield f"gives no unit of {row.name}"
    if holds_float(result) and not any(has_unit(row.text) for row in rows.get("Returns", ())):
        yield "gives no unit of its result"


def holds_float(annotation):
    if annotation in (None, inspect.Parameter.empty):
        return False
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return re.search(r"\bfloat\b", text) is not None


def has_unit(text):
    words = set(re.findall(r"[a-z]+", text.lower()))
    singular = words | {word.rstrip("s") for word in words}
    other = any(phrase in text for phrase in OF_ANOTHER)
    return bool(UNIT.search(text)) or other or bool(singular & set(PLAIN_NUMBERS))


def has_known_sections(entry):
    parts = parsed(entry.text)
    for line in entry.text.split("\n"):
        if re.match(r"(Args|Arguments|Returns|Raises|Example|Examples|Notes?):$", line.strip()):
            yield f"has a section of another style, {line.strip()}"
    for name in parts.texts:
        if name not in TEXTS:
            yield f"has a section {name}"


RULES = (
    *(says_summary, documents_parameters, types_and_describes, documents_returns),
    *(documents_raises, gives_units, has_known_sections),
)


def offences(entry):
    """(name, sentence) of all rules; of an override, of the member that it overrides."""
    origin = declared(entry)
    checked = origin if origin.thing is not entry.thing else entry
    if checked is not entry:
        yield from ((entry.name, text) for text in says_summary(entry))
    for rule in RULES:
        yield from ((checked.name, text) for text in rule(checked))


@pytest.mark.parametrize("package", PACKAGES)
def test_public_docstrings_keep_the_rules(package):
    public = [*entries(package), *returned(package)]
    found = sorted({f"{name} {text}" for entry in public for name, text in offences(entry)})
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_examples_give_what_they_say(package):
    """Those that need a run are marked to be skipped; their names are those of the page."""
    said, runner = [], doctest.DocTestRunner(verbose=False)
    for entry in entries(package):
        names = {**vars(importlib.import_module(package)), **names_beside(entry), "np": np}
        test = doctest.DocTestParser().get_doctest(entry.text, names, entry.name, None, 0)
        runner.run(test, out=said.append)
    assert runner.tries > 10 and not runner.failures, "".join(said)


def names_beside(entry):
    """Public names of the module by which an object is reached."""
    places = [name for name in sys.modules if entry.name.startswith(f"{name}.")]
    return vars(sys.modules[max(places, key=len)])


def test_the_walk_finds_functions_classes_members_and_modules_by_itself():
    names = {entry.name for package in PACKAGES for entry in entries(package)}
    assert {
        *("taichi_dem.simulate", "taichi_dem.Mesh.group_faces", "taichi_dem.effects.Pressure"),
        *("taichi_dem.effects.Pressure.triangle", "taichi_dem.goals.energy_share"),
        *("taichi_dem.runtime.start", "ca_damper.excitation.from_csv", "ca_damper.Batch.run"),
        *("ca_damper.Batch.sample", "ca_damper.Oscillator.transfer"),
    } <= names
    results = {entry.name for package in PACKAGES for entry in returned(package)}
    assert {
        *("taichi_dem.result.Result", "taichi_dem.result.Result.write"),
        *("taichi_dem.output.record.Frame", "ca_damper.measures.Cycles.rms"),
    } <= results
    # Functions that run in kernels, and what is private, are no part of it.
    assert "taichi_dem.effects.Gravity.wrench" not in names
    assert not any(re.search(r"\._", name) for name in names)


def good(share: float, name: Optional[str] = None) -> int:
    """Return one.

    Parameters
    ----------
    share : float
        Share of all.
    name : str, optional
        Its name.

    Returns
    -------
    int
        One.
    """
    return 1


class Base:
    """Declares a member."""

    def act(self, dt: float) -> None:
        """Act.

        Parameters
        ----------
        dt : float
            Step [s].
        """


class Derived(Base):
    """Overrides it."""

    def act(self, dt: float) -> None:
        """Act otherwise."""


def _with(text, function=good):
    """Entry of a function with another docstring."""

    def made(share: float, name: Optional[str] = None) -> int:
        raise_input_error = function
        return raise_input_error(share, name)

    made.__doc__ = text
    return Entry("made", made)


def _changed(old, new):
    assert old in good.__doc__
    return _with(good.__doc__.replace(old, new))


@pytest.mark.parametrize(
    "old, new, sentence",
    [
        ("Return one.", "Return one", "full stop"),
        ("    name : str, optional\n        Its name.\n", "", "takes share, name"),
        ("share : float", "shares : float", "has Parameters shares"),
        ("name : str, optional", "name", "no type of name"),
        ("        Its name.\n", "", "says nothing of name"),
        ("    Returns\n    -------\n    int\n        One.\n", "", "has no Returns"),
        ("Share of all.", "How much.", "no unit of share"),
        ("Return one.", "Return one.\n\n    Args:\n        x", "another style"),
    ],
)
def test_a_rule_refuses_a_bad_docstring(old, new, sentence):
    assert any(sentence in text for _, text in offences(_changed(old, new)))


def test_an_exception_that_the_body_raises_must_be_said():
    def refuses() -> None:
        """Refuse."""
        raise InputError("no")  # noqa: F821

    assert list(documents_raises(Entry("refuses", refuses))) == [
        "raises InputError without saying so"
    ]


def test_good_docstrings_pass_and_overrides_need_a_summary_only(monkeypatch):
    assert not list(offences(Entry("good", good)))
    monkeypatch.setattr("docs.site.public_api.ours", lambda thing: thing is not object)
    assert [entry.name for entry in members(Entry("Derived", Derived))] == ["Derived.act"]
    assert not list(offences(Entry("Derived.act", vars(Derived)["act"], Derived)))
