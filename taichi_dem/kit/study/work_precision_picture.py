"""Work-precision diagrams as pictures: errors over costs, floors, failures, labels of steps."""

import math
import os
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit import runtime
from taichi_dem.kit.plot_style import BLACK, GREY, picture, styles_of
from taichi_dem.kit.provenance import processor
from taichi_dem.kit.study.summary import versions
from taichi_dem.kit.study.work_precision import Point

_SMALL = 8.5
#: Where a label's centre may stand: right and up in widths and heights of the label, and a gap.
_PLACES = ((1, 1), (-1, -1), (1, -1), (-1, 1), (1, 0), (-1, 0), (0, 2), (0, -2), (1, 3), (-1, -3))
WALL = "wall time [s], fastest of the repeats"


def machine_words() -> str:
    """Machine, threads, versions and commit in a line, to stand on a picture."""
    settings: Any = runtime.settings()
    known = versions()
    threads = f"{settings.threads} thread{'s' if settings.threads > 1 else ''}"
    software = f"taichi {known['taichi']}, python {known['python']}"
    place = f"{processor()}, {os.cpu_count()} cores, {settings.arch}, {threads}"
    return f"{place}; {software}, commit {known['commit'] or 'unknown'}"


def picture_work_precision(
    path: str,
    points: Sequence[Point],
    *,
    floors: Mapping[str, float],
    caption: str,
    error_name: str,
    work_name: str,
    time_name: str = WALL,
    residual_names: Sequence[str] = (),
    step_unit: float = 1.0,
    order: int = 1,
) -> None:
    """Error over wall time and over evaluations; the residual of each run over its step.

    time_name: what the times are. floors: dotted, by method. order: of the line of ideal gain,
    error ~ cost^-order, drawn through the best buy. residual_names: of a third panel's axes (step,
    residual), none if empty; step_unit: of its step [s]. Failures are crosses on the top edge,
    above what they would have cost, with their reason.
    """
    below = ["evaluations", "residual"] if residual_names else ["evaluations"]
    with picture(path, 0, size=(9.2, 9.6)) as (figure, _):
        places = [["seconds"] * len(below), below]
        axes = figure.subplot_mosaic(places, height_ratios=(1.4, 1.0))
        looks, drawn = _looks(point.method for point in points), {}
        for cost, name in (("seconds", time_name), ("evaluations", work_name)):
            drawn[cost] = _Panel(axes[cost], points, looks, cost)
            drawn[cost].draw(floors, order)
            axes[cost].set(xlabel=name, ylabel=error_name)
        if residual_names:
            _draw_residuals(drawn["seconds"], axes["residual"], step_unit)
            axes["residual"].set_xlabel(residual_names[0])
            axes["residual"].set_ylabel(textwrap.fill(residual_names[1], 36))
        figure.legend(*_legend(axes["seconds"]), loc="outside upper left", ncols=2)
        marks = "Labels: what is swept. Bars: up to the slowest repeat."
        _write_below(figure, f"{caption} {marks}")
        # Where a label has room is known when everything else has its place.
        figure.draw_without_rendering()
        drawn["seconds"].label_steps()


def picture_errors(
    path: str,
    errors: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]],
    *,
    time_name: str,
    caption: str,
) -> None:
    """Several errors over one cost.

    errors: by what they are of, then by method: pairs (cost, error), coarse to fine. An error of
    zero lies on the bottom edge.
    """
    with picture(path, 1, len(errors), (9.2, 5.6)) as (figure, axes):
        looks = _looks(next(iter(errors.values())))
        for axis, (words, by_method) in zip(axes, errors.items()):
            seen = [error for pairs in by_method.values() for _, error in pairs if error > 0.0]
            bottom = 0.5 * min(seen, default=1.0)
            for method, pairs in by_method.items():
                height = [max(error, bottom) for _, error in pairs]
                axis.plot([cost for cost, _ in pairs], height, label=method, **looks[method])
            axis.set(xscale="log", yscale="log", title=words, ylabel="error [1]")
            axis.set_xlabel(textwrap.fill(time_name, 28))
        figure.legend(*_legend(axes[0]), loc="outside upper left", ncols=2)
        _write_below(figure, caption)


