"""Pages of the public API: signatures, and docstrings with tables of parameters and results."""

import dataclasses
import html
import inspect
import re

from docs.site.docstrings import parsed
from docs.site.markdown import Heading, Page, block, coloured
from docs.site.public_api import (
    PACKAGES,
    Entry,
    declared,
    label_of,
    members,
    modules,
    public_names,
    returned,
)

#: Signs that Markdown takes for marks.
_MARKS = r"([*_\[\]<>|])"


def api_pages():
    """(name of the file, Page) for each public module of both packages."""
    for package in PACKAGES:
        for module in modules(package):
            # Of modules that both packages offer, the first package has the page.
            if module.__name__.startswith(package) or package == PACKAGES[0]:
                label = label_of(package, module)
                yield f"api_{label}.html", module_page(label, module)
        yield f"api_{package}_results.html", results_page(package)


def module_page(label, module):
    """Page of a module: its text, a table of all objects, and every object."""
    things = [Entry(f"{label}.{name}", thing) for name, thing in public_names(module)]
    contracts = _bases(things)
    intro = parsed(module.__doc__ or "")
    parts = [f"<h1>{label}</h1>", block(intro.summary), block(_blocks(intro.body))]
    parts += [_overview(things), *map(_object, things)]
    parts += _documented_bases(contracts)
    headings = [Heading(2, short(entry), anchor(entry)) for entry in [*things, *contracts]]
    return Page(label, "\n".join(parts), tuple(headings), ())


def _bases(things):
    """Entries of the base classes and contracts of classes that are not among these themselves."""
    bases = list(dict.fromkeys(base for entry in things for base in bases_of(entry)))
    known = {entry.thing for entry in things}
    more = [Entry(f"{base.__module__}.{base.__qualname__}", base) for base in bases]
    return [entry for entry in more if entry.thing not in known]


def _documented_bases(contracts):
    """HTML of base classes and contracts, with a heading of their own."""
    if not contracts:
        return []
    words = "<p>Members that several classes share, and what a class of one's own has.</p>"
    title = '<h2 id="contracts">Base classes and contracts</h2>'
    return [title, words, *map(_object, contracts)]


def results_page(package):
    """Page of the classes that users get from a package without making them."""
    things = [entry for entry in returned(package) if entry.owner is None]
    title = f"{package} results"
    words = f"Objects that functions of <code>{package}</code> return, and their parts."
    contracts = _bases(things)
    parts = [f"<h1>{title}</h1><p>{words}</p>", _overview(things), *map(_object, things)]
    parts += _documented_bases(contracts)
    headings = [Heading(2, short(entry), anchor(entry)) for entry in [*things, *contracts]]
    return Page(title, "\n".join(parts), tuple(headings), ())


def bases_of(entry):
    """Classes that document members of an entry which it overrides or inherits."""
    if not inspect.isclass(entry.thing):
        return []
    found = [declared(member).owner for member in members(entry)]
    return [owner for owner in found if owner is not entry.thing]


def short(entry):
    """Last word of the name of an entry."""
    return entry.name.rsplit(".", 1)[1]


def anchor(entry):
    """Anchor of an object of a page: its name in its module, with that of its class."""
    if entry.owner is not None:
        return f"{entry.owner.__name__}.{short(entry)}"
    return short(entry)


def _overview(things):
    rows = (
        f'<tr><td><a href="#{anchor(entry)}"><code>{short(entry)}</code></a></td>'
        f"<td>{_marked(parsed(entry.text).summary)}</td></tr>"
        for entry in things
    )
    return f'<div class="wide"><table class="overview">{"".join(rows)}</table></div>'


def _object(entry):
    """HTML of a class with its members, or of a function."""
    title = f'<h2 id="{anchor(entry)}">{short(entry)}</h2>'
    parts = ['<section class="object">', title, _signature(entry), _documented(entry)]
    if inspect.isclass(entry.thing):
        own, inherited = [], []
        for member in members(entry):
            is_own = declared(member).owner is entry.thing
            (own if is_own else inherited).append(member)
        parts += map(_member, own)
        parts.append(_inherited(inherited))
    return "\n".join([*parts, "</section>"])


