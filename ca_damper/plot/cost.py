"""Pictures of what a cycle costs (Fig. 12), and of the steps that fillings bear."""

import numpy as np

from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, picture, styles_of

#: Filling, search or traversal with the step, marker and line of each variant; the paper's way is
#: dashed, markers tell the automaton's steps apart.
_VARIANTS = {
    "dem_pairs": ("dem", "all pairs, 20 µs", "^", "--"),
    "dem_cells": ("dem", "cells, 20 µs", "^", "-"),
    "ca_scan_1e-4": ("ca_static", "scan, 100 µs", "o", "--"),
    "ca_list_1e-4": ("ca_static", "list, 100 µs", "o", "-"),
    "ca_scan_2e-5": ("ca_static", "scan, 20 µs", "s", "--"),
    "ca_list_2e-5": ("ca_static", "list, 20 µs", "s", "-"),
}
#: What became of a run: words and marker.
_OUTCOMES = {
    "runs": ("runs", "o"),
    "diverges": ("diverges", "X"),
    "refused": ("refused before the first step", "|"),
}


def picture_cost(path, particles, costs):
    """CPU time of a cycle over the number of particles, linear and logarithmic.

    costs: {variant: {"timings": a Timing [s] for each number}}.
    """
    with picture(path, 1, 2, (10.0, 5.0)) as (figure, axes):
        for label, cost in costs.items():
            filling, words, mark, line = _VARIANTS[label]
            look = {"color": STYLES[filling].colour, "marker": mark, "ms": 4, "ls": line}
            look["label"] = f"{STYLES[filling].label}, {words}"
            middle = [1e3 * timing.median for timing in cost["timings"]]
            low = [1e3 * (timing.median - timing.low) for timing in cost["timings"]]
            high = [1e3 * (timing.high - timing.median) for timing in cost["timings"]]
            for axis in axes:
                axis.errorbar(particles, middle, yerr=[low, high], lw=1.2, **look)
        axes[1].set(yscale="log", xlabel="particles N [1]", title="the same, logarithmic")
        axes[0].set(xlabel="particles N [1]", ylim=(0, None), title="bars: range of the repeats")
        for axis in axes:
            axis.set_ylabel("CPU time of a cycle [ms]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3)


def picture_steps(path, borne):
    """What becomes of a run at each step: a row a filling. borne: {name: [(dt [s], outcome)]}."""
    styles = styles_of(borne)
    with picture(path, 1, 1, (7.0, 1.2 + 0.5 * len(borne))) as (_, axis):
        for word, (words, mark) in _OUTCOMES.items():
            axis.plot([], [], mark, color=BLACK, label=words, ms=7)
            for row, (name, found) in enumerate(borne.items()):
                steps = [1e6 * dt for dt, outcome in found if outcome == word]
                axis.plot(steps, [row] * len(steps), mark, color=styles[name].colour, ms=7)
        axis.set(xscale="log", xlabel="step [µs]", ylim=(-0.6, len(borne) - 0.4))
        axis.set_yticks(range(len(borne)), [style.label for style in styles.values()])
        axis.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def picture_curves(path, curves, oscillator):
    """Response curves by filling: means over seeds as lines, range as bars; empty dotted.

    curves: {name: (ratios, rms [mm], (ratios, seeds))}.
    """
    styles = styles_of(curves)
    with picture(path, 1, 1, (7.0, 4.6)) as (_, axis):
        for name, (ratios, rms) in curves.items():
            style, middle = styles[name], rms.mean(axis=1)
            bars = [middle - rms.min(axis=1), rms.max(axis=1) - middle]
            look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.2}
            axis.errorbar(ratios, middle, yerr=bars, label=style.label, **look)
        fine = np.linspace(min(ratios), max(ratios), 300)
        empty = abs(oscillator.transfer(fine * oscillator.natural_frequency))
        empty *= 1e3 * oscillator.base_amplitude / np.sqrt(2.0)
        top = 1.15 * max(rms.max() for _, rms in curves.values())
        axis.plot(fine, empty, ":", color=GREY, lw=1.0, label=STYLES["empty"].label)
        axis.set_title("mean over seeds; bars: their range")
        axis.set(xlabel="frequency f / f$_0$ [1]", ylabel="RMS displacement [mm]", ylim=(0.0, top))
        axis.legend()
