"""A run as a glTF scene (.glb) for browsers and Blender: every fragment moves as a rigid piece."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.files import write_bytes
from taichi_dem.kit.validation import FileName, positive
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from taichi_dem.mesh.topology import skin
from taichi_dem.output.export.glb import GlbFile
from taichi_dem.output.export.rigid_motion import quaternions_of, rigid_motion
from taichi_dem.output.fragments import broken_by, centres, fragment_of_body
from taichi_dem.output.record import Frame
from taichi_dem.state.model import Model

#: Colours from low to high, viridis in nine steps, and that of crack faces; sRGB.
_SCALE = np.array(
    [
        *((68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141)),
        *((39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37)),
    ]
)
_INSIDE = np.array((181, 173, 156))


def write_gltf(
    path: FileName,
    model: Model,
    frames: Sequence[Frame],
    broken_time: np.ndarray,
    values: np.ndarray,
    seconds: float = 10.0,
) -> None:
    """Write frames as an animation in a binary glTF file.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.glb"``.
    model : Model
    frames : sequence of Frame
        At least one.
    broken_time : ndarray, shape (bond_count,)
        When each bond broke [s], NaN while it holds.
    values : ndarray, shape (body_count,)
        In [0, 1]: colour of the outer faces of each body, from violet to yellow.
    seconds : float
        How long the animation lasts [s]; the run is stretched to it.

    Raises
    ------
    InputError
        Where the file cannot be written.

    Notes
    -----
    A node is a fragment of the last frame, with its outer faces and its broken ones (grey), at rest
    about its centre of mass. It moves as ``rigid_motion`` says; what a fragment bends is not shown.
    Format: Khronos glTF 2.0. Lengths in m, axes as in the run: y is up in most viewers.
    """
    seconds = positive("seconds", seconds)
    broken = broken_by(broken_time, frames[-1].time_s)
    of_body = fragment_of_body(model, broken)
    file = GlbFile()
    for number, surface in enumerate(_surfaces(model, broken, of_body, values)):
        file.add_piece(f"fragment {number}", *surface)
    times = np.array([frame.time_s for frame in frames])
    motion = _motions(model, frames, of_body)
    last = times[-1] - times[0]
    file.move((times - times[0]) * (seconds / last if last > 0.0 else 0.0), *motion)
    extras = {"from_s": times[0], "to_s": times[-1], "animation_s": seconds}
    write_bytes(path, file.content(extras))


def _surfaces(model, broken, of_body, values):
    """Triangles at rest about the fragment's centre (n, 3, 3) and their colours, a pair each."""
    body, face, is_crack = skin(model.topology, broken)
    rest = model.mesh.points[model.mesh.tetrahedra]
    rest = rest - centres(of_body, model.body_mass, model.centre)[of_body][:, None]
    triangles = rest[body[:, None], LOCAL_FACES[face]]
    colours = np.where(is_crack[:, None], _INSIDE, _colours(values)[body])
    order = np.argsort(of_body[body], kind="stable")
    ends = np.cumsum(np.bincount(of_body[body]))[:-1]
    return zip(np.split(triangles[order], ends), np.split(colours[order], ends))


def _colours(values):
    """Colours (n, 3) of values in [0, 1], sRGB from 0 to 255."""
    places = np.linspace(0.0, 1.0, len(_SCALE))
    return np.stack([np.interp(values, places, channel) for channel in _SCALE.T], axis=1)


def _motions(model: Model, frames: Sequence[Frame], of_body: np.ndarray) -> Any:
    """Translations (frames, fragments, 3) and quaternions x, y, z, w (frames, fragments, 4)."""
    places: list[np.ndarray] = []
    turns: list[np.ndarray] = []
    for frame in frames:
        centre, rotation = rigid_motion(model, frame, of_body)
        turn = np.roll(quaternions_of(rotation), -1, axis=1)
        if turns:
            # q and -q are one rotation; between two frames the shorter way is meant.
            turn = turn * np.where((turn * turns[-1]).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
        places.append(centre)
        turns.append(turn)
    return np.array(places), np.array(turns)
