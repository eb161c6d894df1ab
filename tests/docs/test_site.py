"""The site of ``make docs``: complete, no broken link, and nothing from a network."""

import json
import re

import pytest

from docs.site.__main__ import main
from docs.site.api import api_pages
from docs.site.builder import HERE, broken_links, build, contents
from docs.site.markdown import rendered
from tests.docs.pages import FOLDER, PAGES, anchors


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of a site that was built twice in one place."""
    folder = tmp_path_factory.mktemp("site") / "site"
    build(folder)
    first = {path.name: path.read_bytes() for path in folder.glob("*.*")}
    build(folder)
    assert first == {path.name: path.read_bytes() for path in folder.glob("*.*")}
    return folder


def text_of(folder, name):
    return (folder / name).read_text(encoding="utf-8")


def test_every_page_is_in_the_contents():
    listed = [line for _, lines in contents() for line in lines]
    assert set(PAGES) <= set(listed) and len(set(listed)) == len(listed)


def test_no_link_is_broken_and_nothing_comes_from_a_network(site):
    assert not broken_links(site)
    for path in site.glob("*.html"):
        text = path.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|link)\b[^>]*\b(?:src|href)="([^"]+)"', text)
        assert not [link for link in loaded if re.match(r"(https?:)?//", link)], path.name
    assert "@import" not in text_of(site, "style.css") and "http" not in text_of(site, "style.css")


def test_anchors_are_those_that_the_pages_link_by(site):
    for page in ("docs/accuracy.md", "docs/papers.md", "README.md"):
        made = rendered(page, (FOLDER / page).read_text(encoding="utf-8"), {})
        assert {heading.anchor for heading in made.headings} <= anchors(page)


def test_the_api_shows_parameters_with_type_and_unit(site):
    text = text_of(site, "api_taichi_dem.html")
    section = text[text.index('<h2 id="ImplicitDashpots">') :]
    assert "<td><code>dt</code></td><td>float, default 4e-07</td><td>Step [s].</td>" in section
    assert '<h3 id="ImplicitDashpots.order">' in section
    assert 'id="Observer"' in text and "doctest" in text_of(site, "api_ca_damper.html")


def test_every_public_module_has_a_page():
    names = [name for name, _ in api_pages()]
    assert {"api_taichi_dem.effects.html", "api_ca_damper.excitation.html"} < set(names)
    assert len(set(names)) == len(names)


def test_the_search_finds_pages_headings_and_words(site):
    script = text_of(site, "search_index.js")
    rows = json.loads(script[script.index("=") + 1 : script.rindex(";")])
    named = {row[0]: row for row in rows}
    assert set(named) == {path.name for path in site.glob("*.html")}
    assert ["Friction", "Friction"] in named["api_taichi_dem.effects.html"][2]
    assert "checkpoint" in named["long_runs.html"][3].split()


def test_a_broken_link_is_named(tmp_path):
    (tmp_path / "a.html").write_text('<p id="here"><a href="a.html#here"> <a href="b.html">')
    (tmp_path / "c.html").write_text('<a href="a.html#gone"><img src="no.png"><a href="https://x">')
    assert broken_links(tmp_path) == [
        "a.html links to b.html",
        "c.html links to a.html#gone",
        "c.html links to no.png",
    ]


def test_a_folder_with_other_files_is_left_alone(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main([str(tmp_path)]) == 2
    assert "must be new, empty or that of an earlier site" in capsys.readouterr().err
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_a_page_that_is_not_listed_comes_at_the_end(monkeypatch, tmp_path):
    listed = (HERE / "contents.txt").read_text(encoding="utf-8")
    (tmp_path / "contents.txt").write_text(listed.replace("docs/units.md\n", ""))
    monkeypatch.setattr("docs.site.builder.CONTENTS", tmp_path / "contents.txt")
    assert ("More pages", ["docs/units.md"]) == (contents()[-1][0], contents()[-1][1][-1:])
