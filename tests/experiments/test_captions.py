"""What experiments say of their own runs: tables without blanks, captions true of the data."""

import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from _multirate import short_steps
from _step_too_large import ended
from ca_damper.demo_pictures import Decay
from taichi_dem.kit import study


@pytest.mark.parametrize("blank", ["", None, math.nan, np.float64("nan")])
def test_a_blank_cell_of_a_table_is_a_dash(capsys, blank):
    study.print_table([("a", blank, 0), ("b", 1, "c")], ["one", "two", "three"])
    assert capsys.readouterr().out.split("\n")[1].split() == ["a", "-", "0"]


def test_a_figure_that_was_not_found_says_so_in_words(capsys):
    figures = {"a": study.figure(None, "s"), "b": study.figure(math.inf, "1", 2)}
    study.print_figures(figures)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines == [
        ["figure", "value", "unit", "paper"],
        ["a", "not", "found", "s", "-"],
        ["b", "not", "found", "1", "2"],
    ]


def test_figures_without_a_papers_value_have_no_column_for_it(capsys):
    study.print_figures({"a": study.figure(0.0, "s"), "b": study.figure("it", "")})
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines == [["figure", "value", "unit"], ["a", "0", "s"], ["b", "it", "-"]]


@pytest.mark.parametrize(
    ("line", "quick"),
    [(["--quick"], True), (["--out", "a --quick b"], False), (["--steps", "9"], False)],
)
def test_a_summary_says_whether_its_run_was_quick_and_is_valid_json(
    tmp_path, monkeypatch, line, quick
):
    monkeypatch.setattr(sys, "argv", ["x.py", *line])
    figures = {"a": study.figure(np.float64("nan"), "s"), "b": study.figure(-math.inf, "1")}
    study.write_summary(tmp_path, "x", figures, compile_seconds=1.0, run_seconds=1.0)
    text = (tmp_path / "summary.json").read_text()
    summary = json.loads(text, parse_constant=pytest.fail)
    assert summary["quick"] is quick
    assert summary["figures"]["a"]["value"] is None


@pytest.mark.parametrize(
    ("rows", "text"), [([(1, "a"), (2, "b")], "x,y\n1,a\n2,b\n"), ([], "x,y\n")]
)
def test_rows_stand_under_their_names_and_names_without_rows(tmp_path, rows, text):
    study.write_rows(tmp_path / "table.csv", iter(rows), "x y")
    assert (tmp_path / "table.csv").read_text() == text


def test_the_end_of_a_script_adds_up_what_its_runs_took(tmp_path, monkeypatch, capsys):
    settings = SimpleNamespace(arch="cpu", threads=1)
    monkeypatch.setattr(study.summary.runtime, "settings", lambda: settings)
    runs = [SimpleNamespace(compile_seconds=1.0, run_seconds=k) for k in (2.0, 3.0)]
    options = SimpleNamespace(out=str(tmp_path))
    for given in (runs, (2.0, 5.0)):
        study.finish(options, "x", {"a": study.figure(1.5, "s")}, given)
        summary = json.loads((tmp_path / "summary.json").read_text())
        assert summary["seconds"] == {"compile": 2.0, "run": 5.0}
    assert str(tmp_path) in capsys.readouterr().out


def blow(levels):
    """A run of demo_multirate whose bar has bodies at 0.1, 0.4 and 0.7 m; the fragment at 0.95."""
    model = SimpleNamespace(centre=np.array([[x, 0.0, 0.0] for x in (0.1, 0.4, 0.7, 0.95)]))
    return SimpleNamespace(levels=np.array(levels), model=model)


def test_short_steps_of_the_blow_are_told_as_far_as_they_came():
    # From the end at 0.9 m to the body at 0.4 m; that at 0.7 m has gone back by a level.
    words = short_steps(blow([[0, 0, 0, 4], [0, 0, 3, 4], [0, 1, 2, 4]]), 0.9)
    assert "run 0.50 of 0.9 m into the bar" in words and "50 % of the bodies" in words
    # Nothing is said of short steps where there were none.
    assert "run" not in short_steps(blow([[0, 0, 0, 4], [0, 0, 0, 2]]), 0.9)


def ending(residual, sentence):
    """A run of demo_step_too_large that ended after 20 steps."""
    return SimpleNamespace(
        time=np.array([0.0, 2e-6]), step=1e-7, residual=np.array([0.0, residual]), sentence=sentence
    )


@pytest.mark.parametrize(("residual", "words"), [(0.0123, "1.2 % of the"), (13.4, "13 times the")])
def test_a_step_that_did_not_fail_is_not_said_to_have_failed(residual, words):
    done, failed = (ended(ending(residual, said)) for said in ("", "diverged there"))
    assert words in done and words in failed
    assert "20 steps" in done and "20 steps" in failed
    assert '"diverged there"' in failed and '"' not in done and "shake" not in done


@pytest.mark.parametrize("last", [20, 55, 327, 5000])
def test_the_bar_is_looked_at_once_the_blow_has_given_energy(script, last):
    """In the first steps the account misses half of the little given, and a look ends the run."""
    marks = script("demo_step_too_large").marks(last)
    assert marks[0] == 0 and marks[1] >= 5 and marks[-1] == last
    assert len(marks) <= 201 and marks == sorted(set(marks))


def test_cycles_of_a_decay_are_whole_and_none_where_it_stays_above():
    """Medians over three starts of two numbers of particles; 10 mm is the level."""
    ends = [[12e-3] * k + [9e-3] * (6 - k) for k in (2, 3, 5, 6, 6, 1)]
    decay = Decay([10, 30], np.array(ends), np.zeros((6, 9)))
    assert decay.cycles(10) == 3
    assert decay.cycles(30) is None
    assert decay.amplitudes(10).tolist() == [12.0, 12.0, 12.0, 9.0, 9.0, 9.0]
