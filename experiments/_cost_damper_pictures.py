"""Pictures of the cost of accuracy of the damper: three diagrams, and the curves behind them."""

import os

import numpy as np

from _cost_rk45 import WAYS as RK45_WAYS
from _damper_response import OSCILLATOR
from taichi_dem.kit.plot_style import GREY, STYLES, picture, styles_of
from taichi_dem.kit.plot_style import seconds as seconds_in_words
from taichi_dem.kit.study.work_precision_picture import picture_work_precision


def titles_of(names):
    """Titles by method."""
    return {name: style.label for name, style in styles_of(names).items()}


def draw_all(folder, made, own, toward, empty, floors):
    """Work-precision diagrams: by method, toward the spheres, of the empty container."""
    first = next(iter(made.values()))
    job, shared = first.job, {"titles": titles_of(made), "floors": floors}
    shared["work_name"] = "particle steps [1]"
    shorter = max(sweep.reference["step"] / min(sweep.curves) for sweep in made.values())
    scenes = (
        f"{job.particles} particles, f/f0 = {', '.join(f'{r:g}' for r in job.ratios)}, "
        f"{len(first.seeds)} seeds, {job.transient} + {job.measured} cycles. Error: RMS over the "
        "frequencies of (response - reference), mean over seeds, as a share of the peak.\n"
    )
    balance = "mean force on the container: missing share of the weight [1]"
    picture_work_precision(
        os.path.join(folder, "work_precision.png"),
        own,
        error_name="error of the response curve / its peak [1]",
        residual_names=("step [µs]", balance),
        step_unit=1e-6,
        caption=f"{scenes}Reference of each method: itself with other seeds, at {shorter:.2g} of "
        "its finest step or less. Dotted: what seeds alone make of it.",
        **shared,
    )
    truth = seconds_in_words(made["dem_tsuji"].reference["step"])
    picture_work_precision(
        os.path.join(folder, "against_spheres.png"),
        toward,
        error_name="difference to the spheres' curve / its peak [1]",
        caption=f"{scenes}Reference of all: spheres, p = 1/4, at {truth}.",
        **shared,
    )
    picture_work_precision(
        os.path.join(folder, "rk45.png"),
        empty,
        titles_of(RK45_WAYS),
        floors={},
        order=5,
        error_name="error of the response curve / its peak [1]",
        work_name="evaluations of the right-hand side [1]",
        caption="Empty container. Error: RMS over the frequencies of (response - transfer "
        "function), as a share of the peak. Steps are at most 3.9 ms; rtol 0.01 where the longest "
        "step is swept, free steps in Python.",
    )
    picture_curves(os.path.join(folder, "curves.png"), made, OSCILLATOR)


def picture_curves(path, made, oscillator):
    """Response curves of the references: means over seeds as lines, range as bars; empty dotted."""
    styles = styles_of(made)
    with picture(path, 1, 1, (7.0, 4.6)) as (_, axis):
        for name, sweep in made.items():
            style, rms, ratios = styles[name], 1e3 * sweep.rms, sweep.job.ratios
            middle = rms.mean(axis=1)
            bars = [middle - rms.min(axis=1), rms.max(axis=1) - middle]
            look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.2}
            axis.errorbar(ratios, middle, yerr=bars, label=style.label, **look)
        fine = np.linspace(min(ratios), max(ratios), 300)
        empty = abs(oscillator.transfer(fine * oscillator.natural_frequency))
        empty *= 1e3 * oscillator.base_amplitude / np.sqrt(2.0)
        top = 1.15e3 * max(sweep.rms.max() for sweep in made.values())
        axis.plot(fine, empty, ":", color=GREY, lw=1.0, label=STYLES["empty"].label)
        axis.set_title("mean over seeds; bars: their range")
        axis.set(xlabel="frequency f / f$_0$ [1]", ylabel="RMS displacement [mm]", ylim=(0.0, top))
        axis.legend()
