"""Data of a page that shows a block in three dimensions, made from the frames of a run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_dem.kit.display import counted, scale
from taichi_dem.kit.plot_style import colour_table, table_of
from taichi_dem.kit.validation import FileName
from taichi_dem.kit.viewer import WebPage, pack, quantise, select_frames, show_page
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.output.fracture import quaternions_of
from taichi_dem.output.record import Frame
from taichi_dem.plot.block import TITLES, speed_edges
from taichi_dem.plot.series import level_names, level_shades
from taichi_dem.plot.view import first_breaks, skin
from taichi_dem.state.model import Model

_HERE = Path(__file__).resolve().parent
_SCRIPTS = (_HERE / "block.js", _HERE / "controls.js")
#: Bytes of a body in a frame: displacement, turn, speed, stress, damage, level; and in all.
_FRAME_BYTES, _BODY_BYTES = 19, 300
#: Time of a face that never breaks, and of one that was always free.
_NEVER, _ALWAYS = 3e38, -1.0
#: Colours of bodies on which an effect does not act and of outer faces; and of cracks.
_PLAIN, _CRACK = (228, 224, 214), {"label": "cracks", "colour": (20, 20, 23)}


def show_block(result: Any, path: FileName | None, open_browser: bool | None) -> WebPage:
    """Write the page of a ``Result``; arguments and errors as of ``Result.show``."""
    model, report = result.model, result.report
    body, face, breaks, edges = visible_faces(model, result.broken_time)
    bodies, faces = np.unique(body, return_inverse=True)
    size = _BODY_BYTES * len(bodies)
    finite = list(map(_is_finite, result.frames))
    frames, notes = select_frames(result.frames, finite, _FRAME_BYTES * len(bodies), size)
    time = scale(frames[-1].time_s, "s")[::-1]
    data = {
        **_motion(model, frames, bodies, time),
        **_shape(model, bodies),
        "faceBody": pack(faces, "uint32"),
        "faceLocal": pack(face, "uint8"),
        "faceBreaks": pack(_in_unit(breaks, time), "float32"),
        "edgeBreaks": pack(_in_unit(edges, time), "float32"),
        "magnify": _magnification(model, frames[-1]),
        "modes": _colour_modes(frames, bodies, result.method.dt0, result.acting_since, time),
        **_broken_curve(result.broken_time, frames, time),
    }
    title = f"Block of {counted(model.body_count, 'body')}"
    words = [report.outcome, f"{counted(len(frames), 'frame')}", result.diverged]
    content = {"title": title, "subtitle": "; ".join(filter(None, words)), "notes": notes}
    return show_page(path, open_browser, _SCRIPTS, data=data, **content)


def visible_faces(model: Model, broken_time: np.ndarray) -> Any:
    """Faces that show at some time."""
    broken, mesh = ~np.isnan(broken_time), model.mesh
    body, face, _ = skin(model.topology, broken)
    outer = np.full(model.topology.outer_count, -np.inf)
    breaks = np.concatenate([outer, broken_time[broken], broken_time[broken]])
    corners = mesh.tetrahedra[body[:, None], LOCAL_FACES[face]]
    pairs = corners[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    edges = first_breaks(mesh, model.topology, broken_time, pairs)
    return body, face, breaks, edges.reshape(-1, 3)


def _is_finite(frame: Frame) -> bool:
    values = frame.displacement, frame.rotation, frame.speed, frame.damage, frame.stress
    return all(bool(np.isfinite(value).all()) for value in values)


def _in_unit(times, unit):
    """Times [s] in the unit of the page, as finite numbers."""
    known = np.where(np.isfinite(times), unit[1] * times, _NEVER)
    return np.where(np.isneginf(times), _ALWAYS, known)


def _motion(model: Model, frames: Sequence[Frame], bodies: np.ndarray, time: Any) -> Any:
    """Where the bodies are in each frame, and when it was."""
    return {
        "unit": time[0],
        "times": [time[1] * frame.time_s for frame in frames],
        "centres": pack(model.centre[bodies], "float32"),
        "displacement": quantise([frame.displacement[bodies] for frame in frames]),
        "turns": quantise([rotation_vectors(frame.rotation[bodies]) for frame in frames]),
    }


def _shape(model: Model, bodies: np.ndarray) -> Any:
    corners = model.mesh.tetrahedra[bodies]
    used, places = np.unique(corners, return_inverse=True)
    points = model.mesh.points[used]
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.5 * np.maximum(high - low, 1e-3 * (high - low).max())
    arms = model.mesh.points[corners] - model.centre[bodies, None]
    return {
        "points": pack(points, "float32"),
        "tetrahedra": pack(places, "uint32"),
        "middle": (0.5 * (low + high)).tolist(),
        "half": half.tolist(),
        "radius": float(np.linalg.norm(half)),
        "arm": float(np.linalg.norm(arms, axis=2).max()),
    }


def rotation_vectors(rotation: np.ndarray) -> np.ndarray:
    """Axis times angle [rad] of rotation matrices (n, 3, 3), (n, 3), angles up to pi."""
    quaternion = quaternions_of(rotation)
    quaternion *= np.where(quaternion[:, 3:] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(quaternion[:, :3], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, quaternion[:, 3:])
    return quaternion[:, :3] * (angle / np.where(sine > 0.0, sine, 1.0))


def _magnification(model: Model, frame: Frame) -> float:
    """Magnification at which the displacement of the last frame is seen: 3 % of the block."""
    size = np.ptp(model.mesh.points, axis=0).max()
    moved = np.percentile(np.linalg.norm(frame.displacement, axis=1), 90)
    return float(np.clip(0.03 * size / max(moved, 1e-30), 1.0, 1e4))


def _broken_curve(broken_time: np.ndarray, frames: Sequence[Frame], time: Any) -> Any:
    counts = [int((broken_time <= frame.time_s).sum()) for frame in frames]
    times = [time[1] * frame.time_s for frame in frames]
    curve = {"name": "", "colour": "", "times": times, "values": counts}
    return {"curves": [curve], "curveLabel": "broken faces"}


def _colour_modes(frames, bodies, dt0, acting_since, time):
    """Colourings that a page offers, dicts: kind, values, scale from low to high, colours."""
    effects = [
        _since_mode(TITLES.get(name, name.replace("_", " ")), since[bodies], frames, time)
        for name, since in acting_since.items()
    ]
    own = [_speed_mode(frames, bodies), _level_mode(frames, bodies, dt0)]
    own += [_stress_mode(frames, bodies), _damage_mode(frames, bodies)]
    return [*own, _break_mode(frames, bodies, time), *effects]


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


def _stress_mode(frames, bodies):
    stresses = [1e-6 * frame.largest_stress[bodies] for frame in frames]
    top = float(np.percentile(np.abs(stresses), 98)) or 1.0
    return {
        **{"name": "stress", "label": "largest principal stress [MPa]", "kind": "frames"},
        **{"scaled": True, "low": -top, "high": top},
        "values": quantise(stresses),
        "table": pack(colour_table("RdBu_r", 0.02, 0.98), "uint8"),
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
