"""Waves in bars: velocity and stress along them, over time, and where they broke.

``made``: time (rows,) [s], displacement [m] and velocity [m/s] (rows, bars, cells), joints (rows,
bars, cells - 1) that are broken. Stress (rows, bars, cells - 1) [Pa] is positive in tension.
"""

import matplotlib
import numpy as np

from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, RED, picture
from taichi_dem.plot.film import moving_picture

#: Stress: pressed, at rest, pulled.
_COLOURS = "RdBu_r"
#: Of the displacement of the drawn bar.
_MAGNIFY = 150.0


def picture_wave(path, length, time, velocity, gates):
    """A push runs along a bar: velocity over place and time, and what three places see of it.

    velocity: (rows, cells) [m/s]. gates: two cells; the third place is the free end.
    """
    cells = velocity.shape[1]
    place = (np.arange(cells) + 0.5) * length / cells
    with picture(path, 1, 2, size=(10.0, 3.8)) as (figure, (along, over)):
        top = 1e3 * np.abs(velocity).max()
        look = {"cmap": _COLOURS, "vmin": -top, "vmax": top, "shading": "auto", "rasterized": True}
        drawn = along.pcolormesh(place, 1e3 * time, 1e3 * velocity, **look)
        along.set(xlabel="place [m]", ylabel="time [ms]", title="it runs, comes back, runs again")
        figure.colorbar(drawn, ax=along, label="velocity [mm/s]")
        for cell, colour in zip((*gates, cells - 1), (BLUE, GREEN, RED)):
            name = f"at {place[cell]:.2f} m" if cell < cells - 1 else "free end"
            over.plot(1e3 * time, 1e3 * velocity[:, cell], color=colour, label=name)
            along.axvline(place[cell], color=colour, linewidth=0.8, linestyle="--", label=name)
        along.legend(loc="upper left", title="seen on the right", frameon=True, framealpha=0.9)
        second = 1e3 * velocity[:, gates[1]].max()
        over.axhline(2.0 * second, color=GREY, linestyle=":", label="twice the wave's peak")
        over.set(xlabel="time [ms]", ylabel="velocity [mm/s]", title="the free end doubles it")
        over.legend(loc="upper left")


def picture_spall(path, length, made, stress, rows):
    """Stress over place and time in the first bars, and depths beside the formula's.

    rows: dicts of a bar's ratio, arrived_MPa, time_ms, depth_m and formula_m.
    """
    picked = range(min(2, len(rows)))
    with picture(path, 1, 1 + len(picked), size=(4.2 * (1 + len(picked)), 3.8)) as (figure, panels):
        top = 1e-6 * np.abs(stress[:, picked]).max()
        look = {"cmap": _COLOURS, "vmin": -top, "vmax": top, "shading": "auto", "rasterized": True}
        joint = np.arange(1, stress.shape[2] + 1) * length / (stress.shape[2] + 1)
        for k in picked:
            row, axes = rows[k], panels[k]
            drawn = axes.pcolormesh(joint, 1e3 * made.time, 1e-6 * stress[:, k], **look)
            when, where = np.nonzero(np.diff(made.joints[:, k].astype(int), axis=0, prepend=0) > 0)
            axes.plot(joint[where], 1e3 * made.time[when], "x", color=BLACK, ms=6, label="breaks")
            words = "first break by the formula"
            axes.axvline(length - row["formula_m"], color=BLACK, ls=":", lw=1.0, label=words)
            title = f"pulse of {row['ratio']:g} × strength"
            axes.set(xlabel="place [m]", ylabel="time [ms]", title=title)
            axes.legend(loc="lower left")
        figure.colorbar(drawn, ax=panels[len(picked) - 1], label="stress, tension positive [MPa]")
        _depths(panels[-1], length / (stress.shape[2] + 1), rows)


