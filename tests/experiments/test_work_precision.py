"""Work-precision rows made by hand: which answer is right is known."""

import csv
import math

import numpy as np
import pytest
from PIL import Image

from ca_damper import InputError
from taichi_dem.kit.study import Timing, cached, digest
from taichi_dem.kit.study.work_precision import (
    Point,
    answer_rows,
    answers,
    cheapest,
    percent,
    write_points,
)
from taichi_dem.kit.study.work_precision_picture import cost_of, picture_work_precision


def row(method, step, error, seconds=None, failure=""):
    """A point whose seconds are 1 / step and evaluations 100 / step unless said otherwise."""
    timing = None if failure else Timing.of([seconds or 1.0 / step, 1.5 / step])
    error = math.nan if failure else error
    return Point(method, step, f"{step:g} s", 100.0 / step, error, timing, failure=failure)


# A first-order method with an error of 8 % at a step of one, and one that diverges above a step
# of 0.5 and is all but exact below.
ROWS = [
    *(row("slow", step, 0.08 * step) for step in (1.0, 0.1, 0.01)),
    row("sharp", 1.0, 0.0, failure="diverged"),
    row("sharp", 0.5, 0.02),
    row("sharp", 0.25, 1e-5),
]
TITLES = {"slow": "slow one", "sharp": "sharp one"}


def test_cheapest_of_what_is_accurate_enough_comes_first():
    best, other = answers(ROWS, 0.01, {})
    assert (best.method, best.point.step) == ("sharp", 0.25)
    assert (other.method, other.point.step) == ("slow", 0.1)
    # At 10 % the coarsest step of the first-order method costs a second, the other's two.
    assert [answer.point.step for answer in answers(ROWS, 0.1, {})] == [1.0, 0.5]


def test_cheapest_is_of_all_methods_or_of_one():
    assert cheapest(ROWS, 0.01, {}) == (4.0, "sharp")
    assert cheapest(ROWS, 0.01, {}, "slow") == (10.0, "slow")
    assert cheapest(ROWS, 1e-9, {}) == (None, None)


def test_lucky_coarse_step_is_no_answer():
    lucky = [*ROWS, row("slow", 2.0, 1e-6)]
    slow = next(a for a in answers(lucky, 0.001, {}) if a.method == "slow")
    assert slow.point.step == 0.01


def test_failure_at_a_finer_step_takes_the_coarser_ones_along():
    broken = [*ROWS, row("slow", 0.001, 0.0, failure="diverged")]
    slow = next(a for a in answers(broken, 0.1, {}) if a.method == "slow")
    assert slow.point is None


def test_error_below_the_floor_is_not_claimed():
    floors = {"sharp": 0.005}
    sharp = next(a for a in answers(ROWS, 0.001, floors) if a.method == "sharp")
    assert sharp.point is None
    assert "0.5 %" in sharp.reason


def test_table_says_what_is_not_reached_and_why():
    rows = answer_rows(ROWS, (0.01, 1e-6), {}, TITLES)
    assert rows[0] == ("1 %", "sharp one", "0.25 s", "4", "400", "0.001 %")
    assert rows[2][2] == "not reached: 0.08 % at its finest, 0.01 s"


def test_failed_point_costs_what_it_would_have_cost_at_the_rate_of_the_nearest_run():
    failed = ROWS[3]
    assert cost_of(failed, ROWS, "evaluations") == 100.0
    # The nearest step of the method, 0.5, made 200 evaluations in 2 s.
    assert cost_of(failed, ROWS, "seconds") == pytest.approx(1.0, rel=1e-12)


def test_csv_holds_every_row_and_leaves_out_what_is_not(tmp_path):
    path = tmp_path / "points.csv"
    write_points(path, ROWS, {"slow": 1e-3})
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(ROWS)
    assert rows[3]["failure"] == "diverged"
    assert rows[3]["error"] == rows[3]["seconds_low"] == ""
    assert float(rows[0]["floor"]) == 1e-3
    assert (float(rows[0]["seconds_low"]), float(rows[0]["seconds_high"])) == (1.0, 1.5)


def colours_in(path, colour):
    """Pixels of about a colour given as #RRGGBB."""
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    return int((abs(pixels - wanted).max(axis=2) < 12).sum())


def test_picture_shows_failures_and_more_than_without_them(tmp_path):
    shared = {
        "floors": {"slow": 1e-3},
        "caption": "made up",
        "error_name": "error",
        "work_name": "work",
        "residual_names": ("step", "residual"),
    }
    # A method that has failed throughout is drawn by its crosses alone.
    # Without words, so that only the crosses are counted.
    failed = [*ROWS, Point("never", 1.0, "", 100.0, failure=" ")]
    for name, rows in (("with", failed), ("without", ROWS)):
        titles = {**TITLES, "never": "never"}
        picture_work_precision(tmp_path / f"{name}.png", rows, titles, **shared)
    green = [colours_in(tmp_path / f"{name}.png", "#009E73") for name in ("with", "without")]
    assert green[0] > green[1] + 50


def test_percent_keeps_two_figures():
    assert [percent(x) for x in (0.1, 0.0123, 0.001)] == ["10 %", "1.2 %", "0.1 %"]


def test_kept_result_is_computed_once_for_the_same_settings(tmp_path):
    calls = []

    def compute():
        calls.append(1)
        return {"value": 0.1 + 0.2}

    made = [cached(tmp_path, "x", settings, (), compute) for settings in (1, 1, 2)]
    assert [kept for _, kept in made] == [False, True, False]
    assert all(result == {"value": 0.1 + 0.2} for result, _ in made)
    assert len(calls) == 2


def test_kept_result_that_cannot_be_read_is_refused(tmp_path):
    (tmp_path / f"x-{digest(1, ())}.json").write_text("{")
    with pytest.raises(InputError, match="delete it"):
        cached(tmp_path, "x", 1, (), dict)


def test_digest_changes_with_the_sources():
    assert digest(1, ("ca_damper",)) != digest(1, ("taichi_dem",))
