"""The page of all experiments: nobody missing, nothing broken, failures named."""

import json
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from PIL import Image

import _gallery_html
import _gallery_pages
import gallery
from _gallery_pages import PAGES, TOOLS, Page
from tests.scenes import ROOT

VOID = {"meta", "img", "br", "link", "input", "hr"}
#: A stand-in for an experiment: writes what one writes, or fails as one fails.
SCRIPT = """
import json, os, sys
from PIL import Image
folder = sys.argv[sys.argv.index("--out") + 1]
name = os.path.basename(folder)
if "bad" in name:
    sys.exit("diverged at t = 1 s: <it> ran away")
os.makedirs(folder, exist_ok=True)
Image.new("RGB", (1200, 600), "red").save(os.path.join(folder, "first.png"))
figures = {"seconds": {"value": 1.5, "unit": "s", "paper": None},
           "peak_mm": {"value": 2, "unit": "mm", "paper": 1.93}}
machine = {"processor": "P", "cores": 2, "arch": "cpu"}
json.dump({"figures": figures, "command": "experiments/" + name, "machine": machine,
           "versions": {"taichi": "1", "numpy": "2"}, "seconds": {"compile": 1, "run": 2}},
          open(os.path.join(folder, "summary.json"), "w"))
print("a table <with> brackets & signs")
"""


class Page_(HTMLParser):
    """What a page refers to; fails where a tag is not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.text = [], [], set(), []
        self.feed(text)
        assert self.open == [], f"never closed: {self.open}"

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        values = dict(attributes)
        self.ids.add(values.get("id"))
        self.links += [values[key] for key in ("src", "href") if key in values]
        if tag == "img":
            assert values.get("alt"), "a picture without words"

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"{tag} closes {self.open}"
        self.open.pop()

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture
def stand_ins(tmp_path, monkeypatch):
    """``stand_ins(*names)``: scripts of these names, with entries; returns where results go."""

    def make(*names, entries=None):
        for name in names:
            (tmp_path / f"{name}.py").write_text(SCRIPT)
        made = [Page(n, "Part", f"What of {n}?", "Look.", "1 s", ("first.png",)) for n in names]
        monkeypatch.setattr(gallery, "HERE", tmp_path)
        monkeypatch.setattr(_gallery_pages, "HERE", tmp_path)
        monkeypatch.setattr(_gallery_pages, "PAGES", tuple(made[: entries or len(made)]))
        return tmp_path / "results"

    return make


def test_every_experiment_has_one_entry():
    names = [page.name for page in PAGES]
    assert len(names) == len(set(names))
    assert gallery.without_entry() == []
    assert not set(names) & set(TOOLS)
    assert all((Path(ROOT) / "experiments" / f"{tool}.py").is_file() for tool in TOOLS)


def test_an_entry_says_everything():
    for page in PAGES:
        assert page.question.endswith("?") and page.look.endswith("."), page.name
        assert page.time and page.pictures, page.name


def test_the_page_holds_together(stand_ins, capsys):
    out = stand_ins("good_one", "good_two")
    assert gallery.main(["--out", str(out)]) == 0
    page = Page_((out / "index.html").read_text(encoding="utf-8"))
    for link in page.links:
        parts = urlsplit(link)
        # From disk, without a server and without the network.
        assert not parts.scheme and not parts.netloc, link
        if parts.path:
            assert (out / unquote(parts.path)).is_file(), link
        else:
            assert parts.fragment in page.ids, link
    text = "".join(page.text)
    assert "a table <with> brackets & signs" in text
    assert "What of good_one?" in text and "1.93" in text and "P, 2 cores" in text
    assert capsys.readouterr().err == ""


def test_a_failed_experiment_is_named_and_leaves_no_old_figures(stand_ins, capsys):
    out = stand_ins("good", "bad")
    old = out / "bad"
    old.mkdir(parents=True)
    (old / "summary.json").write_text(json.dumps({"figures": {"old": {}}}))
    assert gallery.main(["--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert "bad: exit code 1: diverged at t = 1 s" in said and "good" not in said
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "No result: exit code 1" in page and "&lt;it&gt;" in page
    assert not (old / "summary.json").exists()


def test_an_experiment_without_an_entry_is_named(stand_ins, capsys):
    out = stand_ins("good", "other", entries=1)
    assert gallery.main(["--out", str(out)]) == 1
    assert "other: has no entry" in capsys.readouterr().err


def test_reuse_runs_only_what_has_no_result(stand_ins, capsys):
    out = stand_ins("one", "two")
    assert gallery.main(["--out", str(out), "--only", "one"]) == 0
    capsys.readouterr()
    assert gallery.main(["--out", str(out), "--reuse"]) == 0
    said = capsys.readouterr().out
    assert "one ..." not in said and "two ..." in said


def test_an_unknown_name_is_refused_in_one_sentence(tmp_path, capsys):
    assert gallery.main(["--out", str(tmp_path), "--only", "nothing"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("only must name experiments out of") and "'nothing'" in said
    assert said.count("\n") == 1 and not list(tmp_path.iterdir())


def test_small_pictures_are_small(stand_ins, tmp_path, monkeypatch):
    out = stand_ins("good")
    gallery.main(["--out", str(out)])
    written = gallery.shrink_pictures(out, tmp_path)
    with Image.open(written[0]) as image:
        assert image.size == (960, 480) and image.mode == "P"


def test_figures_with_a_papers_value_are_never_folded_away():
    """15 figures that match, the last alone with a paper's value: it comes first of 12."""
    figures = {f"f{k}": {"value": k, "unit": "1", "paper": None} for k in range(14)}
    figures["known"] = {"value": 2702.0, "unit": "s", "paper": 3897}
    key, rest = _gallery_html.figure_rows(figures, ("f*",))
    assert key[0] == ("known", "2702", "s", "3,897")
    assert len(key) == 12 and len(rest) == 3


@pytest.mark.parametrize(
    "name, unit, words",
    [
        ("apparent_damping_N_s_m", "N s/m", "apparent damping"),
        ("limit_dashpots_s", "s", "limit dashpots"),
        ("errors_of_order_1", "1", "errors of order 1"),
        ("broken_faces", "mm", "broken faces"),
    ],
)
def test_a_unit_stands_beside_a_figure_and_not_in_its_name(name, unit, words):
    assert _gallery_html.in_words(name, unit) == words
