"""Bars of ``demo_wave_and_spall.py`` over time: their pictures, tables and words."""

import numpy as np

from taichi_dem import CONCRETE
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, RED, picture
from taichi_dem.kit.study import write_rows
from taichi_dem.output.profile import Profile, travel_time
from taichi_dem.plot.bars import draw_space_time, film_bar

#: Length of a bar [m]; bodies a cell.
LENGTH, CELL = 4.0, 6
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


class Bars(Profile):
    """Bars over time, in cells as slices: arrays (looks, bars, cells)."""

    def __init__(self, when, bars, cells):
        super().__init__(when, np.arange(CELL * bars * cells).reshape(bars, cells, CELL))
        self.cell = LENGTH / cells
        self.place = self.cell * (np.arange(cells) + 0.5)
        self.gates = [round(share * cells) for share in GATES]

    def speed(self, step):
        """Speed [m/s] at which a push passes the gates."""
        first, second = (self.velocity[:, 0, k] for k in self.gates)
        way = (self.gates[1] - self.gates[0]) * self.cell
        return way / travel_time(self.time, first, second, step)

    def spalled(self, ratios, speed, tail):
        """A row for every bar: the stress that arrived, depth of the first break, the formula's."""
        return [self._spalled(k, ratio, speed, tail) for k, ratio in enumerate(ratios)]

    def _spalled(self, k, ratio, speed, tail):
        joints, velocity = self.joints[:, k], self.velocity[:, k, -1]
        row = int(joints.any(axis=1).argmax())
        first = np.flatnonzero(joints[row])
        arrived = 0.5 * CONCRETE.density * speed * velocity[: row + 1].max()
        return {
            "ratio": ratio,
            "arrived_MPa": 1e-6 * arrived,
            "time_ms": 1e3 * self.time[row],
            "depth_m": LENGTH - self.cell * (first.mean() + 1.0) if len(first) else np.nan,
            "formula_m": tail * CONCRETE.tensile_strength / (2.0 * arrived),
            "spall_speed_m_s": velocity[-1],
            "joints_broken": int(joints[-1].sum()),
        }

    @property
    def doubling(self):
        """Peak velocity of the free end's last cell over that of the wave at the second gate."""
        velocity = self.velocity[:, 0]
        return float(velocity[:, -1].max() / velocity[:, self.gates[1]].max())


def caption(rows, wave):
    """Words on what to see; rows: of the table."""
    one = rows[shown(rows)]
    return (
        "A compressive pulse (blue) reaches the free end on the right and comes back as tension "
        f"(red); that end moves {wave.doubling:.2f} times as fast as the wave behind it, measured "
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
    figures = {
        "wave_speed_m_s": (float(speed), "m/s"),
        "free_end_over_wave": (wave.doubling, "1"),
        "cell_m": (wave.cell, "m"),
    }
    for row in rows:
        key, apart = f"spall_{row['ratio']:g}", float(row["depth_m"] - row["formula_m"])
        figures.update({f"{key}_{name}": (row[name], "m") for name in ("depth_m", "formula_m")})
        figures[f"{key}_error_cells"] = (apart / wave.cell, "1")
    return figures


def write(wave, made, rows, speed, at):
    """Write the pictures, their tables and the film."""
    names = [f"at_{wave.place[k]:g}_m" for k in wave.gates]
    columns = dict(zip([*names, "free_end"], wave.velocity[:, 0, [*wave.gates, -1]].T))
    write_csv(at("wave.csv"), {"time_s": wave.time, **columns})
    write_rows(at("spall.csv"), rows)
    picture_wave(at("wave.png"), wave)
    stress = made.stress(CONCRETE.density * speed**2, made.cell)
    picture_spall(at("spall.png"), made, 1e-6 * stress, rows)
    look = {"length": LENGTH, "strength_pa": CONCRETE.tensile_strength}
    film_bar(at("spall.gif"), made, stress, bar=shown(rows), **look)


def picture_wave(path, wave):
    """A push runs along a bar: velocity over place and time, and what three places see of it."""
    velocity, time = 1e3 * wave.velocity[:, 0], 1e3 * wave.time
    with picture(path, 1, 2, size=(10.0, 3.8)) as (_, (along, over)):
        draw_space_time(along, wave.place, wave.time, velocity, "velocity [mm/s]")
        for cell, colour in zip((*wave.gates, -1), (BLUE, GREEN, RED)):
            name = f"at {wave.place[cell]:.2f} m" if cell >= 0 else "free end"
            over.plot(time, velocity[:, cell], color=colour, label=name)
            along.axvline(wave.place[cell], color=colour, lw=0.8, ls="--", label=name)
        along.set(title="it runs, comes back, runs again")
        along.legend(loc="upper left", title="seen on the right", frameon=True, framealpha=0.9)
        twice = 2.0 * velocity[:, wave.gates[1]].max()
        over.axhline(twice, color=GREY, ls=":", label="twice the wave's peak")
        over.set(xlabel="time [ms]", ylabel="velocity [mm/s]", title="the free end doubles it")
        over.legend(loc="upper left")


def picture_spall(path, made, stress, rows):
    """Stress [MPa] over place and time in the first bars, and depths beside the formula's."""
    count, joint = min(2, len(rows)), made.place[:-1] + 0.5 * made.cell
    top = np.abs(stress[:, :count]).max()
    with picture(path, 1, 1 + count, size=(4.2 * (1 + count), 3.8)) as (figure, panels):
        for k, (row, axes) in enumerate(zip(rows[:count], panels)):
            drawn = draw_space_time(axes, joint, made.time, stress[:, k], top=top)
            when, where = np.nonzero(np.diff(made.joints[:, k].astype(int), axis=0, prepend=0) > 0)
            axes.plot(joint[where], 1e3 * made.time[when], "x", color=BLACK, ms=6, label="breaks")
            look = {"color": BLACK, "ls": ":", "lw": 1.0, "label": "first break by the formula"}
            axes.axvline(LENGTH - row["formula_m"], **look)
            axes.set_title(f"pulse of {row['ratio']:g} × strength")
            axes.legend(loc="lower left")
        figure.colorbar(drawn, ax=axes, label="stress, tension positive [MPa]")
        arrived, depth = ([row[key] for row in rows] for key in ("arrived_MPa", "depth_m"))
        line = np.linspace(0.8 * min(arrived), 1.1 * max(arrived), 100)
        formula = rows[0]["formula_m"] * rows[0]["arrived_MPa"] / line
        axes = panels[-1]
        axes.plot(line, formula, color=GREY, label="pulse length × strength / (2 s$_0$)")
        look = {"fmt": "o", "color": RED, "ms": 5, "label": "broke, ± one cell"}
        axes.errorbar(arrived, depth, yerr=made.cell, **look)
        axes.set(xlabel="pulse s$_0$ that arrived [MPa]", ylabel="depth of the first break [m]")
        axes.set(ylim=(0.0, None), title="the stronger, the thinner")
        axes.legend(loc="upper right")
