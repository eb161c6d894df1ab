"""Where does a bar break when a pulse comes back from its free end?

First a weak push on the end of a bar: how fast does the wave run, and does the free end move twice
as fast as the wave behind it? Then bars in which a compressive pulse, steep in front and fading
linearly behind, runs to the right. The free end sends it back as tension, which first reaches the
strength at depth lambda sigma_t / (2 s0): the stronger the pulse s0, the thinner the spall.

    python experiments/demo_wave_and_spall.py             # a quarter of a minute
    python experiments/demo_wave_and_spall.py --cells 40

The front rises over four cells of the test bar and the dashpots have a twentieth of their
strength, so that neither the grid rings nor the pulse smears. The formula wants a steep front: at
three times the strength the depth nears the front's length, and a bar breaks a cell too near its
end (measured). Writes spall.gif, wave.png,
spall.png, wave.csv, spall.csv and summary.json to results/demo_wave_and_spall/.
"""

import os
import sys
from dataclasses import dataclass, replace

import numpy as np

from _cli import figure, main, parser, print_table, whole
from _demo import conclude, placed_together
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar
from taichi_dem.plot.wave import film_spall, picture_spall, picture_wave

NAME = "demo_wave_and_spall"
LENGTH, WIDTH = 4.0, 0.1
QUICK, FULL = {"cells": 40, "ratios": (1.5, 2.0)}, {"cells": 40, "ratios": (1.25, 1.5, 1.75, 2.0)}
STEP = 1e-6
#: Tail and front of the pulse [m], and the share of the dashpots that is left.
TAIL, FRONT, DAMPING = 2.4, 0.4, 0.05
#: Time between pictures [steps], and how long the bars are watched after the pulse turned [s].
EVERY, FRAMES = 20, 40
WATCHED = 1.9
#: Places where the wave's passing is timed, as shares of the bar.
GATES = (0.25, 0.625)
#: Bodies a cell.
CELL = 6


@dataclass(frozen=True, eq=False)
class Bars:
    """Bars over time.

    time (rows,) [s]; displacement [m] and velocity [m/s] of the cells (rows, bars, cells); joints:
    whether what is between two cells has broken, (rows, bars, cells - 1).
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    joints: np.ndarray

    def stress(self, modulus):
        """Stress of every joint [Pa], tension positive, zero where broken; modulus [Pa]."""
        cell = LENGTH / self.velocity.shape[2]
        strain = np.diff(self.displacement, axis=2) / cell
        return np.where(self.joints, 0.0, modulus * strain)


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--cells", type=whole(20, 160), help="boxes along a bar, 40")
    return made


def one_bar(cells):
    """The bar of all runs."""
    return bar(LENGTH, WIDTH, (cells, 1, 1))


def follow(simulation, bars, cells, until, progress):
    """Step to a time [s] and keep all cells on the way; returns Bars."""
    model, state = simulation.model, simulation.state
    across = crossing(model, cells)
    rows = {"time": [], "displacement": [], "velocity": [], "joints": []}
    last = round(until / STEP)
    for step in range(0, last + 1, EVERY):
        simulation.advance_to(step)
        broken = state.broken_tick.to_numpy()[: model.bond_count] >= 0
        moved = state.position.to_numpy()[:, 0] - model.centre[:, 0]
        shape = (bars, cells, CELL)
        rows["time"].append(simulation.time_s)
        rows["displacement"].append(moved.reshape(shape).mean(axis=2))
        rows["velocity"].append(state.velocity.to_numpy()[:, 0].reshape(shape).mean(axis=2))
        rows["joints"].append(broken[across].all(axis=2))
        progress(step / last)
    return Bars(**{name: np.array(values) for name, values in rows.items()})


def crossing(model, cells):
    """Bonds between neighbouring cells: their numbers (bars, cells - 1, 2)."""
    top = model.topology
    first, second = top.master // CELL, top.slave // CELL
    lower = np.minimum(first, second)
    bonds = np.flatnonzero(first != second)
    bonds = bonds[np.argsort(lower[bonds], kind="stable")]
    return bonds.reshape(model.body_count // (CELL * cells), cells - 1, -1)


def push(cells, progress):
    """A weak push on the left end of an elastic bar: (Bars, Simulation)."""
    load = effects.GasPressure("left", peak=1e4, rise=2e-4, decay_ratio=1.0)
    simulation = Simulation(Scene(one_bar(cells), CONCRETE, [load]), Uniform(STEP))
    return follow(simulation, 1, cells, 2.6e-3, progress), simulation


def wave_speed(made):
    """Speed [m/s] at which the push passes from gate to gate: where the two records agree best."""
    cells = made.velocity.shape[2]
    places = [round(share * cells) for share in GATES]
    fine = np.arange(0.0, made.time[-1], STEP)
    first, second = (np.interp(fine, made.time, made.velocity[:, 0, k]) for k in places)
    likeness = np.correlate(second, first, mode="full")[len(fine) - 1 :]
    return (places[1] - places[0]) * LENGTH / cells / (likeness.argmax() * STEP)


def doubling(made):
    """Peak velocity of the free end's last cell over that of the wave at the second gate."""
    gate = round(GATES[1] * made.velocity.shape[2])
    return float(made.velocity[:, 0, -1].max() / made.velocity[:, 0, gate].max())


