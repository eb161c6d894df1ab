"""Runs of ``demo_multirate.py``: what is measured on them, tables and words."""

import os

import numpy as np

from _blast import level_shares
from taichi_dem import InputError
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.study import figures_from
from taichi_dem.mesh.topology import faces_of_group

TABLE = {
    "method": ("method", ""),
    "evaluations": ("evaluations", ","),
    "fewer by": ("fewer_evaluations", ".2f"),
    "struck end [um]": ("struck_um", ".2f"),
    "difference": ("difference", ".3f%"),
    "broken": ("broken_faces", ""),
    "residual": ("residual", ".2g%"),
    "CPU [s]": ("cpu_s", ".2f"),
}
UNITS = {"evaluations": "1", "struck_um": "um", "broken_faces": "1", "residual": "1"}


def check_speed(speed, gap, until):
    """InputError for a fragment that does not cross a gap [m] in half of the time [s]."""
    slowest = 2.0 * gap / until
    if speed < slowest:
        raise InputError(
            f"speed must be at least {slowest:g} m/s, at which the fragment crosses its gap of "
            f"{1e6 * gap:g} um in half of {until:g} s, got {speed:g}"
        )


class Impact:
    """A run of a method; an entry a frame.

    struck, far: mean way of the bar's ends away from the fragment [m]. evaluations: so far.
    levels: (frames, bodies).
    """

    def __init__(self, name, result, costs):
        self.name, self.result, self.frames = name, result, result.frames
        self.model, self.time = result.model, result.history["time_s"]
        self.evaluations = np.array(costs.columns["evaluations"])
        self.levels = np.array(costs.levels)
        self.struck, self.far = self._moved("bar_right"), self._moved("bar_left")

    def _moved(self, group):
        bodies, _ = faces_of_group(self.model.mesh, self.model.topology, group)
        return np.array([-frame.displacement[bodies, 0].mean() for frame in self.frames])


def compared(impacts, dt0):
    """A row for every method; differences are the largest over time, of the largest way."""
    base = impacts[0]
    return [
        {
            "method": impact.name,
            "evaluations": int(impact.evaluations[-1]),
            "fewer_evaluations": float(base.evaluations[-1] / impact.evaluations[-1]),
            "struck_um": 1e6 * float(impact.struck[-1]),
            "difference": float(
                np.abs(impact.struck - base.struck).max() / np.abs(base.struck).max()
            ),
            "broken_faces": impact.result.report.broken_faces,
            "smallest_step_s": dt0 / 2.0 ** int(impact.levels.max()),
            "residual": impact.result.report.energy_residual_fraction,
            "cpu_s": impact.result.report.run_cpu_seconds,
        }
        for impact in impacts
    ]


def figures_of(rows):
    """Figures for summary.json."""
    figures = {}
    for row in rows:
        units = UNITS
        if row is not rows[0]:
            units = {**UNITS, "fewer_evaluations": "1", "difference": "1"}
        figures.update(figures_from(row, units, f"{row['method']}_{{}}"))
    return figures


def caption(rows, impact, length):
    """What to see; impact: of the second row, in which every body has its own step."""
    base, other = rows[:2]
    return (
        "A fragment (right of the blue line) hits a bar. Above one step for all bodies, below a "
        f"step for each, by colour: {short_steps(impact, length)}. The struck end moves alike, "
        f"within {100 * other['difference']:.2g} %, with {1e-6 * other['evaluations']:.1f} instead "
        f"of {1e-6 * base['evaluations']:.1f} million bonds and contacts evaluated (a ratio of "
        f"{other['fewer_evaluations']:.2f}). The account of {other['method']} neighbours is off by "
        f"{100 * other['residual']:.2g} % of the energy, that of one step by "
        f"{100 * base['residual']:.2g} %."
    )


def short_steps(impact, length):
    """How far short steps came into the bar [m], and how many have grown again, in words."""
    place = impact.model.centre[:, 0]
    in_bar = place < length
    place, levels = place[in_bar], impact.levels[:, in_bar]
    finest = levels.max(axis=0)
    reached = finest > 0
    if not reached.any():
        return "at this speed all bodies of the bar keep the largest step"
    grown = (levels[-1] < finest)[reached].mean()
    return (
        f"short steps (dark) run {length - place[reached].min():.2f} of {length:g} m into the bar "
        f"with the wave, and at the end {100 * grown:.0f} % of the bodies that had them have "
        "longer ones again"
    )


def write(impacts, folder):
    """Tables of all that is plotted."""
    columns = {"time_s": impacts[0].time}
    for impact in impacts:
        columns[f"struck_{impact.name}_m"] = impact.struck
        columns[f"far_{impact.name}_m"] = impact.far
        columns[f"evaluations_{impact.name}"] = impact.evaluations
        levels = {f"level_{k}": share for k, share in enumerate(level_shares(impact.levels).T)}
        path = os.path.join(folder, f"levels_{impact.name}.csv")
        write_csv(path, {"time_s": impact.time, **levels})
    write_csv(os.path.join(folder, "blow.csv"), columns)
