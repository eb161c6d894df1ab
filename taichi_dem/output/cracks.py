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
    """Right and up, unit vectors (3,), of a picture seen from a unit vector.

    Looking down a coordinate axis, the next two are right and up.
    """
    main = int(np.abs(toward).argmax())
    right = np.cross(np.eye(3)[(main + 2) % 3], toward)
    right = right / np.linalg.norm(right)
    return right, np.cross(toward, right)


def crack_areas(model: Model) -> np.ndarray:
    """Area of the crack that each bond leaves when it breaks [m^2], (bond_count,).

    Of a face that is bonded over a share of its area, that share.
    """
    top = model.topology
    return length(area_vectors(model.mesh.points, top.vertices)) * top.bonded_share


def apertures_of(model: Model, frame: Frame) -> np.ndarray:
    """Opening of every bond in a frame along the normal of its face [m], (bond_count,).

    The mean of its three contact units, from the start on, in the axes of the master; negative
    where faces are pressed into each other.
    """
    top, bonds = model.topology, model.bonds
    branch = frame.position[top.slave] - frame.position[top.master]
    on_slave = bonds["on_slave"].mean(axis=1)[:, :, None]
    apart = branch + product(frame.rotation[top.slave], on_slave)[:, :, 0]
    normal = product(frame.rotation[top.master], bonds["frame"][:, 0, :, None])[:, :, 0]
    return dot(apart, normal) - bonds["on_master"][:, :, 0].mean(axis=1)


def cracks_of(model: Model, broken_time: np.ndarray, aperture: np.ndarray) -> Any:
    """Tabulate the broken faces in the order in which they broke.

    Parameters
    ----------
    model : Model
    broken_time : ndarray, shape (bond_count,)
        When each bond broke [s], NaN while it holds.
    aperture : ndarray, shape (bond_count,)
        Opening of each bond along its normal [m].

    Returns
    -------
    pandas.DataFrame
        ``time_s``, ``bond``, ``area_m2``, ``crack_area_m2`` of all cracks so far, ``aperture_m``,
        place of the face at rest, its unit normal out of the master, strike and dip.

    Notes
    -----
    Strike and dip are those of geology with z up and y north: strike clockwise from north, the
    face dipping to its right; dip from the horizontal. A horizontal face has the strike 0.
    """
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
    """Sum up the area of cracks by the direction of their traces in a plane.

    Parameters
    ----------
    model : Model
    broken : ndarray of bool, shape (bond_count,)
    axis : sequence of 3 floats
        Normal of the plane, towards the viewer.
    sectors : int
        Of a half turn, 2 to 360.

    Returns
    -------
    pandas.DataFrame
        ``angle_deg``, the middle of a sector, counter-clockwise from the right of a picture seen
        along the axis (from x for the axis z); ``area_m2`` and number of ``faces`` in it. In its
        ``attrs``: ``width_deg`` of a sector, ``axis``, and ``parallel_m2``, the area of the cracks
        that lie in the plane, which have no direction there. With it the areas of the sectors add
        up to the area of all cracks.
    """
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
