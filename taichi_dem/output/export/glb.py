"""The binary container of glTF: pieces of coloured triangles, each with a motion of its own."""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

_FLOAT, _BYTE, _VERTICES = 5126, 5121, 34962
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class GlbFile:
    """Nodes with a mesh each and one animation; add pieces, then ``move`` them all, then write."""

    def __init__(self) -> None:
        self._data: list[bytes] = []
        self._size = 0
        self._views: list[dict] = []
        self._accessors: list[dict] = []
        self._meshes: list[dict] = []
        self._nodes: list[dict] = []
        self._animations: list[dict] = []

    def add_piece(self, name: str, triangles: np.ndarray, colours: np.ndarray) -> None:
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
        self._meshes.append({"primitives": [{"attributes": attributes, "material": 0}]})
        self._nodes.append({"name": name, "mesh": len(self._meshes) - 1})

    def move(self, times: np.ndarray, places: np.ndarray, turns: np.ndarray) -> None:
        """Move all nodes; they begin where they are at the first time.

        times: (k,) [s], ascending; where there is but one, nothing moves. places: (k, nodes, 3)
        [m]; turns: (k, nodes, 4), unit quaternions x, y, z, w.
        """
        for one, place, turn in zip(self._nodes, places[0], turns[0]):
            one.update(translation=place.tolist(), rotation=turn.tolist())
        if len(times) < 2:
            return
        clock = times.astype(np.float32)
        bounds = {"min": [float(clock[0])], "max": [float(clock[-1])]}
        made: dict[str, list] = {"samplers": [], "channels": []}
        given = self._accessor(clock[:, None], vertices=False, **bounds)
        for path, values in (("translation", places), ("rotation", turns)):
            for node in range(len(self._nodes)):
                ways = self._accessor(values[:, node].astype(np.float32), vertices=False)
                target = {"node": node, "path": path}
                made["channels"].append({"sampler": len(made["samplers"]), "target": target})
                made["samplers"].append({"input": given, "output": ways})
        self._animations.append(made)

    def content(self, extras: Mapping[str, Any]) -> bytes:
        """The file, in bytes; extras: numbers that viewers pass over."""
        material = {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0}}
        scene = {
            "asset": {"version": "2.0", "generator": "taichi-dem", "extras": dict(extras)},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._nodes)))}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [material],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._size}],
        }
        if self._animations:
            scene["animations"] = self._animations
        text = json.dumps(scene, separators=(",", ":")).encode()
        chunks = _chunk(b"JSON", text, b" ") + _chunk(b"BIN\0", b"".join(self._data), b"\0")
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _accessor(self, values, vertices=True, **about):
        """Number of an accessor of values (n, k), whose data are added; vertices: of a mesh."""
        raw = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": self._size, "byteLength": len(raw)}
        if vertices:
            view["target"] = _VERTICES
        self._views.append(view)
        # All values have four bytes, or four of one byte: what follows stays aligned.
        self._data.append(raw)
        self._size += len(raw)
        kind = _FLOAT if values.dtype == np.float32 else _BYTE
        shape = {"componentType": kind, "count": len(values), "type": _TYPES[values.shape[1]]}
        self._accessors.append({"bufferView": len(self._views) - 1, **shape, **about})
        return len(self._accessors) - 1


def _linear(shade):
    """Light of sRGB colours in [0, 1] (IEC 61966-2-1), which glTF takes in vertices."""
    return np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4)


def _chunk(kind, data, filler):
    """A chunk of the container, filled up to a multiple of four bytes."""
    data = data + filler * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data
