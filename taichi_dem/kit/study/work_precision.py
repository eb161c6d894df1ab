"""Work-precision diagrams: the cost of each method's error, as answers, a table and a picture.

A Point is one run of a method at one step. An error is trusted where every finer step of the same
method is as good and the method's floor (the distance of runs that should not differ) lies below
it: a single lucky run answers nothing.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from taichi_dem.kit.study.tables import write_rows
from taichi_dem.kit.study.timing import Timing


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


def percent(share: float) -> str:
    """A share in words: 0.0123 -> 1.2 %."""
    return f"{100.0 * share:.2g} %"


def answer_rows(
    points: Sequence[Point],
    targets: Iterable[float],
    floors: Mapping[str, float],
    titles: Mapping[str, str],
) -> list[tuple]:
    """Rows for a table: wanted error, method, step, seconds, evaluations, error had."""
    rows = []
    for target in targets:
        for answer in answers(points, target, floors):
            title, point = titles[answer.method], answer.point
            if point is None:
                rows.append((percent(target), title, f"not reached: {answer.reason}", "", "", ""))
            else:
                cost = (f"{point.low:.3g}", f"{point.evaluations:.3g}")
                rows.append((percent(target), title, point.label, *cost, percent(point.error)))
    return rows


ANSWER_HEADER = ["I want", "take", "at a step of", "seconds", "evaluations", "error"]


def write_points(path: str, points: Iterable[Point], floors: Mapping[str, float]) -> None:
    """CSV of everything a diagram shows; cells of what does not exist are empty."""
    names = "method step label error floor evaluations seconds_low seconds_median seconds_high"
    rows = []
    for point in points:
        time = point.seconds
        seconds = (time.low, time.median, time.high, time.count) if time else [math.nan] * 4
        row = (point.method, point.step, point.label, point.error, floors.get(point.method, 0.0))
        row = (*row, point.evaluations, *seconds, point.residual, point.failure)
        rows.append(["" if cell != cell else str(cell) for cell in row])
    write_rows(path, rows, f"{names} repeats residual failure")


def write_answers(path: str, rows: Sequence[tuple]) -> None:
    """The table of ``answer_rows`` as CSV."""
    write_rows(path, rows, ANSWER_HEADER)
