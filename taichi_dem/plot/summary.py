"""One picture of a run for a notebook: the block, and energy and events over time."""

from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from taichi_dem.kit.display import scale
from taichi_dem.kit.plot_style import BLACK, BLUE, png_of, styled
from taichi_dem.output.record import outward_columns
from taichi_dem.plot.block import draw_breaks
from taichi_dem.plot.view import View, draw_bodies, frame_block

#: From this ratio of its sides on, a block lies above the curves and not beside them.
_LONG = 2.2
#: Elongation along z from which on a block is seen from the side and not along z.
_DEEP = 2.0
_BROKEN = "broken bonds"
#: Energies by what they are: terms of the account that add up to them, and look; the colours are
#: near those of ``series.plot_energy``.
_ENERGIES: dict[str, Any] = {
    # Above the curve that it may lie on.
    "work put in": (("load_work", "support_work"), {"color": BLACK, "ls": "--", "zorder": 3}),
    "kinetic": (("kinetic",), {"color": "#08306B"}),
    "strain": (("bond_strain", "sphere_strain"), {"color": "#3A87C2"}),
    "dissipated": (
        "bond_dashpot softening release slip sphere_dashpot friction ground_dashpot".split(),
        {"color": "#E6700F"},
    ),
}


def picture_of_run(result: Any) -> Any:
    """PNG, in bytes: the block beside energy and broken bonds over time.

    Where no bond broke, the block shows the displacement in the last frame, or the largest speeds
    where there is none that can be drawn; the curve of broken bonds gives way to that of the hole
    or of the largest speed.
    """
    model = result.model
    view = View(viewed_along(model.mesh.points))
    sides = np.ptp(view.project(model.mesh.points), axis=0)
    long = sides[0] > _LONG * sides[1]
    with styled(0, size=(9.2, 5.2 if long else 4.2)) as (figure, _):
        figure.get_layout_engine().set(w_pad=0.08)
        places = [["block", "block"], ["energy", "events"]]
        if not long:
            places = [["block", "energy"], ["block", "events"]]
        panels = figure.subplot_mosaic(places, height_ratios=(1.0, 1.3) if long else (1.0, 1.0))
        drawn, label = _draw_block(panels["block"], view, result)
        figure.colorbar(drawn, ax=panels["block"], label=label, aspect=25)
        _draw_curves(panels, result.series)
        return png_of(figure)


def viewed_along(points: np.ndarray) -> Any:
    """Direction to the viewer: z, or the shortest side where the block is long in z."""
    sides = np.ptp(points, axis=0)
    return np.eye(3)[int(sides.argmin()) if sides[2] > _DEEP * sides.min() else 2]


def _draw_block(axes, view, result):
    """Draw what happened to the block; returns the coloured collection and the scale's label."""
    model, frames, broken_time = result.model, result.frames, result.broken_time
    frame_block(axes, view, model)
    axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
    count = int(np.isfinite(broken_time).sum())
    if count:
        last = np.nanmax(broken_time)
        factor, unit = scale(last, "s")
        axes.set_title(f"{count:,} broken bonds, block undeformed")
        lines = draw_breaks(axes, view, model, broken_time)
        lines.set_array(factor * np.sort(broken_time[np.isfinite(broken_time)])[::-1])
        lines.set_clim(0.0, factor * last or 1.0)
        return lines, f"time of breaking [{unit}]"
    extent = np.ptp(model.mesh.points, axis=0).max()
    moved = np.linalg.norm(frames[-1].displacement, axis=1) if frames else np.full(1, np.nan)
    look = {"cmap": "viridis", "axis": view.toward}
    # What flew off, or fell as a whole, would leave the picture.
    if not moved.max() < extent:
        factor, unit = scale(_largest(result.peak_speed), "m/s")
        look["clim"] = 0.0, factor * _largest(result.peak_speed) or 1.0
        axes.set_title("no broken bonds, block undeformed")
        speeds = factor * np.ma.masked_invalid(result.peak_speed)
        return draw_bodies(axes, model, None, speeds, **look), f"largest speed [{unit}]"
    factor, unit = scale(moved.max(), "m")
    look["clim"] = 0.0, factor * moved.max() or 1.0
    drawn = draw_bodies(axes, model, frames[-1], factor * moved, **look)
    axes.autoscale()
    time, time_unit = scale(frames[-1].time_s, "s")
    axes.set_title(f"t = {time * frames[-1].time_s:.3g} {time_unit}")
    return drawn, f"displacement [{unit}]"


def _draw_curves(panels, history):
    """Energies, and what happened, over time."""
    time_s = history.get("time_s", np.zeros(0))
    factor, unit = scale(_largest(time_s), "s")
    none = np.full(len(time_s), np.nan)
    # A term that no effect of the scene has is no column.
    known = (
        [history[f"{term}_J"] for term in terms if f"{term}_J" in history]
        for terms, _ in _ENERGIES.values()
    )
    sums = [sum(columns) if columns else none for columns in known]
    per_joule, joule = scale(max(map(_largest, sums)), "J")
    for (name, (_, look)), values in zip(_ENERGIES.items(), sums):
        _line(panels["energy"], factor * time_s, per_joule * values, label=name, **look)
    panels["energy"].set(ylabel=f"energy [{joule}]")
    panels["energy"].legend()
    values, label = _events(history)
    style = "steps-post" if label == _BROKEN else "default"
    _line(panels["events"], factor * time_s, values, color=BLUE, drawstyle=style)
    panels["events"].set(ylabel=label)
    if label == _BROKEN:
        panels["events"].yaxis.set_major_locator(MaxNLocator(integer=True))
    for name in ("energy", "events"):
        panels[name].set(xlabel=f"time [{unit}]")
        panels[name].locator_params(axis="x", nbins=6)


def _line(axes, x, y, **look):
    """A curve, or a point where there is but one sample."""
    axes.plot(x, y, marker="o" if len(x) == 1 else None, **look)


def _events(history):
    """What is drawn below the energy: values and label of the first column that says something."""
    nothing = np.full(len(history.get("time_s", ())), np.nan)
    if _largest(history.get("broken_faces", nothing)) > 0.0:
        return history["broken_faces"], _BROKEN
    values, unit = history.get("largest_speed_m_s", nothing), "m/s"
    words = "largest speed"
    for hole, moved in list(outward_columns(history).items())[:1]:
        values, unit, words = 1e-3 * moved, "m", f"{hole}, mean outward\ndisplacement"
    factor, unit = scale(_largest(values), unit)
    return factor * values, f"{words} [{unit}]"


def _largest(values):
    """Largest finite size of values, 0 where there is none."""
    values = np.abs(np.asarray(values, dtype=float))
    return float(values[np.isfinite(values)].max(initial=0.0))
