"""A run for other programs: glTF (browsers, Blender), extended XYZ (OVITO), VTKHDF (ParaView 5.12).

In glTF every fragment moves as a rigid piece.
"""

import io
import itertools
import json
import struct
from typing import Any

import numpy as np

from taichi_dem.kit.extended_xyz import XyzFrame, write_extended_xyz
from taichi_dem.kit.files import write_bytes
from taichi_dem.kit.validation import FileName, choice, positive
from taichi_dem.mesh.tetrahedra import LOCAL_FACES, signed_volumes
from taichi_dem.mesh.topology import skin
from taichi_dem.output.fragments import (
    fragment_of_body,
    fragments_of,
    quaternions_of,
    rigid_motion,
    shares_of_scale,
    vectors_of,
)
from taichi_dem.output.record import body_corners, cell_data, corners_of_bodies
from taichi_dem.state.model import centres

#: Colours from low to high, viridis in nine steps, and that of crack faces; sRGB.
_SCALE = np.array(
    [
        *((68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141)),
        *((39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37)),
    ]
)
_INSIDE = np.array((181, 173, 156))
_FLOAT, _BYTE, _VERTICES = 5126, 5121, 34962
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_TETRAHEDRON = 10
#: The format's version that brought series, the lowest that has all that is used here.
_VERSION = (2, 0)
#: Rows of a compressed piece of a column.
_CHUNK = 65536


def write_gltf(path: FileName, result: Any, colour: str, seconds: float) -> None:
    """Write the frames of a ``Result`` as an animation in a binary glTF file.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.glb"``.
    result : Result
        With a frame at least.
    colour : str
        One of ``body_values.COLOURS``: of the outer faces of each body, from violet to yellow.
    seconds : float
        Duration of the animation [s], to which the run is stretched.

    Raises
    ------
    InputError
        For another colour or no time, or where the file cannot be written.

    Notes
    -----
    A node is a fragment of the last frame, with its outer faces and its broken ones (grey), at rest
    about its centre of mass. It moves by ``rigid_motion``; bending of fragments is not shown.
    Format: Khronos glTF 2.0. Lengths in m, axes as in the run: y is up in most viewers.
    """
    model, frames = result.model, result.frames
    values, seconds = shares_of_scale(result, frames[-1], colour), positive("seconds", seconds)
    broken = result.broken_time <= frames[-1].time_s
    of_body = fragment_of_body(model, broken)
    file = _GlbFile()
    for number, surface in enumerate(_surfaces(model, broken, of_body, values)):
        file.add_piece(f"fragment {number}", *surface)
    times = np.array([frame.time_s for frame in frames])
    last, motion = times[-1] - times[0], _motions(model, frames, of_body)
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


