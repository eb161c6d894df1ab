"""The pages keep their word: links lead on, names exist, nothing of the papers is left out."""

import dataclasses
import importlib
import inspect
import re
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.docs.pages import FOLDER, PAGES, anchors, headings, links, tokens, words

PACKAGES = ("taichi_dem.", "ca_damper.")
PAPERS = {
    "The blast": {"eq": 4, "Fig": 15},
    "The damper": {"eq": 11, "Fig": 12},
}


def found(name):
    """What a dotted name stands for; LookupError with the part that is not there."""
    parts = name.split(".")
    thing, path = importlib.import_module(parts[0]), parts[0]
    for part in parts[1:]:
        path += f".{part}"
        fields = getattr(thing, "__dataclass_fields__", {})
        if hasattr(thing, part):
            thing = getattr(thing, part)
        elif part in fields:
            thing = fields[part]
        else:
            try:
                thing = importlib.import_module(path)
            except ImportError:
                raise LookupError(f"{name}: there is no {path}") from None
    return thing


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    for link in links(page):
        parts = urlsplit(link)
        if parts.scheme:
            assert parts.scheme == "https", link
            continue
        target = (FOLDER / page).parent / unquote(parts.path) if parts.path else FOLDER / page
        assert target.exists(), f"{page} links to {link}"
        if parts.fragment and target.suffix == ".md":
            assert parts.fragment in anchors(target.relative_to(FOLDER).as_posix()), link


@pytest.mark.parametrize("page", PAGES)
def test_names_exist(page):
    for word in words(page):
        if word.startswith(PACKAGES) and re.fullmatch(r"[\w.]+", word):
            found(word)


@pytest.mark.parametrize("page", PAGES)
def test_files_exist(page):
    """Paths from the root, with options behind them or not."""
    roots = "|".join(("taichi_dem", "ca_damper", "experiments", "tests", "docs"))
    for word in words(page):
        path = re.match(rf"(?:python )?((?:{roots})/[\w/.]+)", word)
        if path and "NAME" not in word:
            assert (FOLDER / path[1]).exists(), f"{page} names {path[1]}"


def rows(page):
    """Cells of all tables of a page, a row each, as (heading, list of inline tokens)."""
    row, titles = [], dict(headings(page))
    heading = ""
    for number, token in enumerate(tokens(page)):
        heading = titles.get(number, heading)
        if token.type == "tr_open":
            row = []
        elif token.type == "inline":
            row.append(token)
        elif token.type == "tr_close":
            yield heading, row


def test_every_equation_and_figure_is_on_the_page():
    for heading, counts in PAPERS.items():
        first = " ".join(
            row[0].content for where, row in rows("docs/papers.md") if where == heading
        )
        for kind, count in counts.items():
            there = {int(number) for number in re.findall(rf"{kind}\. (\d+)", first)}
            assert there == set(range(1, count + 1)), (heading, kind)
        assert "Table 1" in first


def test_every_row_says_where_it_is_seen():
    for heading, row in rows("docs/papers.md"):
        if heading in PAPERS and row[0].content != "in the paper":
            assert len(row) == 4 and row[3].content, row[0].content
            for name in re.findall(r"\w+\.py", row[2].content):
                assert (FOLDER / "experiments" / name).is_file(), name


def mentions(owner, name):
    """Whether a class or function has this word in its source; a Taichi struct, as a member."""
    members = getattr(owner, "members", None)
    if members is not None:
        return name in members
    return re.search(rf"\b{name}\b", inspect.getsource(owner)) is not None


def test_symbols_name_members_that_exist():
    """A word after a dotted name in the last cell is an option, a field or a member of it."""
    for heading, row in rows("docs/units.md"):
        names = [token.content for token in row[-1].children if token.type == "code_inline"]
        owner = None
        for name in names if heading.startswith("Symbols") else ():
            if name.startswith(PACKAGES):
                owner = found(name)
            else:
                assert mentions(owner, name), (owner, name)


def test_a_name_that_is_not_there_is_noticed():
    assert dataclasses.is_dataclass(found("taichi_dem.Material"))
    with pytest.raises(LookupError, match=r"no taichi_dem\.physics\.fracture\.gone"):
        found("taichi_dem.physics.fracture.gone")


def test_the_state_script_shows_what_the_page_lists():
    """It needs ParaView to run; what it would show are rows of the page."""
    sys.path.insert(0, str(Path(FOLDER) / "docs"))
    try:
        script = importlib.import_module("paraview_blast")
    finally:
        sys.path.pop(0)
    listed = {row[0].content.strip("`") for _, row in rows("docs/paraview.md")}
    assert set(script.SHOWN) < listed