def spall(cells, ratios, speed, progress):
    """Bars with a pulse of each strength under way: (Bars, Simulation)."""
    damped = replace(
        CONCRETE,
        normal_damping=DAMPING * CONCRETE.normal_damping,
        shear_damping=DAMPING * CONCRETE.shear_damping,
    )
    mesh = placed_together(
        {f"bar{k}": (one_bar(cells), (0.0, 0.0, 3 * WIDTH * k)) for k in range(len(ratios))}
    )
    scene = Scene(mesh, damped, [effects.Softening(), effects.BondDamping()])
    simulation = Simulation(scene, Uniform(STEP))
    lay_pulse(simulation, np.repeat(ratios, CELL * cells), speed)
    until = WATCHED * (FRONT + TAIL / 2.0) / speed
    return follow(simulation, len(ratios), cells, until, progress), simulation


def lay_pulse(simulation, ratio, speed):
    """Set the bars moving as a pulse does whose front stands at the free end.

    ratio: of every body's pulse to the strength. speed: of the wave [m/s]. In a wave to the right
    the velocity is v(x) and the strain -v / c.
    """
    model = simulation.model
    peak = ratio * CONCRETE.tensile_strength / (CONCRETE.density * speed)
    depth = LENGTH - model.centre[:, 0]
    grid = np.linspace(0.0, LENGTH, 4001)
    shape = np.interp(grid, [0.0, FRONT, FRONT + TAIL], [0.0, 1.0, 0.0])
    behind = np.cumsum(shape) * grid[1]
    still = np.zeros((model.body_count, 2))
    moved = peak / speed * np.interp(depth, grid, behind)
    along = np.column_stack([peak * np.interp(depth, grid, shape), still])
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (model.body_count, 1))
    simulation.state.set_motion(model.centre + np.column_stack([moved, still]), turn, along)


def spalled(made, ratios, speed):
    """A row for every bar: what arrived, where it broke first, where the formula says."""
    cells = made.velocity.shape[2]
    rows = []
    for k, ratio in enumerate(ratios):
        broken = made.joints[:, k]
        row = int(broken.any(axis=1).argmax())
        first = np.flatnonzero(broken[row])
        found = LENGTH - LENGTH / cells * (first.mean() + 1.0) if len(first) else np.nan
        end = made.velocity[: row + 1, k, -1].max()
        arrived = 0.5 * CONCRETE.density * speed * end
        rows.append(
            {
                "ratio": ratio,
                "arrived_MPa": 1e-6 * arrived,
                "time_ms": 1e3 * made.time[row],
                "depth_m": found,
                "formula_m": TAIL * CONCRETE.tensile_strength / (2.0 * arrived),
                "spall_speed_m_s": made.velocity[-1, k, -1],
                "joints_broken": int(broken[-1].sum()),
            }
        )
    return rows


