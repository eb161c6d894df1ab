"""Answers of a work-precision study: the cheapest way to an error, as files, table and figures."""

import os
from collections.abc import Iterable, Mapping, Sequence

from taichi_dem.kit.study.summary import figure
from taichi_dem.kit.study.work_precision import (
    ANSWER_HEADER,
    Point,
    answer_rows,
    cheapest,
    percent,
    write_answers,
    write_points,
)
from taichi_dem.kit.terminal import print_table


def give_answers(
    folder: str,
    points: Sequence[Point],
    targets: Iterable[float],
    floors: Mapping[str, float],
    titles: Mapping[str, str],
) -> None:
    """Write points.csv and answers.csv to a folder and print the answers.

    targets: errors asked for. floors: error by method that no step can take away. titles: of the
    methods.
    """
    rows = answer_rows(points, targets, floors, titles)
    write_points(os.path.join(folder, "points.csv"), points, floors)
    write_answers(os.path.join(folder, "answers.csv"), rows)
    print_table(rows, ANSWER_HEADER)
    print()


def cheapest_figures(
    points: Sequence[Point], target: float, floors: Mapping[str, float], name: str, end: str = ""
) -> dict[str, dict]:
    """Figures of the cheapest way to an error: its seconds under a name, and the method.

    end: of both names; "at_1_percent" for an error of 0.01 unless said otherwise.
    """
    end = end or f"at_{percent(target).replace(' %', '_percent')}"
    seconds, method = cheapest(points, target, floors)
    found = {f"{name}_{end}": figure(seconds, "s")}
    return {**found, f"cheapest_method_{end}": figure(method, "")}


def figures_by_method(
    points: Sequence[Point], target: float, floors: Mapping[str, float]
) -> dict[str, dict]:
    """Figures of the seconds that each method needs for an error."""
    end = f"at_{percent(target).replace(' %', '_percent')}"
    return {
        f"seconds_{end}_{method}": figure(cheapest(points, target, floors, method)[0], "s")
        for method in dict.fromkeys(point.method for point in points)
    }
