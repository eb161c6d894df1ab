"""Runs of ``demo_step_too_large.py``: what is seen of them, tables and words."""

import os

import numpy as np

from taichi_dem import CONCRETE, quality_report
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.study import figure, show_rows, write_rows

TABLE = {
    "limited by": ("limited_by", ""),
    "step / limit": ("share_of_limit", "g"),
    "step [s]": ("step_s", ".3g"),
    "reached [s]": ("reached_s", ".3g"),
    "unexplained / put in": ("unexplained", ".2g"),
    "end": ("end", ""),
}


def longest_step(mesh, limit):
    """Longest safe step of the worst body [s], by what sets it."""
    report = quality_report(mesh, CONCRETE)
    found = {"dashpots": report.dashpot_step_s, "springs": report.spring_step_s}
    return float(found[limit].min())


class Struck:
    """A run, and its observer.

    limit: what sets it; share: of it that the step [s] has. frames: snapshots; speeds: bounds of
    the speed of every body's corners in them [m/s], (frames, bodies). sentence: what the program
    said, "" when the run reached its end.
    """

    def __init__(self, limit, share, step):
        self.limit, self.share, self.step, self.sentence = limit, share, step, ""
        self.frames, self._speeds, self._time, self._account = [], [], [], []

    def observe(self, view):
        """Keep the bar and its energy balance as they are now."""
        self.view, self.model, motion = view, view.model, view.motion()
        spin = self.model.body_radius * np.linalg.norm(motion["spin"], axis=1)
        self.frames.append(view.frame())
        self._speeds.append(np.linalg.norm(motion["velocity"], axis=1) + spin)
        self._time.append(view.time_s)
        self._account.append(view.energy_balance())

    @property
    def time(self):
        """Time of every frame [s]."""
        return np.array(self._time)

    @property
    def speeds(self):
        """Speeds of all frames."""
        return np.array(self._speeds)

    @property
    def residual(self):
        """Energy that the account cannot explain over that put in by then, at every time."""
        given = np.array([abs(row["load_work"]) for row in self._account])
        found = np.array([abs(row["residual"]) for row in self._account])
        return found / np.where(given > 0.0, given, np.inf)


def caption(runs):
    """What to see, with the program's own words."""
    left, right = (
        f"steps of {1e9 * made.step:.0f} ns, {made.share:g} times what the {made.limit} bear: "
        f"{ended(made)}"
        for made in runs[:2]
    )
    return f"The same blow on the same bar. Left: {left}. Right: {right}."


def ended(made):
    """How a run ended, in words."""
    steps, missed = round(made.time[-1] / made.step), made.residual[-1]
    missed = f"{100 * missed:.2g} % of" if missed < 1.0 else f"{missed:.2g} times"
    if not made.sentence:
        return f"{missed} the energy put in is unexplained after {steps} steps"
    return (
        "neighbours shake against each other, ever more, until the program ends the run after "
        f"{steps} steps, when {missed} the energy put in has come from nowhere: "
        f'"{made.sentence}"'
    )


def row_of(made):
    """Row of the table."""
    return {
        "limited_by": made.limit,
        "share_of_limit": made.share,
        "step_s": made.step,
        "reached_s": float(made.time[-1]),
        "unexplained": float(made.residual[-1]),
        "end": "diverged" if made.sentence else "done",
    }


def print_runs(runs):
    """The runs as a table, and every sentence word for word."""
    show_rows([row_of(made) for made in runs], TABLE)
    print("What the program said:")
    for made in runs:
        if made.sentence:
            print(f"  {made.limit}, {made.share:g}: {made.sentence}")
    print()


def figures_of(runs, limits):
    """Figures for summary.json."""
    figures = {f"limit_{limit}_s": figure(step, "s") for limit, step in limits.items()}
    for made in runs:
        row, key = row_of(made), f"{made.limit}_{made.share:g}"
        figures[f"{key}_diverged"] = figure(int(bool(made.sentence)), "1")
        figures[f"{key}_reached_s"] = figure(row["reached_s"], "s")
        figures[f"{key}_unexplained"] = figure(row["unexplained"], "1")
    return figures


def write(runs, folder):
    """Tables of all that is plotted."""
    for made in runs:
        columns = {"time_s": made.time, "unexplained_over_put_in": made.residual}
        name = f"history_{made.limit}_{made.share:g}.csv"
        write_csv(os.path.join(folder, name), columns)
    rows = [{**row_of(made), "sentence": made.sentence} for made in runs]
    for row in rows:
        del row["unexplained"], row["end"]
    write_rows(os.path.join(folder, "steps.csv"), rows)
