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
from _demo import set_moving
from _wave_and_spall import CELL, LENGTH, TABLE, Bars, caption, figures_of, write
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import finish, main, output_paths, parser, show_rows, whole
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.simulate import run_simulation

NAME, WIDTH = "demo_wave_and_spall", 0.1
SETTINGS = {
    "cells": (40, 40, whole(20, 160), "boxes along a bar, 40"),
    "ratios": ((1.25, 1.5, 1.75, 2.0), (1.5, 2.0)),
}
options_parser = partial(parser, NAME, __doc__, settings=SETTINGS)
#: Time step [s], steps between looks; tail and front of the pulse [m], share of dashpots left.
STEP, LOOK, TAIL, FRONT, DAMPING = 1e-6, 20, 2.4, 0.4, 0.05


def push(cells, progress):
    """A weak push on the left end of an elastic bar."""
    load = dem.effects.GasPressure("left", peak=1e4, rise=2e-4, decay_ratio=1.0)
    elastic = dem.Scene(bar(LENGTH, WIDTH, (cells, 1, 1)), dem.CONCRETE, [load])
    return followed(dem.Simulation(elastic, dem.Uniform(STEP)), 1, cells, 2.6e-3, progress)


def spall(cells, ratios, speed, progress):
    """Bars with a pulse of each strength under way."""
    damping = {k: DAMPING * getattr(dem.CONCRETE, k) for k in ("normal_damping", "shear_damping")}
    one, places = bar(LENGTH, WIDTH, (cells, 1, 1)), range(len(ratios))
    mesh = placed_together({f"bar{k}": (one, (0.0, 0.0, 3 * WIDTH * k)) for k in places})
    acting = [dem.effects.Softening(), dem.effects.BondDamping()]
    simulation = dem.Simulation(
        dem.Scene(mesh, replace(dem.CONCRETE, **damping), acting), dem.Uniform(STEP)
    )
    lay_pulse(simulation, np.repeat(ratios, CELL * cells), speed)
    return followed(simulation, len(ratios), cells, 1.9 * (FRONT + TAIL / 2.0) / speed, progress)


def followed(simulation, bars, cells, until, progress):
    """Step to the last look before a time [s]; returns Bars over time, and the Report."""
    seen = Bars(dem.Every(steps=LOOK), bars, cells)
    until = round(until / STEP) // LOOK * LOOK * STEP
    looks = {"samples": 1, "progress": progress, "observers": [seen]}
    return seen, run_simulation(simulation, until=until, **looks).report


def lay_pulse(simulation, ratio, speed):
    """Set the bars moving as a pulse does whose front stands at the free end.

    ratio: of every body's pulse to the strength. speed: of the wave [m/s]. In a wave to the right
    the velocity is v(x) and the strain -v / c.
    """
    centre = simulation.model.centre
    peak = ratio * dem.CONCRETE.tensile_strength / (dem.CONCRETE.density * speed)
    depth, grid = LENGTH - centre[:, 0], np.linspace(0.0, LENGTH, 4001)
    shape = np.interp(grid, [0.0, FRONT, FRONT + TAIL], [0.0, 1.0, 0.0])
    velocity = peak * np.interp(depth, grid, shape)
    moved = peak / speed * np.interp(depth, grid, np.cumsum(shape) * grid[1])
    set_moving(simulation, *(np.outer(values, (1.0, 0.0, 0.0)) for values in (velocity, moved)))


def run(options):
    """Push, measure, spall, picture."""
    at = output_paths(options.out)
    with ProgressBar("wave") as shown:
        wave, first = push(options.cells, shown)
    speed = wave.speed(STEP)
    with ProgressBar("spall") as shown:
        made, second = spall(options.cells, options.ratios, speed, shown)
    rows = made.spalled(options.ratios, speed, TAIL)
    show_rows(rows, TABLE)
    write(wave, made, rows, speed, at)
    figures = figures_of(wave, rows, speed)
    finish(options, NAME, figures, [first, second], caption=caption(rows, wave))


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
