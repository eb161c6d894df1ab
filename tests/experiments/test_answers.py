"""Answers of a work-precision study as files, printed table and figures."""

import csv

from taichi_dem.kit import study
from tests.experiments.test_work_precision import ROWS, TITLES


def test_answers_are_written_and_printed(tmp_path, capsys):
    study.give_answers(tmp_path, ROWS, (0.01, 1e-6), {"slow": 1e-3}, TITLES)
    with open(tmp_path / "answers.csv", newline="") as file:
        answers = list(csv.reader(file))
    assert answers[1][:3] == ["1 %", "sharp one", "0.25 s"]
    with open(tmp_path / "points.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == len(ROWS)
    assert "sharp one  0.25 s" in capsys.readouterr().out.splitlines()[1]


def test_figures_name_the_cheapest_and_what_each_method_takes():
    found = study.cheapest_figures(ROWS, 0.01, {}, "cheapest_seconds")
    assert found["cheapest_seconds_at_1_percent"] == study.figure(4.0, "s")
    assert found["cheapest_method_at_1_percent"] == study.figure("sharp", "")
    found = study.cheapest_figures(ROWS, 1e-9, {}, "seconds", "near_the_truth")
    assert found["seconds_near_the_truth"]["value"] is None
    each = study.figures_by_method(ROWS, 0.01, {})
    values = {name: figure["value"] for name, figure in each.items()}
    assert values == {"seconds_at_1_percent_slow": 10.0, "seconds_at_1_percent_sharp": 4.0}
