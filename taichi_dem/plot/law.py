"""The law of a bond as lines, and what was measured of it as points (Konno et al., Fig. 2 to 4)."""

import numpy as np

from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, picture
from taichi_dem.plot.film import moving_picture

_COLOURS = (RED, BLUE, GREEN, ORANGE, PURPLE)
#: How much larger than true the film shows openings and slidings.
_MAGNIFY = (600.0, 60.0)
_MARKS = 90


def picture_law(path, lines, curves, pressures):
    """Tension left, shear right.

    lines: of the law, (n, 2) opening or sliding [m] and traction [Pa]; curves: measured, pairs of
    arrays; both begin with tension and go on with shear under each of the pressures [Pa].
    """
    with picture(path, 1, 2, size=(9.6, 4.0)) as (_, panels):
        _draw_law(panels, lines)
        panels[0].lines[0].set_label("law")
        for k, (way, traction) in enumerate(curves):
            some = _evenly(way, traction)
            label = f"measured at {1e-6 * pressures[k - 1]:g} MPa" if k else "measured"
            axes = panels[min(k, 1)]
            look = {"marker": "o", "ms": 3.4, "ls": "none", "color": _COLOURS[k]}
            axes.plot(1e6 * way[some], 1e-6 * traction[some], label=label, **look)
        panels[0].legend(loc="upper right")
        panels[1].lines[0].set_label("law")
        panels[1].legend(loc="upper left")
        panels[0].set_title("pulled, unloaded, pressed, pulled until it breaks")
        panels[1].set_title("slid, back and on, under four pressures")


def film_law(path, lines, curves, pressures, points, count):
    """The bench at work: two specimens above, their tractions below. count: of frames.

    points: (5, 3) [m] of one specimen, the shared face first; the rest as ``picture_law``.
    """
    with moving_picture(path, (4.0, 3.6), 120) as (figure, shoot):
        panels = figure.subplots(2, 2, height_ratios=(1.0, 1.9))
        _draw_law(panels[1], lines)
        panels[1, 0].set_title("tension")
        panels[1, 1].set_title("shear under pressure")
        marks = [_mark(panels[1, min(k, 1)], _COLOURS[k]) for k in range(len(curves))]
        panels[1, 0].lines[0].set_label("law")
        marks[0][0].set_label("measured")
        panels[1, 0].legend(loc="upper right")
        last = len(curves) - 1
        opened, shifted = (f"× {factor:g}" for factor in _MAGNIFY)
        pulled = _Specimen(panels[0, 0], points, f"opening {opened}", _COLOURS[0])
        slid = _Specimen(panels[0, 1], points, f"sliding {shifted}", _COLOURS[last])
        for row in np.linspace(0, len(curves[0][0]) - 1, count).round().astype(int):
            for (trail, head), (way, traction) in zip(marks, curves):
                some = _evenly(way[: row + 1], traction[: row + 1])
                trail.set_data(1e6 * way[some], 1e-6 * traction[some])
                head.set_data([1e6 * way[row]], [1e-6 * traction[row]])
            pulled.show((curves[0][0][row], 0.0), curves[0][1][row])
            slid.show((0.0, curves[last][0][row]), curves[last][1][row])
            shoot()


def _draw_law(panels, lines):
    for k, line in enumerate(lines):
        panels[min(k, 1)].plot(1e6 * line[:, 0], 1e-6 * line[:, 1], color=GREY, linewidth=1.0)
    panels[0].set(xlabel="opening [µm]", ylabel="traction [MPa]", ylim=(-3.0, 8.0))
    panels[1].set(xlabel="sliding [µm]", ylabel="shear traction [MPa]", ylim=(0.0, 18.0))
    panels[0].axhline(0.0, color=BLACK, linewidth=0.5)


def _mark(axes, colour):
    (trail,) = axes.plot([], [], ls="none", marker="o", ms=1.8, color=colour)
    (head,) = axes.plot([], [], ls="none", marker="o", ms=5.5, color=colour, mec=BLACK, mew=0.7)
    return trail, head


def _evenly(way, traction):
    """Rows at about equal distances along a measured curve, so that points do not run together."""
    steps = np.hypot(np.diff(way) / 30e-6, np.diff(traction) / 15e6)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], _MARKS)))


class _Specimen:
    """Two tetrahedra seen from the side; the right one moves, magnified."""

    def __init__(self, axes, points, title, colour):
        face, left, right = points[:3, :2], points[3, :2], points[4, :2]
        self.right = 1e3 * np.vstack([face[face[:, 1].argsort()[[0, -1]]], right])
        fixed = 1e3 * np.vstack([face[face[:, 1].argsort()[[0, -1]]], left])
        axes.fill(*fixed.T, color="#D8D3C6", ec=BLACK, lw=0.7)
        (self.body,) = axes.fill(*self.right.T, color=colour, ec=BLACK, lw=0.7, alpha=0.85)
        span = 1e3 * np.abs(points[:, 0]).max()
        axes.set(xlim=(-1.1 * span, 1.75 * span), ylim=(-20.0, 50.0))
        axes.set_aspect("equal")
        axes.set_axis_off()
        self.axes, self.title = axes, title

    def show(self, moved, traction):
        """Move by an opening and a sliding [m]; traction [Pa] for the title."""
        self.body.set_xy(self.right + 1e3 * np.multiply(moved, _MAGNIFY))
        # Rounded first, and zero added: no minus before a zero.
        shown = round(1e-6 * float(traction), 2) + 0.0
        self.axes.set_title(f"{self.title}: {shown:.2f} MPa", loc="center")