def run(options):
    """Push, measure, spall, picture."""
    settings = QUICK if options.quick else FULL
    cells, ratios = options.cells or settings["cells"], settings["ratios"]
    output_folder(options.out)
    with ProgressBar("wave") as bar_shown:
        wave, first = push(cells, bar_shown.at)
    speed = wave_speed(wave)
    with ProgressBar("spall") as bar_shown:
        made, second = spall(cells, ratios, speed, bar_shown.at)
    rows = spalled(made, ratios, speed)
    print_rows(rows)
    picture(wave, made, rows, speed, options)
    figures, words = figures_of(wave, rows, speed, cells), caption(rows, doubling(wave))
    conclude(options, NAME, figures, words, [first, second])


def caption(rows, ends):
    """What to see; ends: peak velocity of the free end over that of the wave behind it."""
    one = rows[shown(rows)]
    return (
        "A compressive pulse (blue) reaches the free end on the right and comes back as tension "
        f"(red); that end moves {ends:.2f} times as fast as the wave behind it, measured in a weak "
        f"one. Where the sum first reaches the strength the bar breaks: at {one['depth_m']:.2f} m "
        f"from the end for a pulse of {one['ratio']:g} times the strength, the formula says "
        f"{one['formula_m']:.2f} m. The piece flies off with the momentum that is trapped in it, "
        "and the new end sends back what is left of the pulse."
    )


def shown(rows):
    """Number of the bar that the film shows."""
    return int(np.argmin([abs(row["ratio"] - 1.5) for row in rows]))


def print_rows(rows):
    """The bars as a table."""
    header = ["s0 / sigma_t", "arrived [MPa]", "broke at [ms]", "depth [m]", "formula [m]"]
    cells = [
        (
            f"{row['ratio']:g}",
            f"{row['arrived_MPa']:.2f}",
            f"{row['time_ms']:.3f}",
            f"{row['depth_m']:.3f}",
            f"{row['formula_m']:.3f}",
            f"{row['spall_speed_m_s']:.2f}",
        )
        for row in rows
    ]
    print_table(cells, [*header, "end flies at [m/s]"])
    print()


def figures_of(wave, rows, speed, cells):
    """Figures for summary.json."""
    figures = {
        "wave_speed_m_s": figure(float(speed), "m/s"),
        "free_end_over_wave": figure(doubling(wave), "1"),
        "cell_m": figure(LENGTH / cells, "m"),
    }
    for row in rows:
        key = f"spall_{row['ratio']:g}"
        figures[f"{key}_depth_m"] = figure(float(row["depth_m"]), "m")
        figures[f"{key}_formula_m"] = figure(float(row["formula_m"]), "m")
        figures[f"{key}_error_cells"] = figure(
            float((row["depth_m"] - row["formula_m"]) * cells / LENGTH), "1"
        )
    return figures


def picture(wave, made, rows, speed, options):
    """Write the pictures, their tables and the film."""

    def at(name):
        return os.path.join(options.out, name)

    modulus = CONCRETE.density * speed**2
    cells = wave.velocity.shape[2]
    gates = [round(share * cells) for share in GATES]
    columns = {f"at_{LENGTH * (k + 0.5) / cells:g}_m": wave.velocity[:, 0, k] for k in gates}
    columns["free_end"] = wave.velocity[:, 0, -1]
    write_csv(at("wave.csv"), {"time_s": wave.time, **columns})
    write_csv(at("spall.csv"), {name: [row[name] for row in rows] for name in rows[0]})
    picture_wave(at("wave.png"), LENGTH, wave.time, wave.velocity[:, 0], gates)
    picture_spall(at("spall.png"), LENGTH, made, made.stress(modulus), rows)
    strength = CONCRETE.tensile_strength
    film_spall(at("spall.gif"), LENGTH, made, made.stress(modulus), shown(rows), strength, FRAMES)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
