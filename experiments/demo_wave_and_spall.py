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
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, GREY, RED, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.output.profile import Profile, travel_time
from taichi_dem.plot.bars import draw_breaks, draw_space_time, film_bar, picture_wave
from taichi_dem.simulate import run_simulation

NAME, LAW = "demo_wave_and_spall", dem.CONCRETE
SETTINGS = {
    "cells": (40, 40, study.whole(20, 160), "boxes along a bar, 40"),
    "ratios": ((1.25, 1.5, 1.75, 2.0), (1.5, 2.0)),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: A bar [m], and its bodies a cell; places where the wave's passing is timed, shares of its length.
LENGTH, WIDTH, CELL, GATES = 4.0, 0.1, 6, (0.25, 0.625)
#: Time step [s], steps between looks; tail and front of the pulse [m], share of dashpots left.
STEP, LOOK, TAIL, FRONT, DAMPING = 1e-6, 20, 2.4, 0.4, 0.05
TABLE = {
    "s0 / sigma_t": ("ratio", "g"),
    "arrived [MPa]": ("arrived_MPa", ".2f"),
    "broke at [ms]": ("time_ms", ".3f"),
    "depth [m]": ("depth_m", ".3f"),
    "formula [m]": ("formula_m", ".3f"),
    "end flies at [m/s]": ("spall_speed_m_s", ".2f"),
}


class Bars(Profile):
    """Bars over time, in cells as slices: arrays (looks, bars, cells)."""

    def __init__(self, bars, cells):
        slices = np.arange(CELL * bars * cells).reshape(bars, cells, CELL)
        super().__init__(dem.Every(steps=LOOK), slices)
        self.cell = LENGTH / cells
        self.place = self.cell * (np.arange(cells) + 0.5)
        self.gates = [round(share * cells) for share in GATES]

    def follow(self, simulation, until, title):
        """Step to the last look before a time [s]; returns the Report."""
        until = round(until / STEP) // LOOK * LOOK * STEP
        with ProgressBar(title) as progress:
            looks = {"samples": 1, "progress": progress, "observers": [self]}
            return run_simulation(simulation, until=until, **looks).report

    @property
    def speed(self):
        """Speed [m/s] at which a push passes the gates."""
        first, second = self.velocity[:, 0, self.gates].T
        way = (self.gates[1] - self.gates[0]) * self.cell
        return way / travel_time(self.time, first, second, STEP)

    @property
    def doubling(self):
        """Peak velocity of the free end's last cell over that of the wave at the second gate."""
        end, gate = self.velocity[:, 0, [-1, self.gates[1]]].max(axis=0)
        return float(end / gate)

    def spalled(self, k, ratio, speed):
        """Row of a bar: the stress that arrived, depth of the first break, the formula's."""
        joints, velocity = self.joints[:, k], self.velocity[:, k, -1]
        row = int(joints.any(axis=1).argmax())
        first = np.flatnonzero(joints[row])
        arrived = 0.5 * LAW.density * speed * velocity[: row + 1].max()
        return {
            "ratio": ratio,
            "arrived_MPa": 1e-6 * arrived,
            "time_ms": 1e3 * self.time[row],
            "depth_m": LENGTH - self.cell * (first.mean() + 1.0) if len(first) else np.nan,
            "formula_m": TAIL * LAW.tensile_strength / (2.0 * arrived),
            "spall_speed_m_s": velocity[-1],
            "joints_broken": int(joints[-1].sum()),
        }


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


def caption(one, wave):
    """Words on what to see; one: row of the bar in the film."""
    return (
        "A compressive pulse (blue) reaches the free end on the right and comes back as tension "
        f"(red); that end moves {wave.doubling:.2f} times as fast as the wave behind it, measured "
        "in a weak one. Where the sum first reaches the strength the bar breaks: at "
        f"{one['depth_m']:.2f} m from the end for a pulse of {one['ratio']:g} times the strength, "
        f"the formula says {one['formula_m']:.2f} m. The piece flies off with the momentum that is "
        "trapped in it, and the new end sends back what is left of the pulse."
    )


def show_wave(wave, at):
    """Write how a push runs along a bar, and what three places see of it."""
    velocity, cells = wave.velocity[:, 0], [*wave.gates, -1]
    names = [*(f"at_{wave.place[k]:g}_m" for k in wave.gates), "free_end"]
    write_csv(at("wave.csv"), {"time_s": wave.time, **dict(zip(names, velocity[:, cells].T))})
    words = [*(f"at {wave.place[k]:.2f} m" for k in wave.gates), "free end"]
    picture_wave(
        *(at("wave.png"), wave.place, wave.time, 1e3 * velocity),
        cells=dict(zip(words, cells)),
        label="velocity [mm/s]",
        titles=("it runs, comes back, runs again", "the free end doubles it"),
        level=("twice the wave's peak", 2e3 * velocity[:, wave.gates[1]].max()),
    )


def picture_spall(path, made, stress, rows):
    """Stress [MPa] over place and time in the first bars, and depths beside the formula's."""
    count, joint = min(2, len(rows)), made.place[:-1] + 0.5 * made.cell
    top = np.abs(stress[:, :count]).max()
    with picture(path, 1, 1 + count, size=(4.2 * (1 + count), 3.8)) as (figure, (*panels, last)):
        for k, (row, axes) in enumerate(zip(rows, panels)):
            drawn = draw_space_time(axes, joint, made.time, stress[:, k], top=top)
            draw_breaks(axes, joint, made.time, made.joints[:, k])
            look = {"color": BLACK, "ls": ":", "lw": 1.0, "label": "first break by the formula"}
            axes.axvline(LENGTH - row["formula_m"], **look)
            axes.set_title(f"pulse of {row['ratio']:g} × strength")
            axes.legend(loc="lower left")
        figure.colorbar(drawn, ax=axes, label="stress, tension positive [MPa]")
        arrived, depth = ([row[key] for row in rows] for key in ("arrived_MPa", "depth_m"))
        line = np.linspace(0.8 * min(arrived), 1.1 * max(arrived), 100)
        formula = rows[0]["formula_m"] * rows[0]["arrived_MPa"] / line
        last.plot(line, formula, color=GREY, label="pulse length × strength / (2 s$_0$)")
        look = {"fmt": "o", "color": RED, "ms": 5, "label": "broke, ± one cell"}
        last.errorbar(arrived, depth, yerr=made.cell, **look)
        last.set(xlabel="pulse s$_0$ that arrived [MPa]", ylabel="depth of the first break [m]")
        last.set(ylim=(0.0, None), title="the stronger, the thinner")
        last.legend(loc="upper right")


def run(options):
    """Push, measure, spall, picture."""
    at = study.output_paths(options.out)
    wave, first = push(options.cells)
    speed = wave.speed
    made, second = spall(options.cells, options.ratios, speed)
    rows = [made.spalled(k, ratio, speed) for k, ratio in enumerate(options.ratios)]
    study.show_rows(rows, TABLE)
    study.write_rows(at("spall.csv"), rows)
    show_wave(wave, at)
    stress = made.stress(LAW.density * speed**2, made.cell)
    picture_spall(at("spall.png"), made, 1e-6 * stress, rows)
    shown = int(np.argmin([abs(row["ratio"] - 1.5) for row in rows]))
    look = {"length": LENGTH, "strength_pa": LAW.tensile_strength}
    film_bar(at("spall.gif"), made, stress, bar=shown, **look)
    figures = {"wave_speed_m_s": (float(speed), "m/s"), "free_end_over_wave": (wave.doubling, "1")}
    figures["cell_m"] = wave.cell, "m"
    for row in rows:
        depth, formula, key = row["depth_m"], row["formula_m"], f"spall_{row['ratio']:g}"
        figures[f"{key}_depth_m"], figures[f"{key}_formula_m"] = (depth, "m"), (formula, "m")
        figures[f"{key}_error_cells"] = float(depth - formula) / wave.cell, "1"
    words = caption(rows[shown], wave)
    study.finish(options, NAME, figures, [first, second], caption=words)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
