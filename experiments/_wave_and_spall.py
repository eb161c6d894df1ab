"""Bars of ``demo_wave_and_spall.py`` over time, what is measured on them, and words."""

import os

import numpy as np

from taichi_dem import CONCRETE, Every
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.study import figure, figures_from, write_rows
from taichi_dem.plot.wave import film_spall, picture_spall, picture_wave
from taichi_dem.simulate import run_simulation

LENGTH = 4.0
#: Bodies a cell; pictures of the film.
CELL, FRAMES = 6, 40
#: Places where the wave's passing is timed, as shares of the bar.
GATES = (0.25, 0.625)
TABLE = {
    "s0 / sigma_t": ("ratio", "g"),
    "arrived [MPa]": ("arrived_MPa", ".2f"),
    "broke at [ms]": ("time_ms", ".3f"),
    "depth [m]": ("depth_m", ".3f"),
    "formula [m]": ("formula_m", ".3f"),
    "end flies at [m/s]": ("spall_speed_m_s", ".2f"),
}


class Bars:
    """Bars over time, kept by observing a run.

    time (rows,) [s]; displacement [m] and velocity [m/s] of the cells (rows, bars, cells); joints:
    whether the bonds between two cells have broken, (rows, bars, cells - 1).
    """

    when = Every(steps=20)

    def __init__(self, bars, cells):
        self.shape, self.rows = (bars, cells, CELL), []

    def observe(self, view):
        """Keep all cells as they are now."""
        motion = view.motion()
        moved = motion["position"][:, 0] - view.model.centre[:, 0]
        both = (x.reshape(self.shape).mean(axis=2) for x in (moved, motion["velocity"][:, 0]))
        broken = view.broken[self._crossing(view.model.topology)]
        self.rows.append((view.time_s, *both, broken.all(axis=2)))

    def _crossing(self, topology):
        """Bonds between neighbouring cells: their numbers (bars, cells - 1, 2)."""
        first, second = topology.master // CELL, topology.slave // CELL
        bonds = np.flatnonzero(first != second)
        bonds = bonds[np.argsort(np.minimum(first, second)[bonds], kind="stable")]
        return bonds.reshape(self.shape[0], self.shape[1] - 1, -1)

    def follow(self, simulation, until, progress):
        """Step to the last look before a time [s]; returns itself, and the Report of the run."""
        step, steps = simulation.method.dt0, self.when.steps
        until = round(until / step) // steps * steps * step
        looks = {"samples": 1, "progress": progress, "observers": [self]}
        return self, run_simulation(simulation, until=until, **looks).report

    def __getattr__(self, name):
        names = ("time", "displacement", "velocity", "joints")
        if name not in names:
            raise AttributeError(name)
        return np.array([row[names.index(name)] for row in self.rows])

    def stress(self, modulus):
        """Stress of every joint [Pa], tension positive, zero where broken; modulus [Pa]."""
        strain = np.diff(self.displacement, axis=2) / (LENGTH / self.shape[1])
        return np.where(self.joints, 0.0, modulus * strain)

    def spalled(self, ratios, speed, tail):
        """A row for every bar: the stress that arrived, depth of the first break, the formula's."""
        rows, velocity, joints = [], self.velocity, self.joints
        for k, ratio in enumerate(ratios):
            row = int(joints[:, k].any(axis=1).argmax())
            first = np.flatnonzero(joints[row, k])
            cell = LENGTH / self.shape[1]
            arrived = 0.5 * CONCRETE.density * speed * velocity[: row + 1, k, -1].max()
            found = {
                "ratio": ratio,
                "arrived_MPa": 1e-6 * arrived,
                "time_ms": 1e3 * self.time[row],
                "depth_m": LENGTH - cell * (first.mean() + 1.0) if len(first) else np.nan,
                "formula_m": tail * CONCRETE.tensile_strength / (2.0 * arrived),
                "spall_speed_m_s": velocity[-1, k, -1],
                "joints_broken": int(joints[-1, k].sum()),
            }
            rows.append(found)
        return rows


def gates(made):
    """Cells at which the wave's passing is timed."""
    return [round(share * made.shape[1]) for share in GATES]


def wave_speed(made, step):
    """Speed [m/s] at which the push passes from gate to gate: where the two records agree best."""
    places, fine = gates(made), np.arange(0.0, made.time[-1], step)
    first, second = (np.interp(fine, made.time, made.velocity[:, 0, k]) for k in places)
    likeness = np.correlate(second, first, mode="full")[len(fine) - 1 :]
    return (places[1] - places[0]) * LENGTH / made.shape[1] / (likeness.argmax() * step)


def doubling(made):
    """Peak velocity of the free end's last cell over that of the wave at the second gate."""
    velocity = made.velocity[:, 0]
    return float(velocity[:, -1].max() / velocity[:, gates(made)[1]].max())


def caption(rows, wave):
    """Words on what to see; rows: of ``spalled``."""
    one = rows[shown(rows)]
    return (
        "A compressive pulse (blue) reaches the free end on the right and comes back as tension "
        f"(red); that end moves {doubling(wave):.2f} times as fast as the wave behind it, measured "
        "in a weak one. Where the sum first reaches the strength the bar breaks: at "
        f"{one['depth_m']:.2f} m from the end for a pulse of {one['ratio']:g} times the strength, "
        f"the formula says {one['formula_m']:.2f} m. The piece flies off with the momentum that is "
        "trapped in it, and the new end sends back what is left of the pulse."
    )


def shown(rows):
    """Number of the bar that the film shows."""
    return int(np.argmin([abs(row["ratio"] - 1.5) for row in rows]))


def figures_of(wave, rows, speed):
    """Figures for summary.json."""
    cell = LENGTH / wave.shape[1]
    figures = {
        "wave_speed_m_s": figure(float(speed), "m/s"),
        "free_end_over_wave": figure(doubling(wave), "1"),
        "cell_m": figure(cell, "m"),
    }
    for row in rows:
        key, apart = f"spall_{row['ratio']:g}", float(row["depth_m"] - row["formula_m"])
        figures.update(figures_from(row, {"depth_m": "m", "formula_m": "m"}, f"{key}_{{}}"))
        figures[f"{key}_error_cells"] = figure(apart / cell, "1")
    return figures


def write(wave, made, rows, speed, folder):
    """Write the pictures, their tables and the film."""

    def at(name):
        return os.path.join(folder, name)

    stress, places = made.stress(CONCRETE.density * speed**2), gates(wave)
    velocity = wave.velocity[:, 0]
    names = [f"at_{LENGTH * (k + 0.5) / wave.shape[1]:g}_m" for k in places]
    columns = dict(zip([*names, "free_end"], velocity[:, [*places, -1]].T))
    write_csv(at("wave.csv"), {"time_s": wave.time, **columns})
    write_rows(os.path.join(folder, "spall.csv"), rows)
    picture_wave(at("wave.png"), LENGTH, wave.time, velocity, places)
    picture_spall(at("spall.png"), LENGTH, made, stress, rows)
    strength = CONCRETE.tensile_strength
    film_spall(at("spall.gif"), LENGTH, made, stress, shown(rows), strength, FRAMES)
