"""Every experiment runs with --quick as a user runs it; its key figures lie within their bars."""

import functools
import json
import math
from fnmatch import filter as matching
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import backends
import bench
from _bench import Figure
from taichi_dem.kit import runtime
from taichi_dem.kit.study.entries import ENTRIES, read_entries
from taichi_dem.kit.timing import median_interval
from tests.experiments.contract import FOLDER, NAMES, rows_of, start
from tests.processes import phases_of

ENTRY = {entry.name: entry for entry in read_entries(FOLDER / ENTRIES)}
#: Those that the fast suite runs: a damper, a struck bar.
FAST = ("damper_patterns", "stable_or_not")
#: Lines on standard error of what is known to be outside the range of the paper's rules and steps.
KNOWN = "rules 'paper' of the automaton are known to fail", "is above the longest that is stable"
#: Lines of bars.txt by experiment, without its comments.
BARS = {
    name: [line.split() for line in lines if not line.startswith("#")]
    for name, *lines in (
        block.split("\n")
        for block in Path(__file__).with_name("bars.txt").read_text().strip().split("\n\n## ")[1:]
    )
}
QUICK = pytest.mark.experiment
CASES = [name if name in FAST else pytest.param(name, marks=QUICK) for name in NAMES]


def test_every_experiment_has_a_row_and_an_entry_of_the_gallery():
    assert sorted(BARS) == NAMES == sorted(ENTRY)


@pytest.mark.parametrize("name", CASES)
def test_a_quick_run_ends_well_and_its_key_figures_lie_within_their_bars(name, tmp_path):
    folder, report = tmp_path / "out", tmp_path / "figures.json"
    options = ENTRY[name].options.split()
    done = start(name, "--quick", "--out", folder, *options, report=report)
    assert done.returncode == 0, done.stderr
    # No progress bar, no banner, no warning: a pipe gets a line a phase, and a file stays readable.
    phases, others = phases_of(done.stderr)
    assert [line for line in others if not any(words in line for words in KNOWN)] == []
    # A long phase has further lines, with its share or part.
    begins = [line for line in phases if len(line.rpartition(": ")[2].split()) == 1]
    assert len(set(begins)) == len(begins)
    assert len(done.stdout.splitlines()) > 5 and "\x1b" not in done.stdout
    figures = figures_of(name, folder)
    for pattern in set(ENTRY[name].figures) - listed(name, "lacks:"):
        assert matching(figures, pattern), f"the gallery's {pattern} is no figure"
    for figure, *bars in BARS[name]:
        if not figure.endswith(":"):
            assert is_within(figures[figure], bars, figures), f"{figure} is {figures[figure]}"
    pictures = set(ENTRY[name].pictures) - listed(name, "lacks:")
    for file in pictures | listed(name, "files:"):
        assert (folder / file).is_file(), file
    assert list(folder.glob("*.csv")) and not list(folder.rglob("*.part*"))
    for picture in folder.glob("*.png"):
        assert is_drawn(picture), picture.name
    assert json.loads(report.read_text())["defects"] == []


def figures_of(name, folder):
    """Values of the summary of a quick run; JSON has no NaN, so that none can be told as true."""
    text = (folder / "summary.json").read_text()
    summary = json.loads(text, parse_constant=pytest.fail)
    assert summary["experiment"] == name and summary["quick"] is True
    # Cases that run in processes of their own compile nothing here.
    assert max(summary["seconds"].values()) > 0.0 and summary["versions"] and summary["machine"]
    assert all(set(figure) == {"value", "unit", "paper"} for figure in summary["figures"].values())
    return {key: figure["value"] for key, figure in summary["figures"].items()}


def listed(name, field):
    """Words of a field of an experiment's bars."""
    return {word for first, *words in BARS[name] for word in words if first == field}


def is_within(value, bars, figures):
    """Whether a figure lies within its bars, or is the word wanted."""
    if len(bars) == 1:
        return value == bars[0]
    low, high = (eval(bar, {**vars(math), "of": figures}, figures) for bar in bars)
    return low <= value <= high


def is_drawn(picture):
    """Whether a picture is more than a blank canvas, which has one colour."""
    with Image.open(picture) as image:
        return min(image.size) >= 300 and len(np.unique(np.asarray(image.convert("L")))) > 20


@pytest.mark.slow
def test_a_quick_bench_measures_waits(tmp_path):
    done = start("bench", "--quick", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    medians = json.loads((tmp_path / "bench.jsonl").read_text())["medians"]
    assert medians["first_scene_cold_seconds"] > medians["second_scene_seconds"] > 0.0


def test_the_bench_tells_the_change_since_the_last_run(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runtime, "start", lambda *_: None)
    monkeypatch.setattr(runtime, "settings", lambda: runtime.Settings("cpu", 1, False))
    for seconds in (2.0, 3.0):
        part = functools.partial(lambda value, quick: [Figure("work", "s", [value])], seconds)
        monkeypatch.setattr(bench, "PARTS", (functools.update_wrapper(part, bench.run),))
        bench.study.main(bench.run, bench.options_parser(), ["--out", str(tmp_path)])
    assert "+50 %" in capsys.readouterr().out


def test_the_table_of_speed_replaces_the_one_of_its_page():
    page = "# Title\n\nMeasured on a toaster:\n\n| a |\n|---|\n| 1 |\n\nText.\n\n| b |\n|---|\n"
    words = "scene bodies place low high n evaluations megabytes share broken digest".split()
    row = SimpleNamespace(**dict.fromkeys(words, 0), rate=3)
    lines = backends.renewed(page, [row]).splitlines()
    assert lines[0] == "# Title" and "toaster" not in lines[2]
    assert lines[4].startswith("| scene | bodies |") and lines[6].startswith("| 0 | 0 | 0 | 3 |")
    assert lines[7:] == ["", "Text.", "", "| b |", "|---|"]


@pytest.mark.parametrize("count, low, high", [(5, 0, 4), (6, 0, 5), (9, 1, 7), (21, 5, 15)])
def test_the_interval_of_a_median_is_that_of_signs(count, low, high):
    """Each side leaves out at most 2.5 % of the 2^n ways in which values lie about the median."""
    assert median_interval([*range(count)][::-1]) == ((count - 1) / 2, low, high)
    if count > 5:
        assert sum(math.comb(count, k) for k in range(low + 1)) / 2**count <= 0.025


@QUICK
def test_a_diverging_run_names_body_and_step_and_keeps_the_last_good_output(tmp_path):
    light = "--without", "body_contact,sticking_friction", "--out", tmp_path
    done = start("blast_fracture", "--method", "fixed", "--dt0", "1e-6", *light)
    phases, others = phases_of(done.stderr)
    assert {phases[0], phases[-1]} == {"blasting: compiling", "blasting: stepping"}
    warning, _ = others
    assert done.returncode == 3 and KNOWN[1] in warning, done.stderr
    for word in ("diverged at t = ", "body ", "try a step of "):
        assert word in done.stderr
    rows = rows_of(tmp_path / "history.csv")
    assert all(math.isfinite(float(value)) for row in rows for value in row.values())
    assert not (tmp_path / "summary.json").exists()