def _member(entry):
    title = f'<h3 id="{anchor(entry)}">{short(entry)}</h3>'
    return f'<div class="member">{title}{_signature(entry)}{_documented(entry)}</div>'


def _inherited(entries):
    """One line that names the members which base classes and contracts document."""
    if not entries:
        return ""
    links = []
    for entry in entries:
        origin = declared(entry)
        links.append(f'<a href="#{anchor(origin)}"><code>{short(entry)}</code></a>')
    return f'<p class="inherited">As in its base class or contract: {", ".join(links)}.</p>'


def _signature(entry):
    """Signature as code, without types, which the table of parameters has."""
    thing = entry.thing
    if entry.owner is not None and not callable(getattr(thing, "__func__", thing)):
        return '<p class="kind">property</p>'
    name = short(entry)
    made = entry.function
    fields = dataclasses.is_dataclass(thing)
    if made is None and not fields:
        return coloured(f"class {name}", "python") if inspect.isclass(thing) else ""
    given = list(inspect.signature(thing if inspect.isclass(thing) else made).parameters.values())
    if entry.owner is not None and given and given[0].name in ("self", "cls"):
        given = given[1:]
    texts, named = [], False
    for one in given:
        if one.kind == one.KEYWORD_ONLY and not named:
            texts.append("*")
            named = True
        texts.append(_given(one))
    line = f"{name}({', '.join(texts)})"
    if len(line) > 88:
        line = f"{name}(\n" + "".join(f"    {text},\n" for text in texts) + ")"
    return coloured(f"class {line}" if inspect.isclass(thing) else line, "python")


def _given(one):
    stars = {one.VAR_POSITIONAL: "*", one.VAR_KEYWORD: "**"}
    if one.default is one.empty:
        return stars.get(one.kind, "") + one.name
    default = repr(one.default)
    # Of objects that have no short name the table says what they are.
    default = "..." if default.startswith("<") or len(default) > 40 else default
    return f"{one.name}={default}"


def _documented(entry):
    """Docstring: text, tables of its lists, and the other sections."""
    parts = parsed(entry.text)
    found = [f"<p>{_marked(parts.summary)}</p>", block(_blocks(parts.body))]
    for name, rows in parts.lists.items():
        found.append(f"<h4>{name}</h4>{_table(name, rows)}")
    for name, text in parts.texts.items():
        body = coloured(text, "pycon") if name == "Examples" else block(_blocks(text))
        found.append(f"<h4>{name}</h4>{body}")
    return "\n".join(found)


def _table(section, rows):
    """Table of a section: name, type, meaning; without names where results have none."""
    lines = []
    for row in rows:
        name = f"<td><code>{html.escape(row.name)}</code></td>" if row.name else ""
        kind = f"<td>{_marked(row.type)}</td>" if section != "Raises" else ""
        lines.append(f"<tr>{name}{kind}<td>{_marked(row.text)}</td></tr>")
    return f'<div class="wide"><table class="items">{"".join(lines)}</table></div>'


def _marked(text):
    """Text of a docstring in one line: code between backquotes, all else as it stands."""
    parts = re.split(r"``(.+?)``", text)
    return "".join(
        f"<code>{html.escape(part)}</code>" if k % 2 else html.escape(part)
        for k, part in enumerate(parts)
    )


def _blocks(text):
    """Text of a docstring as Markdown: code between double backquotes, blocks after "::"."""
    parts = re.split(r"(``.+?``)", text)
    # Outside of code, marks of Markdown are signs.
    plain = (re.sub(_MARKS, r"\\\1", part) if part[:2] != "``" else part for part in parts)
    return re.sub(r"::\n\n((?:    .*\n?|\n)+)", _fenced, "".join(plain))


def _fenced(found):
    code = inspect.cleandoc(re.sub(r"\\" + _MARKS, r"\1", found[1]))
    return f":\n\n```python\n{code}\n```\n"
