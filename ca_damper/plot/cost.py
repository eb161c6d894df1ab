"""Pictures of what a cycle costs (Fig. 12), and of the steps that fillings bear."""

import numpy as np

from taichi_dem.plot_style import picture

TITLES = {
    "dem_pairs": "spheres, all pairs, 2e-5 s",
    "dem_cells": "spheres, cells, 2e-5 s",
    "ca_scan_1e-4": "automaton, scan, 1e-4 s",
    "ca_list_1e-4": "automaton, list, 1e-4 s",
    "ca_scan_2e-5": "automaton, scan, 2e-5 s",
    "ca_list_2e-5": "automaton, list, 2e-5 s",
}
#: Colour, mark, and line of each variant: spheres red, automata blue; the paper's way dashed.
_LOOKS = {
    "dem_pairs": ("#D55E00", "s", "--"),
    "dem_cells": ("#D55E00", "s", "-"),
    "ca_scan_1e-4": ("#0072B2", "o", "--"),
    "ca_list_1e-4": ("#0072B2", "o", "-"),
    "ca_scan_2e-5": ("#56B4E9", "^", "--"),
    "ca_list_2e-5": ("#56B4E9", "^", "-"),
}
_OUTCOMES = {"runs": ("#009E73", "o"), "diverges": ("#D55E00", "X"), "refused": ("0.6", "|")}


def picture_cost(path, particles, costs):
    """CPU time of a cycle over the number of particles, linear and logarithmic.

    costs: {variant: {"timings": a Timing [s] for each number}}.
    """
    with picture(path, 1, 2, (10.0, 4.4)) as (_, axes):
        for label, cost in costs.items():
            colour, mark, line = _LOOKS[label]
            look = {"color": colour, "marker": mark, "ms": 4, "ls": line, "label": TITLES[label]}
            middle = [1e3 * timing.median for timing in cost["timings"]]
            low = [1e3 * (timing.median - timing.low) for timing in cost["timings"]]
            high = [1e3 * (timing.high - timing.median) for timing in cost["timings"]]
            for axis in axes:
                axis.errorbar(particles, middle, yerr=[low, high], lw=1.2, **look)
        axes[1].set(yscale="log", xlabel="particles N")
        axes[0].set(xlabel="particles N", ylabel="CPU time of a cycle [ms]", ylim=(0, None))
        axes[0].legend(loc="upper left")


def picture_steps(path, borne):
    """What becomes of a run at each step: a row a filling. borne: {label: [(dt [s], outcome)]}."""
    with picture(path, 1, 1, (7.0, 1.2 + 0.5 * len(borne))) as (_, axis):
        for row, found in enumerate(borne.values()):
            for word, (colour, mark) in _OUTCOMES.items():
                steps = [dt for dt, outcome in found if outcome == word]
                label = word if row == 0 else None
                axis.plot(steps, [row] * len(steps), mark, color=colour, label=label, ms=7)
        axis.set(xscale="log", xlabel="step [s]", ylim=(-0.6, len(borne) - 0.4))
        axis.set_yticks(range(len(borne)), list(borne))
        axis.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def picture_curves(path, curves, oscillator):
    """Response curves by title: means over seeds as lines, their range as bars; empty dotted.

    curves: {title: (ratios, rms [mm], (ratios, seeds))}.
    """
    with picture(path, 1, 1, (7.0, 4.6)) as (_, axis):
        for (title, (ratios, rms)), mark in zip(curves.items(), "osD^vP*X"):
            middle = rms.mean(axis=1)
            bars = [middle - rms.min(axis=1), rms.max(axis=1) - middle]
            axis.errorbar(ratios, middle, yerr=bars, marker=mark, ms=4, lw=1.2, label=title)
        fine = np.linspace(min(ratios), max(ratios), 300)
        empty = abs(oscillator.transfer(fine * oscillator.natural_frequency))
        empty *= 1e3 * oscillator.base_amplitude / np.sqrt(2.0)
        top = 1.15 * max(rms.max() for _, rms in curves.values())
        axis.plot(fine, empty, ":", color="0.5", lw=1.0, label="empty container")
        axis.set(xlabel="frequency f / f$_0$", ylabel="RMS displacement [mm]", ylim=(0.0, top))
        axis.legend()