def _write_below(figure, caption):
    """A caption and the machine, in lines as wide as the figure."""
    lines = (textwrap.fill(" ".join(part.split()), 140) for part in (caption, machine_words()))
    figure.supxlabel("\n".join(lines), fontsize=_SMALL, x=0.01, ha="left")


def _looks(methods):
    """Colour and mark of every method."""
    return {
        method: {"color": style.colour, "marker": style.marker, "ms": 5, "lw": 1.2}
        for method, style in styles_of(methods).items()
    }


def _legend(axis):
    """Handles and labels, the methods by their titles."""
    handles, labels = axis.get_legend_handles_labels()
    titles = {method: style.label for method, style in styles_of(labels).items()}
    return handles, [titles[label] for label in labels]


def _cost(point, points, cost):
    """Cost of a point; of one without a time, at the rate of the method's nearest run."""
    if cost == "evaluations" or point.seconds:
        return point.evaluations if cost == "evaluations" else point.low
    timed = [p for p in points if p.seconds] or [point]
    own = [p for p in timed if p.method == point.method] or timed
    near = min(own, key=lambda p: abs(math.log(p.step / point.step)))
    return near.low * point.evaluations / near.evaluations if near.seconds else math.nan


class _Panel:
    """Errors over one cost. good, failed: (cost, point) by method, coarse to fine."""

    def __init__(self, axis, points, looks, cost):
        axis.set(xscale="log", yscale="log")
        self.axis, self.looks, self.timed = axis, looks, cost == "seconds"
        self.good, self.failed = {}, {}
        for method in looks:
            own = sorted((p for p in points if p.method == method), key=lambda p: -p.step)
            pairs = [(_cost(p, points, cost), p) for p in own]
            # An error of zero has no place on a log scale.
            self.good[method] = [pair for pair in pairs if pair[1].error > 0.0]
            self.failed[method] = [pair for pair in pairs if pair[1].failure]

    def draw(self, floors: Mapping[str, float], order: int) -> None:
        """Draw points, floors, the ideal gain and failures."""
        for method, look in self.looks.items():
            place = [at for at, _ in self.good[method]]
            errors = [p.error for _, p in self.good[method]]
            self.axis.plot(place, errors, label=method, **look)
            if self.timed and place:
                slower = [p.seconds.high - p.seconds.low for _, p in self.good[method]]
                ends = {"ecolor": look["color"], "elinewidth": 1.0, "capsize": 2, "fmt": "none"}
                self.axis.errorbar(place, errors, xerr=[[0.0] * len(place), slower], **ends)
            if floors.get(method):
                self.axis.axhline(floors[method], color=look["color"], ls=":", lw=1.0)
        if floors:
            self.axis.plot([], [], ls=":", color=GREY, label="chaos floor of each method")
        if any(self.good.values()):
            self._draw_ideal(order)
        if any(self.failed.values()):
            self._draw_failures()

    def _draw_ideal(self, order):
        """The line along which twice the cost brings 2^order times the accuracy: the ideal gain."""
        good = [(at, p.error) for own in self.good.values() for at, p in own]
        x, y = min(good, key=lambda at: at[0] * at[1] ** (1.0 / order))
        (left, right), (bottom, top) = self.axis.get_xlim(), self.axis.get_ylim()
        # A line that leaves at the bottom first would shift the limits.
        end = min(right, x * (y / bottom) ** (1.0 / order))
        start = max(left, x * (y / top) ** (1.0 / order))
        line = [y * (x / place) ** order for place in (start, end)]
        label = f"ideal gain, order {order}, from the cheapest point"
        self.axis.plot([start, end], line, color=GREY, ls="--", lw=0.9, label=label)
        self.axis.set(xlim=(left, right), ylim=(bottom, top))

    def _draw_failures(self):
        """Crosses in the marks of their methods along the top edge; their height is no error."""
        axis, failed = self.axis, {m: own for m, own in self.failed.items() if own}
        bottom, top = axis.get_ylim()
        step = (top / bottom) ** 0.055
        edge = top * step ** (len(failed) + 0.3)
        axis.axhspan(top, edge, color="0.94", lw=0, label="× failed: cost without an error")
        costs, (left, right) = [at for own in failed.values() for at, _ in own], axis.get_xlim()
        left, right = min(left, 0.8 * min(costs)), max(right, 1.25 * max(costs))
        axis.set(xlim=(left, right), ylim=(bottom, edge))
        for k, (method, own) in enumerate(failed.items()):
            level, look = top * step ** (k + 0.65), self.looks[method]
            place = [at for at, _ in own]
            axis.plot(place, [level] * len(own), "x", color=BLACK, ms=4, mew=1.2)
            axis.plot(place, [level] * len(own), **{**look, "ms": 9, "ls": "none", "mfc": "none"})
            # The small panel shows the crosses alone.
            words = ", ".join(f"{p.label} {p.failure}" for _, p in own) if self.timed else ""
            # On the side where there is room for it.
            late = place[-1] ** 2 > left * right
            end, shift, side = (place[0], -7, "right") if late else (place[-1], 7, "left")
            text = {"fontsize": _SMALL, "color": look["color"], "ha": side}
            axis.annotate(words, (end, level), (shift, -2.5), textcoords="offset points", **text)

    def label_steps(self) -> None:
        """Write every point's step beside it, where it covers least of what is there already."""
        good = [pair for own in self.good.values() for pair in own]
        places = [(at, p.error) for at, p in good]
        spots, unit = self.axis.transData.transform(places), self.axis.figure.dpi / 72.0
        taken = [_box(spot, 8.0 * unit, 8.0 * unit) for spot in spots]
        frame = self.axis.get_window_extent().get_points().ravel()
        for spot, place, (_, p) in zip(spots, places, good):
            wide, high = unit * (0.56 * _SMALL * len(p.label) + 1.0), unit * _SMALL
            reach = 0.5 * wide + 4.0 * unit, 0.5 * high + 2.0 * unit
            shifts = [np.multiply(reach, sides) for sides in _PLACES]
            boxes = [_box(spot + shift, wide, high) for shift in shifts]
            # The part outside the frame counts twice.
            hidden = [
                _shared(box, taken).sum() + 2.0 * (wide * high - _shared(box, [frame])[0]) + 0.5 * k
                for k, box in enumerate(boxes)
            ]
            k = int(np.argmin(hidden))
            taken.append(boxes[k])
            look = {"fontsize": _SMALL, "color": self.looks[p.method]["color"], "ha": "center"}
            look.update(va="center", textcoords="offset points")
            self.axis.annotate(p.label, place, tuple(shifts[k] / unit), **look)


def _box(middle, wide, high):
    """Left, bottom, right and top of a box."""
    half = np.array([0.5 * wide, 0.5 * high])
    return np.concatenate([middle - half, middle + half])


def _shared(box, others):
    """Area that a box shares with each of the others."""
    others = np.array(others)
    edges = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return np.maximum(edges, 0.0).prod(axis=1)


def _draw_residuals(panel, axis, unit):
    """The residual of each run over its step, in a unit [s]."""
    axis.set(xscale="log", yscale="log")
    for method, look in panel.looks.items():
        own = [p for _, p in panel.good[method] if p.residual > 0.0]
        axis.plot([p.step / unit for p in own], [p.residual for p in own], **look)
    # Within a decade a log axis writes all its minor ticks, wide as they are.
    axis.xaxis.set_minor_formatter("")
