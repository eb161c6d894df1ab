"""The page of all experiments: nobody missing, nothing broken, failures named."""

import json
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from PIL import Image

import gallery
from gallery import PAGES, TOOLS
from taichi_dem.kit.study import results_page
from taichi_dem.kit.study.results_page import Entry
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
quick = "--quick" in sys.argv
os.makedirs(folder, exist_ok=True)
Image.new("RGB", (1200, 600), "red").save(os.path.join(folder, "first.png"))
figures = {"seconds": {"value": 1.5, "unit": "s", "paper": None},
           "peak_mm": {"value": 2, "unit": "mm", "paper": 1.93},
           "steps": {"value": 5, "unit": "1", "paper": None},
           "best_method": {"value": "it", "unit": "", "paper": None},
           "exponent": {"value": None if quick else 1.5, "unit": "1", "paper": None}}
machine = {"processor": "P", "cores": 2, "arch": "cpu"}
json.dump({"figures": figures, "command": "experiments/" + name, "machine": machine,
           "versions": {"taichi": "1", "numpy": "2"}, "seconds": {"compile": 1, "run": 2},
           "quick": quick},
          open(os.path.join(folder, "summary.json"), "w"))
open(os.path.join(folder, "caption.txt"), "w").write(f"Seen in a run with quick {quick}.")
print("a table <with> brackets & signs")
"""


class Page_(HTMLParser):
    """What a page refers to; fails where a tag is not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.text = [], [], set(), []
        self.cells, self.cards, self.listed = [], {}, []
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
            self.listed += [values["src"]] if "nav" in self.open else []
        if tag == "article":
            self.cards[values["id"]] = ""
        if tag in ("td", "th"):
            self.cells.append("")

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"{tag} closes {self.open}"
        self.open.pop()

    def handle_data(self, data):
        self.text.append(data)
        if "article" in self.open:
            self.cards[list(self.cards)[-1]] += data
        if self.open and self.open[-1] in ("td", "th"):
            self.cells[-1] += data.strip()


@pytest.fixture
def stand_ins(tmp_path, monkeypatch):
    """``stand_ins(*names)``: scripts of these names, with entries; returns where results go."""

    def make(*names, entries=None):
        for name in names:
            (tmp_path / f"{name}.py").write_text(SCRIPT)
        made = [
            Entry(n, "Part", f"What of {n}?", "Look.", "1 s", "1 s", ("first.png",), ("steps",))
            for n in names
        ]
        monkeypatch.setattr(gallery, "HERE", tmp_path)
        monkeypatch.setattr(gallery, "PAGES", tuple(made[: entries or len(made)]))
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


NOTE = "Quick run: the text describes the full one."


def built(out):
    """The page that a gallery has written."""
    return Page_((out / "index.html").read_text(encoding="utf-8"))


def test_a_quick_result_says_so_however_the_page_is_made(stand_ins):
    """It is known from the result: a page may show both, and be made anew without running."""
    out = stand_ins("one", "two")
    assert gallery.main(["--out", str(out), "--only", "one", "--quick"]) == 0
    assert gallery.main(["--out", str(out), "--only", "two"]) == 0
    for again in ([], ["--quick"]):
        assert gallery.main(["--out", str(out), "--reuse", *again]) == 0
        page = built(out)
        assert NOTE in page.cards["one"] and NOTE not in page.cards["two"]
        assert "1 of 2 results are of quick runs" in " ".join(page.text)


@pytest.mark.parametrize(("option", "quick"), [(" --quick", True), (" --out quick", False)])
def test_a_result_of_an_older_version_is_known_by_its_command(stand_ins, option, quick):
    out = stand_ins("old")
    gallery.main(["--out", str(out)])
    summary = json.loads((out / "old" / "summary.json").read_text())
    del summary["quick"]
    summary["command"] = f"experiments/old.py{option}"
    (out / "old" / "summary.json").write_text(json.dumps(summary))
    gallery.main(["--out", str(out), "--reuse"])
    assert (NOTE in built(out).cards["old"]) == quick


@pytest.mark.parametrize("options", [(), ("--quick",)])
def test_no_cell_of_the_page_is_empty(stand_ins, options):
    out = stand_ins("one")
    gallery.main(["--out", str(out), *options])
    cells = built(out).cells
    assert cells and not set(cells) & {"", "None", "nan"}
    assert "not found" in cells if options else "1.5" in cells
    # Of two key figures the paper gives one.
    assert cells.count("–") == 1 and "1.93 mm" in cells


def test_a_table_without_a_papers_value_has_no_column_for_it(stand_ins):
    out = stand_ins("one")
    gallery.main(["--out", str(out)])
    assert built(out).cells.count("paper") == 1
    summary = json.loads((out / "one" / "summary.json").read_text())
    summary["figures"]["peak_mm"]["paper"] = None
    (out / "one" / "summary.json").write_text(json.dumps(summary))
    gallery.main(["--out", str(out), "--reuse"])
    assert not set(built(out).cells) & {"paper", "–"}


def test_a_run_speaks_for_itself_and_an_earlier_one_does_not(stand_ins):
    out = stand_ins("one", "bad")
    (out / "bad").mkdir(parents=True)
    (out / "bad" / "caption.txt").write_text("Seen in another run.")
    Image.new("RGB", (60, 30)).save(out / "bad" / "first.png")
    gallery.main(["--out", str(out)])
    cards = built(out).cards
    assert "Seen in a run with quick False." in cards["one"]
    assert "No result" in cards["bad"] and "another" not in cards["bad"]
    assert not (out / "bad" / "first.png").exists()


def test_the_list_has_a_small_picture_beside_each_result(stand_ins):
    out = stand_ins("one", "two", "bad")
    gallery.main(["--out", str(out)])
    assert built(out).listed == ["thumbnails/one.png", "thumbnails/two.png"]
    with Image.open(out / "thumbnails" / "one.png") as image:
        assert image.size == (480, 240)
    (out / "two" / "first.png").unlink()
    (out / "one" / "first.png").write_bytes(b"no picture")
    assert gallery.main(["--out", str(out), "--reuse", "--only", "one"]) == 0
    assert built(out).listed == []


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
    key, rest = results_page.figure_rows(figures, ("f*",))
    assert key[0] == ("known", "2702 s", "3,897 s")
    assert len(key) == 12 and len(rest) == 3


@pytest.mark.parametrize(
    "name, unit, words",
    [
        ("apparent_damping_N_s_m", "N s/m", "apparent damping"),
        ("limit_dashpots_s", "s", "limit dashpots"),
        # The unit is that of the number before it.
        ("plateau_at_2.5_MPa", "MPa", "plateau at 2.5 MPa"),
        ("errors_of_order_1", "1", "errors of order 1"),
        ("broken_faces", "mm", "broken faces"),
    ],
)
def test_a_unit_stands_beside_a_figure_and_not_in_its_name(name, unit, words):
    assert results_page.in_words(name, unit) == words