def _motions(model, frames, of_body):
    """Translations (frames, fragments, 3) and quaternions x, y, z, w (frames, fragments, 4)."""
    places, rotations = zip(*(rigid_motion(model, frame, of_body) for frame in frames))
    turns = np.array(list(map(quaternions_of, rotations)))
    # q and -q are one rotation; between two frames the shorter way is meant.
    for before, turn in itertools.pairwise(turns):
        turn *= np.where((turn * before).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    return np.array(places), turns


class _GlbFile:
    """The binary container of glTF: nodes with a mesh of coloured triangles each, one animation."""

    def __init__(self):
        names = "nodes", "meshes", "accessors", "bufferViews", "animations"
        self._parts: dict[str, list] = {name: [] for name in names}
        self._data = bytearray()

    def _add(self, part, entry):
        self._parts[part].append(entry)
        return len(self._parts[part]) - 1

    def add_piece(self, name, triangles, colours):
        """Add a node; triangles (n, 3, 3) [m], counter-clockwise; colours (n, 3), sRGB to 255."""
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        shades = np.full((len(colours), 4), 255, dtype=np.uint8)
        shades[:, :3] = np.round(255.0 * _linear(colours / 255.0))
        corners = triangles.reshape(-1, 3).astype(np.float32)
        bounds = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
        attributes = {
            "POSITION": self._accessor(corners, **bounds),
            "NORMAL": self._accessor(np.repeat(normal, 3, axis=0).astype(np.float32)),
            "COLOR_0": self._accessor(np.repeat(shades, 3, axis=0), normalized=True),
        }
        mesh = {"primitives": [{"attributes": attributes, "material": 0}]}
        self._add("nodes", {"name": name, "mesh": self._add("meshes", mesh)})

    def move(self, times, places, turns):
        """Move all nodes; they begin where they are at the first time.

        times: (k,) [s], ascending; where there is but one, nothing moves. places: (k, nodes, 3)
        [m]; turns: (k, nodes, 4), unit quaternions x, y, z, w.
        """
        for one, place, turn in zip(self._parts["nodes"], places[0], turns[0]):
            one.update(translation=place.tolist(), rotation=turn.tolist())
        if len(times) < 2:
            return
        clock = times.astype(np.float32)
        bounds = {"min": [float(clock[0])], "max": [float(clock[-1])]}
        given = self._accessor(clock[:, None], vertices=False, **bounds)
        ways = [
            ({"node": node, "path": path}, values[:, node].astype(np.float32))
            for path, values in (("translation", places), ("rotation", turns))
            for node in range(places.shape[1])
        ]
        channels = [{"sampler": k, "target": target} for k, (target, _) in enumerate(ways)]
        samplers = [
            {"input": given, "output": self._accessor(values, vertices=False)} for _, values in ways
        ]
        self._add("animations", {"samplers": samplers, "channels": channels})

    def content(self, extras):
        """The file, in bytes; extras: numbers that viewers pass over."""
        material = {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0}}
        scene = {
            "asset": {"version": "2.0", "generator": "taichi-dem", "extras": extras},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._parts["nodes"])))}],
            "materials": [material],
            "buffers": [{"byteLength": len(self._data)}],
            **{name: part for name, part in self._parts.items() if part},
        }
        text = json.dumps(scene, separators=(",", ":")).encode()
        chunks = _chunk(b"JSON", text, b" ") + _chunk(b"BIN\0", bytes(self._data), b"\0")
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _accessor(self, values, vertices=True, **about):
        """Number of an accessor of values (n, k), whose data are added; vertices: of a mesh."""
        raw = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(raw)}
        if vertices:
            view["target"] = _VERTICES
        # All values have four bytes, or four of one byte: what follows stays aligned.
        self._data += raw
        kind = _FLOAT if values.dtype == np.float32 else _BYTE
        shape = {"componentType": kind, "count": len(values), "type": _TYPES[values.shape[1]]}
        return self._add(
            "accessors", {"bufferView": self._add("bufferViews", view), **shape, **about}
        )


def _linear(shade):
    """Light of sRGB colours in [0, 1] (IEC 61966-2-1), which glTF takes in vertices."""
    return np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4)


def _chunk(kind, data, filler):
    """A chunk of the container, filled up to a multiple of four bytes."""
    data = data + filler * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data


def write_particles(path: FileName, result: Any, of: str) -> None:
    """Write the frames of a ``Result`` as an extended XYZ file.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.xyz"``.
    result : Result
        With a frame at least.
    of : {"bodies", "fragments"}
        What a particle is. Fragments are those of each frame, so that their number grows.

    Raises
    ------
    InputError
        For another word, or where the file cannot be written.

    Notes
    -----
    Columns: pos [m], radius of the sphere of the same volume [m], velo [m/s], orientation (unit
    quaternion x, y, z, w, from the shape at rest), mass [kg], fragment (by falling mass).
    """
    kinds = {"bodies": _bodies, "fragments": _fragments}
    particles_of = kinds[choice("of", of, kinds)]
    tables = [_table(*particles_of(result, frame)) for frame in result.frames]
    margin = max(table["radius"].max() for table in tables)
    low = np.min([table["pos"].min(axis=0) for table in tables], axis=0) - margin
    high = np.max([table["pos"].max(axis=0) for table in tables], axis=0) + margin
    shots = [XyzFrame(f.time_s, table, low, high - low) for f, table in zip(result.frames, tables)]
    write_extended_xyz(path, shots)


