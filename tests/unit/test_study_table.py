"""Tables that a study declares once, and the figures that it hands to ``finish``."""

import json
from types import SimpleNamespace

import pytest

from taichi_dem.kit import runtime, study
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.study.machine import busiest_seconds, thread_seconds

TABLE = study.Table(
    method=("name", "method"),
    seconds=("report.seconds", "CPU [s]", ".1f", "s"),
    error=(lambda run: run.found / run.wanted - 1.0, "error", "+.1f%", "1"),
    kept=("found",),
)
RUNS = [
    SimpleNamespace(name="first", report=SimpleNamespace(seconds=2.0), found=5.0, wanted=4.0),
    SimpleNamespace(name="second", report=SimpleNamespace(seconds=1.0), found=3.0, wanted=4.0),
]


def test_rows_have_all_columns_in_order():
    assert [list(row.items()) for row in TABLE.rows(RUNS)] == [
        [("method", "first"), ("seconds", 2.0), ("error", 0.25), ("kept", 5.0)],
        [("method", "second"), ("seconds", 1.0), ("error", -0.25), ("kept", 3.0)],
    ]


def test_subjects_may_be_tuples():
    table = study.Table(end=(1,), sum=(sum,), begin=(0,))
    assert table.rows([(3, 4), (5, 6)]) == [
        {"end": 4, "sum": 7, "begin": 3},
        {"end": 6, "sum": 11, "begin": 5},
    ]


def test_columns_with_a_header_are_printed(capsys):
    TABLE.show(TABLE.rows(RUNS))
    lines = [line.split("  ") for line in capsys.readouterr().out.splitlines()]
    cells = [[cell.strip() for cell in line if cell] for line in lines if line != [""]]
    assert cells[0] == ["method", "CPU [s]", "error"]
    assert cells[1:] == [["first", "2.0", "+25.0 %"], ["second", "1.0", "-25.0 %"]]


def test_columns_with_a_unit_are_figures_beside_the_papers():
    first, _ = TABLE.rows(RUNS)
    assert TABLE.figures(first, "{method}_{key}", {"error": 0.1}) == {
        "first_seconds": {"value": 2.0, "unit": "s", "paper": None},
        "first_error": {"value": 0.25, "unit": "1", "paper": 0.1},
    }


def test_finish_takes_figures_and_their_arguments(tmp_path, monkeypatch):
    monkeypatch.setattr(runtime, "settings", lambda: runtime.Settings("cpu", 1, False))
    figures = {"made": study.figure(1.0, "s"), "given": (2.0, "m", 3.0)}
    study.finish(SimpleNamespace(out=str(tmp_path)), "none", figures, (1.0, 2.0))
    assert json.loads((tmp_path / "summary.json").read_text())["figures"] == {
        "made": {"value": 1.0, "unit": "s", "paper": None},
        "given": {"value": 2.0, "unit": "m", "paper": 3.0},
    }


def test_busiest_seconds_are_those_of_the_main_thread_and_the_busiest_other(monkeypatch):
    monkeypatch.setattr("os.getpid", lambda: 7)
    before = {7: 1.0, 8: 5.0, 9: 2.0}
    after = {7: 1.5, 8: 5.25, 9: 4.0, 10: 1.0}
    assert busiest_seconds(before, after) == pytest.approx(0.5 + 2.0)
    assert busiest_seconds({}, {}) is None


def test_threads_of_this_process_have_spent_time():
    found = thread_seconds()
    if not found:
        pytest.skip("this system does not tell")
    assert max(found.values()) > 0.0


def test_output_paths_lie_in_a_folder_that_is_made(tmp_path):
    at = study.output_paths(str(tmp_path / "a" / "b"))
    assert at("table.csv") == str(tmp_path / "a" / "b" / "table.csv")
    assert (tmp_path / "a" / "b").is_dir()
    with pytest.raises(InputError, match="must be the name of a folder"):
        study.output_paths("")