def _depths(axes, cell, rows):
    """Depth of the first break over the strength of the pulse that arrived."""
    share = np.array([row["arrived_MPa"] for row in rows])
    product = rows[0]["formula_m"] * rows[0]["arrived_MPa"]
    line = np.linspace(0.8 * share.min(), 1.1 * share.max(), 100)
    axes.plot(line, product / line, color=GREY, label="pulse length × strength / (2 s$_0$)")
    depth = [row["depth_m"] for row in rows]
    axes.errorbar(share, depth, yerr=cell, fmt="o", color=RED, ms=5, label="broke, ± one cell")
    axes.set(xlabel="pulse s$_0$ that arrived [MPa]", ylabel="depth of the first break [m]")
    axes.set(ylim=(0.0, None), title="the stronger, the thinner")
    axes.legend(loc="upper right")


def film_spall(path, length, made, stress, shown, strength, count):
    """Velocity, stress and the bar itself, broken joints marked. count: of frames.

    shown: number of the bar. strength: [Pa].
    """
    cells = made.velocity.shape[2]
    centre = (np.arange(cells) + 0.5) * length / cells
    joint = np.arange(1, cells) * length / cells
    speed, pull = made.velocity[:, shown], 1e-6 * stress[:, shown]
    with moving_picture(path, (4.0, 3.8), 110) as (figure, shoot):
        fast, tight, bar = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.0, 0.55))
        (moving,) = fast.plot([], [], color=GREEN)
        fast.set(ylabel="velocity [m/s]", ylim=_around(speed))
        (loaded,) = tight.plot([], [], color=BLACK)
        tight.set(ylabel="stress [MPa]", ylim=_around(pull))
        tight.axhline(1e-6 * strength, color=RED, linestyle="--", label="strength")
        tight.legend(loc="lower left")
        (breaks,) = tight.plot([], [], "x", color=ORANGE, ms=6, mew=1.6)
        drawn = _Bar(bar, length, cells, np.abs(pull).max())
        for row in np.linspace(0, len(made.time) - 1, count).round().astype(int):
            broken = made.joints[row, shown]
            moving.set_data(centre, speed[row])
            loaded.set_data(joint, pull[row])
            breaks.set_data(joint[broken], np.zeros(broken.sum()))
            drawn.show(made.displacement[row, shown], pull[row], broken)
            fast.set_title(f"t = {1e3 * made.time[row]:.2f} ms, × and | mark broken faces")
            shoot()


def _around(values):
    low, high = float(values.min()), float(values.max())
    room = 0.08 * (high - low)
    return low - room, high + room


class _Bar:
    """The bar as boxes, coloured by stress, displacement magnified."""

    def __init__(self, axes, length, cells, top):
        self.cell, self.top = length / cells, top
        self.left = np.arange(cells) * self.cell
        self.boxes = axes.bar(self.left, 1.0, self.cell, align="edge", linewidth=0.0)
        axes.set(xlim=(-0.05 * length, 1.16 * length), ylim=(-0.3, 1.3), yticks=[])
        axes.set(xlabel=f"place [m]; displacement × {_MAGNIFY:g}, red: tension, blue: pressure")
        axes.spines["left"].set_visible(False)
        axes.grid(False)
        (self.gaps,) = axes.plot([], [], "|", color=ORANGE, ms=22, mew=1.8)
        self.colours = matplotlib.colormaps[_COLOURS]

    def show(self, displacement, pull, broken):
        """Displacement (cells,) [m]; stress [MPa] and broken (cells - 1,)."""
        own = 0.5 * (np.append(pull, 0.0) + np.append(0.0, pull))
        place = self.left + _MAGNIFY * (displacement - displacement[0])
        for box, x, shade in zip(self.boxes, place, self.colours(0.5 + 0.5 * own / self.top)):
            box.set_x(x)
            box.set_facecolor(shade)
        gap = 0.5 * (place[:-1] + self.cell + place[1:])
        self.gaps.set_data(gap[broken], np.full(broken.sum(), 0.5))
