"""How far does an impact reach, and must the rest be computed?

A pile of 100,000 tetrahedra is struck on its head. With effects="auto", a body sleeps until a
neighbour moves by more than a share of the mean speed or of a bond's limit. Bonds beyond are not
evaluated. Expect the awake zone to grow a little faster than the wave, as dashpots spread momentum
ahead of it. Steps are many times cheaper, the more so the longer the pile; the displacement is the
same to about 1e-8. In the paper's block of 2 m nothing sleeps for long.

    python experiments/demo_sleeping.py
    python experiments/demo_sleeping.py --cells 60       # a pile of 23,000: three minutes
    python experiments/demo_sleeping.py --sleep 1e-3     # a looser bound

Writes sleeping.png, sleeping.csv and summary.json to results/demo_sleeping/.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import taichi_dem as dem
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREY, ORANGE, picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar

NAME = "demo_sleeping"
SETTINGS = {
    "cells": (260, 40, study.whole(10, 2000), "boxes along the pile, 0.1 m each, default 260"),
    "until": (5e-4, 1e-4, study.number(0, 1), "simulated time [s], default 5e-4"),
    "sleep": (1e-6, 1e-6, study.number(0, 0.01), "share of speed and opening that wakes: 1e-6"),
    "across": (8, 2),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Step [s], edge of a box [m], and looks at the pile.
STEP, EDGE, LOOKS = 4e-7, 0.1, 20


def struck(mesh, sleep, until):
    """Run a pile that is struck at its left end; returns a table over time and the simulation."""
    blow = dem.effects.GasPressure("left", peak=3e6, rise=1e-4, decay_ratio=1.0)
    scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=[blow], sleep=sleep)
    simulation, rows = dem.Simulation(scene, dem.ImplicitDashpots(STEP)), []
    with ProgressBar("with sleep" if sleep else "without sleep") as progress:
        simulation.start()
        for k in range(1, LOOKS + 1):
            simulation.advance_to(round(until / STEP * k / LOOKS))
            rows.append(row_of(simulation))
            progress.at(k / LOOKS)
    return pd.DataFrame(rows).assign(run="asleep" if sleep else "awake"), simulation


def row_of(simulation):
    """Time, place of the wave's front and of the last body awake [m], share awake, CPU so far."""
    motion, awake = simulation.motion(), simulation.acting_since()["awake"]
    place, speed = simulation.model.centre[:, 0], np.linalg.norm(motion["velocity"], axis=1)
    return {
        "time_s": simulation.time_s,
        "front_m": place[speed > 0.01 * speed.max()].max(),
        "awake_m": place[np.isfinite(awake)].max(),
        "awake_percent": 100.0 * np.isfinite(awake).mean(),
        "cpu_s": simulation.run_cpu_seconds,
    }


def draw(path, slept, whole, length):
    """How far the wave and the zone awake reach, and what both runs cost; length: in m."""
    time = 1e3 * slept["time_s"]
    with picture(path, 1, 2, (9.0, 3.6)) as (_, (left, right)):
        left.plot(time, slept["awake_m"], color=BLUE, label="last body awake")
        left.plot(time, slept["front_m"], color=ORANGE, label="1 % of the speed")
        left.axhline(length, color=GREY, linestyle="--", label="end of the pile")
        left.set(xlabel="time [ms]", ylabel="distance from the head [m]", ylim=(0.0, 1.08 * length))
        left.legend(loc="center left")
        look = {"color": GREY, "linestyle": "-.", "label": "all evaluated"}
        right.plot(1e3 * whole["time_s"], whole["cpu_s"], **look)
        right.plot(time, slept["cpu_s"], color=BLUE, label="asleep until reached")
        right.set(xlabel="time [ms]", ylabel="CPU time of stepping [s]", ylim=(0.0, None))
        right.legend(loc="upper left")


def run(options):
    """Run with sleep and without, compare, draw, print."""
    folder, across = study.begin(options), options.across
    mesh = bar(EDGE * options.cells, EDGE * across, (options.cells, across, across))
    slept, first = struck(mesh, options.sleep, options.until)
    certificate, moved = first.report().certificate, first.motion()["position"]
    compiling = first.compile_seconds
    whole, second = struck(mesh, 0.0, options.until)
    full = second.motion()["position"]
    error = np.abs(moved - full).max() / np.abs(full - second.model.centre).max()
    print(f"\n{certificate}\n")
    pd.concat([slept, whole]).to_csv(folder / "sleeping.csv", index=False)
    draw(folder / "sleeping.png", slept, whole, EDGE * options.cells)
    figures = {
        "tetrahedra": (mesh.body_count, "1"),
        "speedup_by_sleep": (float(whole["cpu_s"].iloc[-1] / slept["cpu_s"].iloc[-1]), "1"),
        "error_by_sleep_percent": (100.0 * error, "%"),
        "asleep_percent": (100.0 * certificate.asleep, "%"),
        "left_out_impulse": (certificate.impulse, "1"),
        "audit_misses": (sum(audit.misses for audit in certificate.audits), "1"),
    }
    study.finish(options, NAME, figures, compiling + second.compile_seconds)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
