"""Work-precision diagrams: the cost of each method's error, as answers, a table and a picture.

A Point is one run of a method at one step. An error is trusted where every finer step of the same
method is as good and the method's floor (the distance of runs that should not differ) lies below
it: a single lucky run answers nothing.
"""

import itertools
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from taichi_dem.kit.study.summary import figure, write_rows
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.timing import Timing

#: Errors that are asked for.
TARGETS = (0.1, 0.01, 0.001)
_ANSWER_HEADER = ["I want", "take", "at a step of", "seconds", "evaluations", "error"]
_POINT_HEADER = (
    "method step label error floor evaluations seconds_low seconds_median seconds_high repeats "
    "residual failure"
)


@dataclass(frozen=True)
class Point:
    """A run of a method.

    step: the swept number, larger is coarser (a time step, a tolerance). label: the step in words.
    evaluations: work done, or that would have been done by a run that failed. error, residual:
    shares, NaN where there is none. seconds: a Timing without compiling, None for a failure.
    failure: why there is no result, in a few words, or nothing.
    """

    method: str
    step: float
    label: str
    evaluations: float
    error: float = math.nan
    seconds: Timing | None = None
    residual: float = math.nan
    failure: str = ""

    @property
    def low(self) -> float:
        """Seconds of the fastest repeat, NaN for a failure."""
        return self.seconds.low if self.seconds else math.nan


@dataclass(frozen=True)
class Answer:
    """The cheapest point of a method for an error, or None and the reason."""

    method: str
    point: Point | None
    reason: str = ""


def answers(points: Sequence[Point], target: float, floors: Mapping[str, float]) -> list[Answer]:
    """An Answer for every method, cheapest first, then those that do not reach the error.

    target: largest error. floors: error by method that no step can take away.
    """
    methods = list(dict.fromkeys(point.method for point in points))
    found = [_answer(method, points, target, floors.get(method, 0.0)) for method in methods]
    return sorted(found, key=lambda one: one.point.low if one.point else math.inf)


def _answer(method, points, target, floor):
    if floor > target:
        return Answer(method, None, f"equal runs differ by {percent(floor)}")
    own = sorted((point for point in points if point.method == method), key=lambda p: p.step)
    # NaN, of a failure, is no error at all.
    reached = list(itertools.takewhile(lambda point: point.error <= target, own))
    if not reached:
        return Answer(method, None, f"{percent(own[0].error)} at its finest, {own[0].label}")
    return Answer(method, min(reached, key=lambda point: point.low))


def percent(share: float) -> str:
    """A share in words: 0.0123 -> 1.2 %."""
    return f"{100.0 * share:.2g} %"


def give_answers(
    folder: str,
    points: Sequence[Point],
    floors: Mapping[str, float],
    titles: Mapping[str, str],
) -> dict[str, dict]:
    """Write points.csv and answers.csv to a folder, print the answers, return figures of them.

    floors: error by method that no step can take away. titles: of the methods. Figures: the seconds
    at 1 and at 0.1 %, cheapest method first, and those of each method at 1 %.
    """
    rows = []
    for target in TARGETS:
        for one in answers(points, target, floors):
            rows.append((percent(target), titles[one.method], *_cells(one)))
    write_points(os.path.join(folder, "points.csv"), points, floors)
    write_rows(os.path.join(folder, "answers.csv"), rows, _ANSWER_HEADER)
    print_table(rows, _ANSWER_HEADER)
    print()
    found = cheapest_figures(points, 0.01, floors, "cheapest_seconds")
    found.update(cheapest_figures(points, 0.001, floors, "seconds"))
    for method in dict.fromkeys(point.method for point in points):
        seconds, _ = cheapest(points, 0.01, floors, method)
        found[f"seconds_{_end_of(0.01)}_{method}"] = figure(seconds, "s")
    return found


def _cells(answer):
    """Step, seconds, evaluations and error of an answer, or why there is none."""
    point = answer.point
    if point is None:
        return f"not reached: {answer.reason}", "", "", ""
    return point.label, f"{point.low:.3g}", f"{point.evaluations:.3g}", percent(point.error)


def write_points(path: Any, points: Iterable[Point], floors: Mapping[str, float]) -> None:
    """CSV of everything a diagram shows; cells of what does not exist are empty."""
    rows = []
    for p in points:
        time = p.seconds
        seconds = (time.low, time.median, time.high, time.count) if time else [math.nan] * 4
        run = p.method, p.step, p.label, p.error, floors.get(p.method, 0.0), p.evaluations
        row = (*run, *seconds, p.residual, p.failure)
        rows.append(["" if cell != cell else str(cell) for cell in row])
    write_rows(path, rows, _POINT_HEADER)


def cheapest(
    points: Sequence[Point],
    target: float,
    floors: Mapping[str, float],
    method: str | None = None,
) -> tuple[float | None, str | None]:
    """Seconds and name of the cheapest method for an error, or of one method; None for neither."""
    found = [a for a in answers(points, target, floors) if method in (None, a.method)]
    point = found[0].point
    return (point.low, point.method) if point else (None, None)


def cheapest_figures(
    points: Sequence[Point], target: float, floors: Mapping[str, float], name: str, end: str = ""
) -> dict[str, dict]:
    """Figures of the cheapest way to an error: its seconds under a name, and the method.

    end: of both names; "at_1_percent" for an error of 0.01 unless said otherwise.
    """
    end = end or _end_of(target)
    seconds, method = cheapest(points, target, floors)
    found = {f"{name}_{end}": figure(seconds, "s")}
    return {**found, f"cheapest_method_{end}": figure(method, "")}


def _end_of(target):
    return f"at_{percent(target).replace(' %', '_percent')}"
