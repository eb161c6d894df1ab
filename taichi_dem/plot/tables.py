"""Pictures of a result: columns, fragments, directions of cracks, attenuation, the block."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from taichi_dem.kit.data_table import arrays_of, unit_of, without_unit
from taichi_dem.kit.display import scale
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, SPARE_COLOURS, area_key, picture
from taichi_dem.kit.validation import FileName, choice, positive, unit_vector
from taichi_dem.output.fracture import COLOURS, body_values, passing_mass, scale_end
from taichi_dem.plot.view import ALONG_Z, JOINT, View, draw_bodies, frame_block

#: Fragments of a colour of their own; lighter ones are grey.
_NAMED = 6
#: What columns of a unit are called together.
_KINDS = {"J": "energy", "m/s": "speed", "m": "length", "mm": "displacement", "s": "time"}
_SCALED = ("s", "m", "J", "m/s", "N", "Pa")
_AT_HOLE = ("monitor_displacement_mm", "hole_radial_displacement_mm")


def plot_history(
    result: Any, names: Sequence[str] | None = None, *, path: FileName | None = None
) -> Figure:
    """Draw columns of the history over time."""
    history = result.series
    if names is None:
        moved = [name for name in _AT_HOLE if name in history] or ["largest_speed_m_s"]
        names = [*moved, "broken_faces", "smallest_step_s"]
    return plot_columns(path, history, names)


def plot_columns(
    path: FileName | None, table: Mapping[str, np.ndarray], names: Sequence[str]
) -> Figure:
    """Draw columns of a table over its time_s; those of one unit share a panel."""
    known = [name for name in table if name != "time_s"]
    names = [choice("names", name, known) for name in names]
    units = list(dict.fromkeys(map(unit_of, names)))
    factor, unit = scale(float(np.abs(table["time_s"]).max(initial=0.0)), "s")
    shape = {"size": (6.4, 1.0 + 2.2 * len(units)), "sharex": True, "squeeze": False}
    with picture(path, max(1, len(units)), 1, **shape) as (figure, panels):
        for axes, panel_unit in zip(panels[:, 0], units):
            group = [name for name in names if unit_of(name) == panel_unit]
            _draw(axes, factor * table["time_s"], table, group, panel_unit)
        panels[-1, 0].set(xlabel=f"time [{unit}]")
    return figure


def _draw(axes, time, table, names, unit):
    largest = max(float(np.abs(table[name]).max(initial=0.0)) for name in names)
    # Numbers take no prefix, and what has one in its name keeps it.
    factor, words = scale(largest, unit) if unit in _SCALED else (1.0, unit)
    words = words.replace("^2", "²").replace("^3", "³")
    for k, name in enumerate(names):
        colour, line = SPARE_COLOURS[k % len(SPARE_COLOURS)], ("-", "--")[k % 2]
        label = without_unit(name).replace("_", " ")
        steps = "steps-post" if unit == "1" else "default"
        axes.plot(time, factor * table[name], line, color=colour, label=label, drawstyle=steps)
    if len(names) == 1:
        axes.set(ylabel=f"{label} [{words}]")
    else:
        axes.set(ylabel=f"{_KINDS.get(unit, 'value')} [{words}]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def plot_fragments(result: Any, frame: int = -1, *, path: FileName | None = None) -> Figure:
    """Draw the share of the mass that passes a sieve over its opening, in a frame."""
    # Shaded: sizes of single bodies, where the mesh decides and not the material.
    fragments = arrays_of(result.fragments(frame))
    sizes, shares = passing_mass(fragments)
    size, passing = 1e3 * sizes, 100.0 * shares
    alone = 1e3 * fragments["sieve_m"][fragments["bodies"] == 1]
    with picture(path, size=(6.0, 4.0)) as (figure, axes):
        low, high = 0.7 * size[0], 1.4 * size[-1]
        across = np.concatenate([[low], size, [high]])
        axes.step(across, [passing[0], *passing, 100.0], where="post", color=BLUE)
        if len(alone):
            axes.axvspan(low, alone.max(), color=GREY, alpha=0.2, label="sizes of single bodies")
            axes.legend(loc="upper left")
        count = f"{len(size):,} fragment{'s' * (len(size) != 1)}"
        axes.set(xscale="log", xlim=(low, high), yscale="log", ylim=(0.7 * passing[0], 130.0))
        axes.set(xlabel="opening of the sieve [mm]", ylabel="share of the mass that passes [%]")
        axes.set_title(f"{count} at {1e3 * result.frame(frame).time_s:.3g} ms")
    return figure


def plot_rose(
    result: Any, axis: Sequence[float] = ALONG_Z, *, sectors: int = 36, path: FileName | None = None
) -> Figure:
    """Draw crack area by direction in a plane; arguments as of ``Result.rose``."""
    # A crack direction has no sense: both ends are shown.
    table = result.rose(axis, sectors)
    rose, parallel_m2 = arrays_of(table), table.attrs["parallel_m2"]
    angle, width = np.radians(rose["angle_deg"]), np.radians(table.attrs["width_deg"])
    view = View(table.attrs["axis"])
    with picture(path, size=(5.0, 4.6), subplot_kw={"projection": "polar"}) as (figure, axes):
        total = rose["area_m2"].sum() + parallel_m2
        factor, unit = (1.0, "m²") if total > 0.1 else (1e4, "cm²")
        look = {"width": width, "color": BLUE, "edgecolor": "white", "linewidth": 0.5}
        for turn in (0.0, np.pi):
            axes.bar(angle + turn, factor * rose["area_m2"], **look)
        right, up = (label.replace(" [m]", "") for label in view.labels())
        if len(right) == len(up) == 1:
            axes.set_xticks(np.radians(np.arange(0, 360, 45)))
            axes.set_xticklabels([right, "45°", up, "135°", f"-{right}", "225°", f"-{up}", "315°"])
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_rlabel_position(_emptiest(rose))
        axes.tick_params(axis="y", labelsize=7.5)
        # The petals would hide the scale.
        axes.set_axisbelow(False)
        for label in axes.get_yticklabels():
            label.set_bbox({"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 0.5})
        words = f"Area of cracks by direction [{unit}], {factor * total:.4g} {unit} in all"
        axes.set_title(words, loc="center")
    return figure


def _emptiest(rose):
    """Direction around which there is the least crack area [degree]."""
    area = np.fft.rfft(rose["area_m2"])
    # Of the area over direction, its three slowest waves.
    smooth = np.fft.irfft(np.where(np.arange(len(area)) < 4, area, 0.0), len(rose["area_m2"]))
    return float(rose["angle_deg"][smooth.argmin()])


def plot_attenuation(
    result: Any, group: str | None = None, *, nearest: float = 4.0, path: FileName | None = None
) -> Figure:
    """Draw peak velocities over the distance from a hole, with a power law."""
    # In a thin plate too few bodies are nearer to the hole than to a side: then all are fitted.
    attenuation, nearest = result.attenuation(group), positive("nearest", nearest)
    distance, speed, inner = attenuation.distance, attenuation.speed, attenuation.inner
    slope, level = attenuation.power_law(nearest)
    fitted, words = inner, "fitted"
    if np.isnan(slope):
        slope, level = attenuation.power_law(nearest, inner_only=False)
        fitted, words = distance > 0.0, "fitted to all bodies"
    with picture(path, size=(6.6, 4.6)) as (figure, axes):
        for chosen, colour, side in ((~inner, GREY, "a free side"), (inner, BLUE, "the hole")):
            look = {"s": 4, "alpha": 0.4, "linewidths": 0, "color": colour}
            axes.scatter(distance[chosen], speed[chosen], label=f"bodies nearer to {side}", **look)
        if np.isfinite(slope):
            ends = np.array([nearest, distance[fitted].max()])
            fit, wave = level * ends**slope, (ends / ends[0]) ** -0.5
            label = f"power {slope:.2f} ({words})".replace("-", "−")
            axes.plot(ends, fit, color=BLACK, label=label)
            axes.plot(ends, fit[0] * wave, ":", color=BLACK, label="power −0.5 (cylindrical wave)")
        moving = speed[speed > 0.0]
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="distance from the axis / radius of the hole [1]",
            ylabel="peak particle velocity [m/s]",
            ylim=(0.5 * np.percentile(moving, 0.1), 2.0 * moving.max()),
        )
        for handle in axes.legend(loc="upper right", markerscale=4).legend_handles:
            handle.set_alpha(1.0)
    return figure


def plot_block(
    result: Any,
    frame: int = -1,
    *,
    colour: str = "speed",
    magnify: float = 1.0,
    axis: Sequence[float] = ALONG_Z,
    path: FileName | None = None,
) -> Figure:
    """Draw the bodies in a frame where they are, coloured by a value."""
    magnify, axis = positive("magnify", magnify), unit_vector("axis", axis).tolist()
    shown, view, model = result.frame(frame), View(axis), result.model
    values, broken = body_values(result, shown, colour), result.broken_time <= shown.time_s
    options: dict[str, Any] = {"magnify": magnify, "axis": axis, "broken": broken}
    with picture(path, size=(6.2, 4.8)) as (figure, axes):
        if colour == "fragment":
            look: dict[str, Any] = {"cmap": ListedColormap([*SPARE_COLOURS[:_NAMED], JOINT])}
            look["clim"] = (0, _NAMED)
            draw_bodies(axes, model, shown, np.minimum(values, _NAMED), **options, **look)
            _name_fragments(figure, model.body_mass, values)
        else:
            unit, words = COLOURS[colour]
            # A few that fly away would leave one colour for all others.
            top = float(values.max()) if unit == "1" else scale_end(values)
            factor, unit = scale(top, unit) if unit != "1" else (1.0, unit)
            look = {"cmap": "viridis", "clim": (0.0, factor * top or 1.0)}
            drawn = draw_bodies(axes, model, shown, factor * values, **options, **look)
            beyond = "max" if values.max() > top else "neither"
            label = f"{words} [{unit}]"
            figure.colorbar(drawn, ax=axes, label=label, aspect=25, extend=beyond)
        frame_block(axes, view, model, 0.1)
        axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
        note = "" if magnify == 1.0 else f", displacement × {magnify:g}"
        axes.set_title(f"t = {1e3 * shown.time_s:.3g} ms{note}")
    return figure


def _name_fragments(figure, mass, fragment):
    """Legend of the heaviest fragments with their shares of the mass."""
    share = 100.0 * np.bincount(fragment, mass) / mass.sum()
    keys = [
        area_key(f"{share[k]:.3g} % of the mass", fc=SPARE_COLOURS[k])
        for k in range(min(_NAMED, len(share)))
    ]
    if len(share) > _NAMED:
        rest = f"{len(share) - _NAMED} smaller ones, {share[_NAMED:].sum():.3g} %"
        keys.append(area_key(rest, fc=JOINT))
    figure.legend(handles=keys, loc="outside right upper", title=f"{len(share)} fragments")
