"""Where does a bar break when a pulse comes back from its free end?

A weak push on the end of a bar shows how fast the wave runs, and whether the free end moves twice
as fast as the wave behind it. Then, in other bars, a compressive pulse runs to the right, with a
steep front and a linear decay. The free end reflects it as tension, which first reaches the
strength at depth lambda sigma_t / (2 s0): the stronger the pulse s0, the thinner the spall.

    python experiments/demo_wave_and_spall.py
    python experiments/demo_wave_and_spall.py --cells 40

The front rises over four cells of the test bar, and dashpots have a twentieth of their strength:
the mesh does not ring, and the pulse stays sharp. The formula assumes a steep front: at three times
the strength a bar breaks one cell too near its end. Writes spall.png, spall.csv and
summary.json to results/demo_wave_and_spall/.
"""

import sys
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pandas as pd

import taichi_dem as dem
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, GREY, RED, picture
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.simulate import run_simulation

NAME, LAW = "demo_wave_and_spall", dem.CONCRETE
SETTINGS = {
    "cells": (40, 40, study.whole(20, 160), "boxes along a bar, default 40"),
    "ratios": ((1.25, 1.5, 1.75, 2.0), (1.5, 2.0)),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Length and width of a bar, tail and front of the pulse [m], share of dashpots left.
LENGTH, WIDTH, TAIL, FRONT, DAMPING = 4.0, 0.1, 2.4, 0.4, 0.05
#: Bodies of a cell, time step [s], steps between looks.
CELL, STEP, LOOK = 6, 1e-6, 20
#: Places where the wave's passing is timed, as shares of the bar.
GATES = (0.25, 0.625)
TABLE = study.Table(
    ratio=("ratio", "s0 / sigma_t", "g"),
    arrived_MPa=("arrived_MPa", "arrived [MPa]", ".2f"),
    depth_m=("depth_m", "depth [m]", ".3f", "m"),
    formula_m=("formula_m", "formula [m]", ".3f", "m"),
    error_cells=(lambda one: float(one.depth_m - one.formula_m) / one.cell, "", "", "1"),
)


def follow(simulation, bars, until, title):
    """Step to the last look before a time [s]; returns the Result, and what is seen of the cells.

    moved, speed: mean displacement [m] and velocity [m/s], (looks, bars, cells). joints: whether
    all bonds between a cell and the next have broken, (looks, bars, cells - 1).
    """
    looks = round(until / STEP) // LOOK
    until = looks * LOOK * STEP
    result = run_simulation(simulation, until=until, samples=1, frames=looks, title=title)
    frames, top = result.frames, result.model.topology
    cells = np.array([[one.displacement[:, 0], one.velocity[:, 0]] for one in frames])
    cells = cells.reshape(len(frames), 2, bars, -1, CELL).mean(axis=-1)
    time, moved, speed = np.array([one.time_s for one in frames]), cells[:, 0], cells[:, 1]
    low, high = np.sort([top.master // CELL, top.slave // CELL], axis=0)
    broke = pd.Series(result.broken_time, low).fillna(np.inf)[low != high]
    joints = broke.groupby(level=0).max().to_numpy().reshape(bars, -1) <= time[:, None, None]
    return result, SimpleNamespace(time=time, moved=moved, speed=speed, joints=joints)


def spall(cells, ratios, speed):
    """Bars with a pulse of each strength under way, as ``follow``; speed: of waves [m/s].

    The front stands at the free end. In a wave to the right the velocity is v(x), the strain -v/c.
    """
    damping = {k: DAMPING * getattr(LAW, k) for k in ("normal_damping", "shear_damping")}
    one, places = bar(LENGTH, WIDTH, (cells, 1, 1)), range(len(ratios))
    mesh = placed_together({f"bar{k}": (one, (0.0, 3 * WIDTH * k, 0.0)) for k in places})
    acting = [dem.effects.Softening(), dem.effects.BondDamping()]
    simulation = dem.Simulation(dem.Scene(mesh, replace(LAW, **damping), acting), dem.Uniform(STEP))
    centre = simulation.model.centre
    peak = np.repeat(ratios, CELL * cells) * LAW.tensile_strength / (LAW.density * speed)
    depth, grid = LENGTH - centre[:, 0], np.linspace(0.0, LENGTH, 4001)
    shape = np.interp(grid, [0.0, FRONT, FRONT + TAIL], [0.0, 1.0, 0.0])
    velocity = peak * np.interp(depth, grid, shape)
    moved = peak / speed * np.interp(depth, grid, np.cumsum(shape) * grid[1])
    place, velocity = centre + np.outer(moved, (1, 0, 0)), np.outer(velocity, (1, 0, 0))
    simulation.state.set_motion(place, velocity=velocity)
    return follow(simulation, len(ratios), 1.9 * (FRONT + TAIL / 2.0) / speed, "spall")


def wave_speed(wave, gates, cell):
    """Speed [m/s] at which a push passes the gates: where both records agree best."""
    fine = np.arange(0.0, wave.time[-1], STEP)
    early, late = (np.interp(fine, wave.time, wave.speed[:, 0, gate]) for gate in gates)
    passing = np.correlate(late, early, mode="full")[len(fine) - 1 :].argmax() * STEP
    return float((gates[1] - gates[0]) * cell / passing)


def spalled(made, k, ratio, speed, cell):
    """Subject of TABLE: the stress that arrived, depth of the first break, the formula's."""
    joints, velocity = made.joints[:, k], made.speed[:, k, -1]
    row = int(joints.any(axis=1).argmax())
    first = np.flatnonzero(joints[row])
    arrived = 0.5 * LAW.density * speed * velocity[: row + 1].max()
    return SimpleNamespace(
        **{"ratio": ratio, "cell": cell, "arrived_MPa": 1e-6 * arrived},
        depth_m=LENGTH - cell * (first.mean() + 1.0) if len(first) else np.nan,
        formula_m=TAIL * LAW.tensile_strength / (2.0 * arrived),
    )


def picture_spall(path, made, stress, rows, joint, cell):
    """Stress [MPa] over place and time in the first bars, and depths beside the formula's."""
    time, top = made.time, np.abs(stress[:, :2]).max()
    with picture(path, 1, 3, size=(9.15, 3.6)) as (figure, (*panels, last)):
        for k, (row, axes) in enumerate(zip(rows, panels)):
            look = {"cmap": "RdBu_r", "vmin": -top, "vmax": top, "rasterized": True}
            drawn = axes.pcolormesh(joint, 1e3 * time, stress[:, k], shading="auto", **look)
            when, where = np.nonzero(np.diff(made.joints[:, k].astype(int), axis=0, prepend=0))
            axes.plot(joint[where], 1e3 * time[when], "x", color=BLACK, ms=6, label="breaks")
            look = {"color": BLACK, "ls": ":", "lw": 1.0, "label": "first break by the formula"}
            axes.axvline(LENGTH - row["formula_m"], **look)
            axes.set(xlabel="place [m]", ylabel="time [ms]")
            axes.set_title(f"pulse of {row['ratio']:g} × strength")
        figure.colorbar(drawn, ax=axes, label="stress, tension positive [MPa]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)
        arrived, depth = ([row[key] for row in rows] for key in ("arrived_MPa", "depth_m"))
        line = np.linspace(0.8 * min(arrived), 1.1 * max(arrived), 100)
        formula = rows[0]["formula_m"] * rows[0]["arrived_MPa"] / line
        last.plot(line, formula, color=GREY, label="pulse length × strength / (2 s$_0$)")
        last.errorbar(arrived, depth, cell, fmt="o", color=RED, ms=5, label="broke, ± one cell")
        last.set(xlabel="pulse s$_0$ that arrived [MPa]", ylabel="depth of the first break [m]")
        last.set(ylim=(0.0, None), title="a stronger pulse, a thinner piece")
        last.legend(loc="lower right", bbox_to_anchor=(1.0, 1.08))


def run(options):
    """Push, measure, spall, picture."""
    at, cells, cell = study.output_paths(options.out), options.cells, LENGTH / options.cells
    gates = [round(share * cells) for share in GATES]
    load = dem.effects.GasPressure("left", peak=1e4, rise=2e-4, decay_ratio=1.0)
    elastic = dem.Scene(bar(LENGTH, WIDTH, (cells, 1, 1)), LAW, [load])
    first, wave = follow(dem.Simulation(elastic, dem.Uniform(STEP)), 1, 2.6e-3, "wave")
    speed = wave_speed(wave, gates, cell)
    second, made = spall(cells, options.ratios, speed)
    rows = TABLE.rows([spalled(made, *one, speed, cell) for one in enumerate(options.ratios)])
    TABLE.show(rows)
    study.write_rows(at("spall.csv"), rows)
    strain = np.where(made.joints, 0.0, np.diff(made.moved, axis=-1) / cell)
    stress = 1e-6 * LAW.density * speed**2 * strain
    picture_spall(at("spall.png"), made, stress, rows, cell * np.arange(1, cells), cell)
    end, gate = wave.speed[:, 0, [-1, gates[1]]].max(axis=0)
    figures = {"wave_speed_m_s": (speed, "m/s"), "free_end_over_wave": (float(end / gate), "1")}
    for row in rows:
        figures.update(TABLE.figures(row, "spall_{ratio:g}_{key}"))
    study.finish(options, NAME, {**figures, "cell_m": (cell, "m")}, [first.report, second.report])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
