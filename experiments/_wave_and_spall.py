"""Bars of ``demo_wave_and_spall.py`` over time: their tables, pictures and words."""

import numpy as np

from _bars import Profile, draw_breaks, draw_space_time, film_bar, travel_time
from taichi_dem import CONCRETE, Every
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, RED, picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import write_rows
from taichi_dem.simulate import run_simulation

#: Length of a bar [m], its bodies a cell; time step [s], steps between looks.
LENGTH, CELL, STEP, LOOK = 4.0, 6, 1e-6, 20
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

    def __init__(self, bars, cells):
        slices = np.arange(CELL * bars * cells).reshape(bars, cells, CELL)
        super().__init__(Every(steps=LOOK), slices)
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

    def spalled(self, k, ratio, speed, formula):
        """Row of a bar: the stress that arrived, depth of the first break, the formula's."""
        joints, velocity = self.joints[:, k], self.velocity[:, k, -1]
        row = int(joints.any(axis=1).argmax())
        first = np.flatnonzero(joints[row])
        arrived = 0.5 * CONCRETE.density * speed * velocity[: row + 1].max()
        return {
            "ratio": ratio,
            "arrived_MPa": 1e-6 * arrived,
            "time_ms": 1e3 * self.time[row],
            "depth_m": LENGTH - self.cell * (first.mean() + 1.0) if len(first) else np.nan,
            "formula_m": formula(arrived),
            "spall_speed_m_s": velocity[-1],
            "joints_broken": int(joints[-1].sum()),
        }


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


def figures_of(wave, rows):
    """Figures for summary.json."""
    figures = {"wave_speed_m_s": (float(wave.speed), "m/s")}
    figures.update(free_end_over_wave=(wave.doubling, "1"), cell_m=(wave.cell, "m"))
    for row in rows:
        depth, formula, key = row["depth_m"], row["formula_m"], f"spall_{row['ratio']:g}"
        figures[f"{key}_depth_m"], figures[f"{key}_formula_m"] = (depth, "m"), (formula, "m")
        figures[f"{key}_error_cells"] = float(depth - formula) / wave.cell, "1"
    return figures


def write(wave, made, rows, at):
    """Write the tables, pictures and the film; returns the bar in the film."""
    write_rows(at("spall.csv"), rows)
    show_wave(wave, at)
    stress = made.stress(CONCRETE.density * wave.speed**2, made.cell)
    picture_spall(at("spall.png"), made, 1e-6 * stress, rows)
    shown = int(np.argmin([abs(row["ratio"] - 1.5) for row in rows]))
    film_bar(at("spall.gif"), made, stress, shown, LENGTH, CONCRETE.tensile_strength)
    return shown


def show_wave(wave, at):
    """Write how a push runs along a bar, and what three places see of it."""
    velocity, cells = wave.velocity[:, 0], [*wave.gates, -1]
    names = [*(f"at_{wave.place[k]:g}_m" for k in wave.gates), "free_end"]
    write_csv(at("wave.csv"), {"time_s": wave.time, **dict(zip(names, velocity[:, cells].T))})
    words = [*(f"at {wave.place[k]:.2f} m" for k in wave.gates), "free end"]
    picture_wave(at("wave.png"), wave, dict(zip(words, cells)))


def picture_wave(path, wave, cells):
    """Velocity over place and time, and over time in some cells, name -> number."""
    velocity, label = 1e3 * wave.velocity[:, 0], "velocity [mm/s]"
    with picture(path, 1, 2, size=(9.0, 3.8)) as (figure, (along, over)):
        drawn = draw_space_time(along, wave.place, wave.time, velocity, np.abs(velocity).max())
        figure.colorbar(drawn, ax=along, label=label)
        looks = zip((BLUE, GREEN, RED), ("-", "--", "-."))
        for (name, cell), (colour, dashes) in zip(cells.items(), looks):
            look = {"color": colour, "ls": dashes, "label": name}
            over.plot(1e3 * wave.time, velocity[:, cell], **look)
            along.axvline(wave.place[cell], lw=1.2, **look)
        along.set_title("it runs, comes back, runs again")
        along.legend(loc="lower left", bbox_to_anchor=(0.0, 1.08), ncols=4, columnspacing=1.0)
        top = 2.0 * velocity[:, wave.gates[1]].max()
        over.axhline(top, color=GREY, ls=":", label="twice the wave's peak")
        over.set(xlabel="time [ms]", ylabel=label, title="the free end doubles it")
        over.legend(loc="upper left")


def picture_spall(path, made, stress, rows):
    """Stress [MPa] over place and time in the first bars, and depths beside the formula's."""
    count, joint = min(2, len(rows)), made.place[:-1] + 0.5 * made.cell
    top = np.abs(stress[:, :count]).max()
    with picture(path, 1, 1 + count, size=(3.05 * (1 + count), 3.6)) as (figure, (*panels, last)):
        for k, (row, axes) in enumerate(zip(rows, panels)):
            drawn = draw_space_time(axes, joint, made.time, stress[:, k], top)
            draw_breaks(axes, joint, made.time, made.joints[:, k])
            look = {"color": BLACK, "ls": ":", "lw": 1.0, "label": "first break by the formula"}
            axes.axvline(LENGTH - row["formula_m"], **look)
            axes.set_title(f"pulse of {row['ratio']:g} × strength")
        figure.colorbar(drawn, ax=axes, label="stress, tension positive [MPa]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2)
        arrived, depth = ([row[key] for row in rows] for key in ("arrived_MPa", "depth_m"))
        line = np.linspace(0.8 * min(arrived), 1.1 * max(arrived), 100)
        formula = rows[0]["formula_m"] * rows[0]["arrived_MPa"] / line
        last.plot(line, formula, color=GREY, label="pulse length × strength / (2 s$_0$)")
        look = {"fmt": "o", "color": RED, "ms": 5, "label": "broke, ± one cell"}
        last.errorbar(arrived, depth, yerr=made.cell, **look)
        last.set(xlabel="pulse s$_0$ that arrived [MPa]", ylabel="depth of the first break [m]")
        last.set(ylim=(0.0, None), title="the stronger, the thinner")
        last.legend(loc="lower right", bbox_to_anchor=(1.0, 1.08))
