"""The page of all experiments shows what was run: failures are named, without old figures."""

import json
import re

import pytest

import gallery
from taichi_dem.kit.study.results_page import Entry

#: A stand-in for an experiment: writes what one writes, or fails as one fails.
SCRIPT = """
import json, os, sys
folder = sys.argv[sys.argv.index("--out") + 1]
if "bad" in folder:
    sys.exit("diverged at t = 1 s: <it> ran away")
os.makedirs(folder, exist_ok=True)
figures = {"peak_mm": {"value": 2, "unit": "mm", "paper": 1.93}}
made = {"figures": figures, "quick": "--quick" in sys.argv, "seconds": {"compile": 1, "run": 2},
        "command": "x", "machine": {"processor": "P", "cores": 2, "arch": "cpu"},
        "versions": {"taichi": "1", "numpy": "2"}}
json.dump(made, open(os.path.join(folder, "summary.json"), "w"))
"""


@pytest.fixture
def stand_ins(tmp_path, monkeypatch):
    """``stand_ins(*names)``: scripts of these names, with entries; returns where results go."""

    def make(*names):
        for name in names:
            (tmp_path / f"{name}.py").write_text(SCRIPT)
        made = [Entry(n, "Part", "Why?", "Look.", "1 s", "1 s", ("none.png",)) for n in names]
        monkeypatch.setattr(gallery, "HERE", tmp_path)
        monkeypatch.setattr(gallery, "PAGES", tuple(made))
        return tmp_path / "results"

    return make


def card(out, name):
    """What the page shows of an experiment."""
    page = (out / "index.html").read_text(encoding="utf-8")
    return re.search(rf'<article[^>]*id="{name}".*?</article>', page, re.DOTALL)[0]


def test_a_failed_experiment_is_named_and_leaves_no_old_figures(stand_ins, capsys):
    out = stand_ins("good", "bad")
    (out / "bad").mkdir(parents=True)
    (out / "bad" / "summary.json").write_text(json.dumps({"figures": {"old": {}}}))
    assert gallery.main(["--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert "bad: exit code 1: diverged at t = 1 s" in said and "good" not in said
    assert "No result: exit code 1" in card(out, "bad") and "&lt;it&gt;" in card(out, "bad")
    assert "1.93" in card(out, "good") and not (out / "bad" / "summary.json").exists()