def _table(place, radius, velocity, rotation, mass, fragment):
    """Columns of the particles in a frame, by name."""
    turns = {"orientation": quaternions_of(rotation), "mass": mass, "fragment": fragment}
    return {"pos": place, "radius": radius, "velo": velocity, **turns}


def _bodies(result, frame):
    model = result.model
    volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra)
    of_body = fragment_of_body(model, result.broken_time <= frame.time_s)
    radius = np.cbrt(0.75 * volume / np.pi)
    return frame.position, radius, frame.velocity, frame.rotation, model.body_mass, of_body


def _fragments(result, frame):
    of_body = fragment_of_body(result.model, result.broken_time <= frame.time_s)
    found = fragments_of(result.model, frame, of_body)
    centre, rotation = rigid_motion(result.model, frame, of_body)
    radius, velocity = 0.5 * found["diameter_m"], vectors_of(found, "velocity")
    return centre, radius, velocity, rotation, found["mass_kg"], found["fragment"]


def write_vtkhdf(path: FileName, result: Any) -> None:
    """Write the frames of a ``Result`` as one VTKHDF file: moving points, cell data of the series.

    Parameters
    ----------
    path : str or path
        Name of the file, such as ``"run.vtkhdf"``.
    result : Result
        With a frame at least.

    Raises
    ------
    InputError
        Where h5py is not installed, or the file cannot be written.

    Notes
    -----
    Format: VTK File Formats, section VTKHDF, unstructured grid over time, version 2.0.
    """
    import h5py

    model, frames = result.model, result.frames
    # In memory: HDF5 on a full disk fails when it closes the file, and then again at the end.
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = _VERSION
        kind = h5py.string_dtype("ascii", len("UnstructuredGrid"))
        root.attrs.create("Type", b"UnstructuredGrid", dtype=kind)
        _write_cells(root, model)
        points = [body_corners(model, frame).reshape(-1, 3) for frame in frames]
        _column(root, "Points", points)
        columns = [cell_data(model, frame, result.acting_since) for frame in frames]
        for name in columns[0]:
            _column(root, f"CellData/{name}", [column[name] for column in columns])
        _write_steps(root, [frame.time_s for frame in frames], model.body_count, list(columns[0]))
    write_bytes(path, content.getvalue())


def _write_cells(root, model):
    """Bodies as cells, each with four points of its own, the same in all frames."""
    cells = corners_of_bodies(model)
    count = len(cells)
    root["Connectivity"] = cells.astype(np.int64).ravel()
    root["Offsets"] = 4 * np.arange(count + 1, dtype=np.int64)
    root["Types"] = np.full(count, _TETRAHEDRON, np.uint8)
    for name, number in (("Points", cells.size), ("Cells", count), ("ConnectivityIds", cells.size)):
        root[f"NumberOf{name}"] = np.array([number], dtype=np.int64)


def _write_steps(root, times_s, count, names):
    """Where the data of each frame begin; the cells are those of the first for all."""
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = len(times_s)
    steps["Values"] = np.array(times_s)
    every, none = np.arange(len(times_s)), np.zeros(len(times_s), dtype=np.int64)
    steps["NumberOfParts"] = none + 1
    steps["PartOffsets"], steps["PointOffsets"] = none, 4 * count * every
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = none[:, None]
    for name in names:
        steps[f"CellDataOffsets/{name}"] = count * every


def _column(root, name, parts):
    """Write the values of all frames, one after the other."""
    values = np.concatenate(parts)
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    chunk = (min(len(values), _CHUNK), *values.shape[1:])
    root.create_dataset(name, data=values, chunks=chunk, **packed)
