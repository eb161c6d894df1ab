"""The gallery runs experiments: failures are named, without old figures."""

import json
from pathlib import Path

import pytest

import gallery
from taichi_dem.kit import runtime, study
from taichi_dem.kit.study.entries import Entry

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


def test_a_failed_experiment_is_named_and_leaves_no_old_figures(stand_ins, capsys):
    out = stand_ins("good", "bad")
    (out / "bad").mkdir(parents=True)
    (out / "bad" / "summary.json").write_text(json.dumps({"figures": {"old": {}}}))
    assert gallery.main(["--out", str(out)]) == 1
    said = capsys.readouterr().err
    assert "bad: exit code 1: diverged at t = 1 s" in said and "good" not in said
    assert (out / "good" / "summary.json").exists() and not (out / "bad" / "summary.json").exists()


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_quick_gallery_leaves_the_results_of_the_full_one(stand_ins, tmp_path, monkeypatch):
    out = stand_ins("good")
    monkeypatch.chdir(tmp_path)
    assert gallery.main([]) == 0
    before = contents(out)
    assert gallery.main(["--quick"]) == 0
    after = contents(out)
    assert {path: after[path] for path in before} == before
    assert json.loads(after[out / "quick" / "good" / "summary.json"])["quick"] is True


def test_a_quick_study_leaves_the_results_of_the_full_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(runtime, "start", lambda *_: None)

    def run(options):
        Path(study.output_paths(options.out)("kind")).write_text(str(options.quick))

    for quick in ([], ["--quick"], ["--out", "mine", "--quick"]):
        assert study.main(run, study.parser("tiny", "Tiny."), quick) == 0
    kinds = {path.parent.as_posix(): path.read_text() for path in Path().rglob("kind")}
    assert kinds == {"results/tiny": "False", "results/quick/tiny": "True", "mine": "True"}
