"""Cracks: broken faces by time, area and orientation."""

from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.fixed_order import dot, length, product
from taichi_dem.kit.validation import unit_vector, whole
from taichi_dem.mesh.tetrahedra import area_vectors, unit_normals
from taichi_dem.output.record import Frame
from taichi_dem.state.model import Model

#: Sine of the angle between a face and a plane below which they count as parallel.
_PARALLEL = 1e-6


def picture_axes(toward: np.ndarray) -> Any:
    """Right and up, unit vectors (3,), of a picture seen from a unit vector."""
    main = int(np.abs(toward).argmax())
    right = np.cross(np.eye(3)[(main + 2) % 3], toward)
    right = right / np.linalg.norm(right)
    return right, np.cross(toward, right)


def crack_areas(model: Model) -> np.ndarray:
    """Area of the crack that each bond leaves when it breaks [m^2], (bond_count,)."""
    top = model.topology
    return length(area_vectors(model.mesh.points, top.vertices)) * top.bonded_share


def apertures_of(model: Model, frame: Frame) -> np.ndarray:
    """Opening of every bond in a frame along the normal of its face [m], (bond_count,)."""
    top, bonds = model.topology, model.bonds
    branch = frame.position[top.slave] - frame.position[top.master]
    on_slave = bonds["on_slave"].mean(axis=1)[:, :, None]
    apart = branch + product(frame.rotation[top.slave], on_slave)[:, :, 0]
    normal = product(frame.rotation[top.master], bonds["frame"][:, 0, :, None])[:, :, 0]
    return dot(apart, normal) - bonds["on_master"][:, :, 0].mean(axis=1)


def cracks_of(model: Model, broken_time: np.ndarray, aperture: np.ndarray) -> Any:
    """Tabulate the broken faces in the order in which they broke."""
    # Geology, z up and y north: strike clockwise from north, the face dipping to its right, dip
    # from the horizontal; strike 0 for a horizontal face.
    bond = np.flatnonzero(np.isfinite(broken_time))
    bond = bond[np.argsort(broken_time[bond], kind="stable")]
    points, corners = model.mesh.points, model.topology.vertices[bond]
    place, normal = points[corners].mean(axis=1), unit_normals(points, corners)
    area = crack_areas(model)[bond]
    strike, dip = strike_and_dip(normal)
    columns = {
        "time_s": broken_time[bond],
        "bond": bond,
        "area_m2": area,
        "crack_area_m2": np.cumsum(area),
        "aperture_m": aperture[bond],
        **{f"centre_{axis}_m": place[:, k] for k, axis in enumerate("xyz")},
        **{f"{axis}_normal": normal[:, k] for k, axis in enumerate("xyz")},
        "strike_deg": strike,
        "dip_deg": dip,
    }
    return data_frame(columns)


def strike_and_dip(normal: np.ndarray) -> Any:
    """Strike and dip of planes [degree], two arrays (n,); normal: unit normals (n, 3)."""
    up = normal * np.where(normal[:, 2:] < 0.0, -1.0, 1.0)
    dip = np.degrees(np.arctan2(np.hypot(up[:, 0], up[:, 1]), up[:, 2]))
    # The upward normal leans the way in which the face dips, a quarter turn right of its strike.
    toward = np.degrees(np.arctan2(up[:, 0], up[:, 1]))
    flat = np.hypot(up[:, 0], up[:, 1]) < _PARALLEL
    return np.where(flat, 0.0, (toward - 90.0) % 360.0), dip


def rose_of(
    model: Model, broken: np.ndarray, axis: Any = (0.0, 0.0, 1.0), sectors: int = 36
) -> Any:
    """Sum up the area of cracks by the direction of their traces in a plane."""
    # Cracks that lie in the plane have no direction there: ``parallel_m2`` holds their area.
    axis, sectors = unit_vector("axis", axis), whole("sectors", sectors, 2, 360)
    bond = np.flatnonzero(broken)
    trace = np.cross(axis, unit_normals(model.mesh.points, model.topology.vertices[bond]))
    area, width = crack_areas(model)[bond], 180.0 / sectors
    seen = np.linalg.norm(trace, axis=1) > _PARALLEL
    right, up = picture_axes(axis)
    angle = np.degrees(np.arctan2(trace[seen] @ up, trace[seen] @ right))
    sector = np.floor(angle / width + 0.5).astype(int) % sectors
    columns = {
        "angle_deg": width * np.arange(sectors),
        "area_m2": np.bincount(sector, area[seen], sectors),
        "faces": np.bincount(sector, minlength=sectors),
    }
    beside = float(area[~seen].sum())
    return data_frame(columns, width_deg=width, parallel_m2=beside, axis=tuple(axis.tolist()))
