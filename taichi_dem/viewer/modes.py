"""What the bodies of a view are coloured by: values, scale and table of colours."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.plot_style import colour_table, table_of
from taichi_dem.kit.viewer import pack, quantise
from taichi_dem.output.record import Frame
from taichi_dem.plot.block import TITLES
from taichi_dem.plot.film import speed_edges
from taichi_dem.plot.series import level_names, level_shades

#: Colours of bodies on which an effect does not act and of outer faces; and of cracks.
_PLAIN, _CRACK = (228, 224, 214), {"label": "cracks", "colour": (20, 20, 23)}


def colour_modes(
    frames: Sequence[Frame],
    bodies: np.ndarray,
    dt0: float,
    acting_since: Mapping[str, np.ndarray],
    time: tuple[str, float],
) -> list[dict[str, Any]]:
    """Colourings that a page offers.

    Parameters
    ----------
    frames : sequence of Frame
        All that the page holds.
    bodies : ndarray
        Numbers of the bodies that it holds.
    dt0 : float
        Step of level 0 [s].
    acting_since : mapping of str to ndarray
        As of ``Result``.
    time : tuple
        Unit of times and how many of it a second has.

    Returns
    -------
    list of dict
        name, label; kind of the values; low, high of the scale; table, packed; and more by kind.
    """
    effects = [
        _since_mode(TITLES.get(name, name.replace("_", " ")), since[bodies], frames, time)
        for name, since in acting_since.items()
    ]
    own = [_speed_mode(frames, bodies), _level_mode(frames, bodies, dt0)]
    return [*own, _damage_mode(frames, bodies), _break_mode(frames, bodies, time), *effects]


def _speed_mode(frames, bodies):
    edges = speed_edges(frames)
    return {
        **{"name": "speed", "label": "speed [m/s]", "kind": "frames", "scaled": True},
        **{"low": float(edges[0]), "high": float(edges[-1]), "log": True},
        "values": quantise([frame.speed[bodies] for frame in frames]),
        "table": pack(colour_table("magma_r", 0.04, 0.9), "uint8"),
        "keys": [_CRACK],
    }


def _level_mode(frames, bodies, dt0):
    count = max(int(frame.level.max()) for frame in frames) + 1
    return {
        **{"name": "level of the step", "label": "step of a body", "kind": "levels"},
        **{"low": -0.5, "high": count - 0.5, "names": level_names(dt0, count)},
        "values": pack([frame.level[bodies] for frame in frames], "uint8"),
        "table": pack(table_of(level_shades(count)[:count]), "uint8"),
        "keys": [_CRACK],
    }


def _damage_mode(frames, bodies):
    return {
        **{"name": "damage", "label": "damage, mean of a body's bonds [1]", "kind": "frames"},
        **{"scaled": True, "low": 0.0, "high": 1.0},
        "values": quantise([frame.damage[bodies] for frame in frames]),
        "table": pack(colour_table("Blues", 0.08, 1.0), "uint8"),
        "keys": [_CRACK],
    }


def _break_mode(frames, bodies, time):
    keys = [{"label": "outer faces", "colour": _PLAIN}]
    own = {"name": "time of breaking", "label": f"face broke at [{time[0]}]", "kind": "faces"}
    return {**own, **_time_scale(frames, np.zeros(len(bodies)), time), "keys": keys}


def _since_mode(title, since, frames, time):
    keys = [{"label": "not yet, or never", "colour": _PLAIN}, _CRACK]
    own = {"name": f"since when: {title}", "label": f"{title}: since [{time[0]}]", "kind": "since"}
    return {**own, **_time_scale(frames, since, time), "keys": keys}


def _time_scale(frames, values, time):
    """Values [s] on a scale from zero to the last frame, both in the unit of the page."""
    return {
        **{"low": 0.0, "high": time[1] * frames[-1].time_s or 1.0},
        "values": pack(time[1] * values, "float32"),
        "table": pack(colour_table("plasma", 0.0, 0.88), "uint8"),
    }
