"""Where does a bar break when a pulse comes back from its free end?

First a weak push on the end of a bar: how fast does the wave run, and does the free end move twice
as fast as the wave behind it? Then bars in which a compressive pulse, steep in front and fading
linearly behind, runs to the right. The free end sends it back as tension, which first reaches the
strength at depth lambda sigma_t / (2 s0): the stronger the pulse s0, the thinner the spall.

    python experiments/demo_wave_and_spall.py             # a quarter of a minute
    python experiments/demo_wave_and_spall.py --cells 40

The front rises over four cells of the test bar and the dashpots have a twentieth of their
strength, so that neither the grid rings nor the pulse smears. The formula wants a steep front: at
three times the strength a bar breaks a cell too near its end (measured). Writes spall.gif,
wave.png, spall.png, wave.csv, spall.csv and summary.json to results/demo_wave_and_spall/.
"""

import sys
from dataclasses import replace
from functools import partial

import numpy as np

import taichi_dem as dem
from _wave_and_spall import CELL, LENGTH, STEP, TABLE, Bars, caption, figures_of, write
from taichi_dem.kit import study
from taichi_dem.mesh.shapes import bar, placed_together

NAME, LAW = "demo_wave_and_spall", dem.CONCRETE
SETTINGS = {
    "cells": (40, 40, study.whole(20, 160), "boxes along a bar, 40"),
    "ratios": ((1.25, 1.5, 1.75, 2.0), (1.5, 2.0)),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Width of a bar, tail and front of the pulse [m], share of dashpots left.
WIDTH, TAIL, FRONT, DAMPING = 0.1, 2.4, 0.4, 0.05


def push(cells):
    """Push on the left end of an elastic bar, weakly; returns Bars over time, and the Report."""
    load = dem.effects.GasPressure("left", peak=1e4, rise=2e-4, decay_ratio=1.0)
    elastic, seen = dem.Scene(bar(LENGTH, WIDTH, (cells, 1, 1)), LAW, [load]), Bars(1, cells)
    return seen, seen.follow(dem.Simulation(elastic, dem.Uniform(STEP)), 2.6e-3, "wave")


def spall(cells, ratios, speed):
    """The same of bars with a pulse of each strength under way; speed: of waves [m/s]."""
    damping = {k: DAMPING * getattr(LAW, k) for k in ("normal_damping", "shear_damping")}
    one, places = bar(LENGTH, WIDTH, (cells, 1, 1)), range(len(ratios))
    mesh = placed_together({f"bar{k}": (one, (0.0, 0.0, 3 * WIDTH * k)) for k in places})
    acting = [dem.effects.Softening(), dem.effects.BondDamping()]
    scene, seen = dem.Scene(mesh, replace(LAW, **damping), acting), Bars(len(ratios), cells)
    simulation = dem.Simulation(scene, dem.Uniform(STEP))
    lay_pulse(simulation, np.repeat(ratios, CELL * cells), speed)
    return seen, seen.follow(simulation, 1.9 * (FRONT + TAIL / 2.0) / speed, "spall")


def lay_pulse(simulation, ratio, speed):
    """Set the bars moving as a pulse does whose front stands at the free end.

    ratio: of every body's pulse to the strength. speed: of the wave [m/s]. In a wave to the right
    the velocity is v(x) and the strain -v / c.
    """
    centre = simulation.model.centre
    peak = ratio * LAW.tensile_strength / (LAW.density * speed)
    depth, grid = LENGTH - centre[:, 0], np.linspace(0.0, LENGTH, 4001)
    shape = np.interp(grid, [0.0, FRONT, FRONT + TAIL], [0.0, 1.0, 0.0])
    velocity = peak * np.interp(depth, grid, shape)
    moved = peak / speed * np.interp(depth, grid, np.cumsum(shape) * grid[1])
    place, velocity = centre + np.outer(moved, (1, 0, 0)), np.outer(velocity, (1, 0, 0))
    simulation.state.set_motion(place, velocity=velocity)


def first_break(arrived):
    """Depth of the first break [m] by the formula; arrived: peak of the pulse [Pa]."""
    return TAIL * LAW.tensile_strength / (2.0 * arrived)


def run(options):
    """Push, measure, spall, picture."""
    at = study.output_paths(options.out)
    wave, first = push(options.cells)
    speed = wave.speed
    made, second = spall(options.cells, options.ratios, speed)
    rows = [made.spalled(k, one, speed, first_break) for k, one in enumerate(options.ratios)]
    study.show_rows(rows, TABLE)
    shown = write(wave, made, rows, at)
    figures, words = figures_of(wave, rows), caption(rows[shown], wave)
    study.finish(options, NAME, figures, [first, second], caption=words)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
