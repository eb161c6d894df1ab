"""Waves in bars: diagrams over place and time, and films of a bar that may break."""

from collections.abc import Mapping
from typing import Any, Optional

import matplotlib
import numpy as np

from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.film import moving_picture

#: Below zero, at zero, above: pressed, at rest, pulled.
_COLOURS = "RdBu_r"


def draw_space_time(
    axes: Any,
    place: np.ndarray,
    time_s: np.ndarray,
    values: np.ndarray,
    label: Optional[str] = None,
    top: Optional[float] = None,
) -> Any:
    """Draw values over place and time: red above zero, blue below; returns the ``QuadMesh``.

    place: (places,) [m]. time_s: (times,) [s]. values: (times, places). label: of a colour bar,
    without one for None. top: end of the colour scale, the largest size of the values if None.
    """
    top = np.abs(values).max() if top is None else top
    look = {"cmap": _COLOURS, "vmin": -top, "vmax": top, "shading": "auto", "rasterized": True}
    drawn = axes.pcolormesh(place, 1e3 * np.asarray(time_s), values, **look)
    axes.set(xlabel="place [m]", ylabel="time [ms]")
    if label is not None:
        axes.figure.colorbar(drawn, ax=axes, label=label)
    return drawn


def picture_wave(
    path: FileName,
    place: np.ndarray,
    time_s: np.ndarray,
    values: np.ndarray,
    *,
    cells: Mapping[str, int],
    label: str,
    titles: Any = ("", ""),
    level: Optional[tuple[str, float]] = None,
) -> None:
    """A picture of a wave: values over place and time, and over time in some cells.

    place: of the cells (places,) [m]. time_s: (times,) [s]. values: (times, places). cells:
    numbers of those to follow, name -> number. label: of the values. titles: of both panels.
    level: words and value of a dotted line.
    """
    with picture(path, 1, 2, size=(9.0, 3.8)) as (_, (along, over)):
        draw_space_time(along, place, time_s, values, label)
        looks = zip((BLUE, GREEN, RED, ORANGE, PURPLE), ("-", "--", "-.", ":", (0, (8, 2))))
        for (name, cell), (colour, dashes) in zip(cells.items(), looks):
            look = {"color": colour, "ls": dashes, "label": name}
            over.plot(1e3 * time_s, values[:, cell], **look)
            along.axvline(place[cell], lw=1.2, **look)
        along.set_title(titles[0])
        along.legend(loc="lower left", bbox_to_anchor=(0.0, 1.08), ncols=4, columnspacing=1.0)
        if level:
            over.axhline(level[1], color=GREY, ls=":", label=level[0])
        over.set(xlabel="time [ms]", ylabel=label, title=titles[1])
        over.legend(loc="upper left")


def draw_breaks(axes: Any, place: np.ndarray, time_s: np.ndarray, joints: np.ndarray) -> None:
    """Mark where and when joints broke; place: of the joints [m], joints: (times, joints)."""
    when, where = np.nonzero(np.diff(joints.astype(int), axis=0, prepend=0) > 0)
    axes.plot(place[where], 1e3 * time_s[when], "x", color=BLACK, ms=6, label="breaks")


def film_bar(
    path: FileName,
    profile: Any,
    stress_pa: np.ndarray,
    *,
    length: float,
    strength_pa: float,
    bar: Any = (),
    count: int = 40,
    magnify: float = 150.0,
) -> None:
    """Write a GIF of a bar: velocity and stress along it, and itself, broken joints as gaps.

    profile: a ``Profile`` of slices of one length. stress_pa: between them, as ``Profile.stress``
    gives it. length: of the bar [m]. strength_pa: drawn beside the stress. bar: which one, index
    of a profile of several. count: of pictures. magnify: of the displacement.
    """
    chosen = (slice(None), *np.atleast_1d(bar).astype(int))
    speed, stress, moved, joints = (
        values[chosen]
        for values in (profile.velocity, stress_pa, profile.displacement, profile.joints)
    )
    cell, stress = length / speed.shape[1], 1e-6 * stress
    place, joint = cell * (np.arange(speed.shape[1]) + 0.5), cell * np.arange(1, speed.shape[1])
    with moving_picture(path, (4.0, 3.8), 110) as (figure, shoot):
        fast, tight, whole = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.0, 0.55))
        (moving,) = fast.plot(place, speed[0], color=GREEN)
        fast.set(ylabel="velocity [m/s]", ylim=(1.1 * speed.min(), 1.1 * speed.max()))
        (loaded,) = tight.plot(joint, stress[0], color=BLACK)
        tight.axhline(1e-6 * strength_pa, color=RED, ls="--", label="strength")
        (breaks,) = tight.plot([], [], "x", color=ORANGE, ms=6, mew=1.6, label="broken face")
        tight.set(ylabel="stress [MPa]", ylim=(1.1 * stress.min(), 1.1 * stress.max()))
        tight.legend(loc="lower left")
        boxes = whole.bar(place, 1.0, cell, linewidth=0.0)
        whole.set(xlim=(-0.05 * length, 1.16 * length), ylim=(0.0, 1.0), yticks=[])
        whole.set(xlabel=f"place [m]; displacement × {magnify:g}, red: tension, blue: pressure")
        whole.grid(False)
        lefts, shades = place - 0.5 * cell + magnify * (moved - moved[:, :1]), _shades(stress)
        for row in np.linspace(0, len(profile.time) - 1, count).round().astype(int):
            moving.set_ydata(speed[row])
            loaded.set_ydata(stress[row])
            breaks.set_data(joint[joints[row]], np.zeros(joints[row].sum()))
            for box, left, shade in zip(boxes, lefts[row], shades[row]):
                box.set(x=left, facecolor=shade)
            fast.set_title(f"t = {1e3 * profile.time[row]:.2f} ms")
            shoot()


def _shades(stress):
    """Colours of cells; each has the mean stress of its two joints, ends are free."""
    own = 0.5 * (np.pad(stress, ((0, 0), (0, 1))) + np.pad(stress, ((0, 0), (1, 0))))
    return matplotlib.colormaps[_COLOURS](0.5 + 0.5 * own / np.abs(stress).max())
