"""What broke, as tables: cracks by time, area and orientation, and fragments."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.fixed_order import dot, length, product
from taichi_dem.kit.validation import choice, unit_vector, whole
from taichi_dem.mesh.tetrahedra import area_vectors, signed_volumes, unit_normals
from taichi_dem.output.record import Frame
from taichi_dem.state.model import Model, centres, sums

#: Sine of the angle between a face and a plane below which they count as parallel.
_PARALLEL = 1e-6
_AXES = "xyz"
#: Unit and words of what bodies can be coloured by.
COLOURS = {
    "speed": ("m/s", "speed"),
    "peak_speed": ("m/s", "largest speed so far"),
    "displacement": ("m", "displacement"),
    "damage": ("1", "damage"),
    "level": ("1", "level of the step"),
    "fragment": ("1", "fragment, by falling mass"),
}


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


def fragment_of_body(model: Model, broken: np.ndarray) -> np.ndarray:
    """Number the fragments by falling mass, equal ones by their first body."""
    heads, number = np.unique(model.pieces(broken), return_inverse=True)
    order = np.lexsort((heads, -np.bincount(number.reshape(-1), model.body_mass)))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rank[number.reshape(-1)]


def fragments_of(model: Model, frame: Frame, of_body: np.ndarray) -> dict[str, np.ndarray]:
    """Tabulate the fragments in a frame, the heaviest first."""
    # ``sieve_m``, the sieve that a fragment just passes: the middle edge of the cuboid of equal
    # volume and principal moments. Kinetic energy beyond translation and rotation is vibration.
    mass = sums(of_body, model.body_mass)
    volume = sums(of_body, signed_volumes(model.mesh.points, model.mesh.tetrahedra))
    return {
        "fragment": np.arange(len(mass)),
        "bodies": np.bincount(of_body),
        "mass_kg": mass,
        "volume_m3": volume,
        "diameter_m": np.cbrt(6.0 * volume / np.pi),
        "sieve_m": _middle_edges(model, of_body, mass),
        **_motion(model, frame, of_body, mass),
    }


def passing_mass(fragments: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of sieves [m] in order, and the share of the mass that passes each."""
    order = np.argsort(fragments["sieve_m"], kind="stable")
    mass = np.cumsum(fragments["mass_kg"][order])
    return fragments["sieve_m"][order], mass / mass[-1]


def _motion(model, frame, of_body, mass):
    """Columns of place, velocity, spin and kinetic energy."""
    body_mass = model.body_mass[:, None]
    centre = centres(of_body, model.body_mass, frame.position)
    velocity = centres(of_body, model.body_mass, frame.velocity)
    arm = frame.position - centre[of_body]
    own = np.cross(arm, body_mass * (frame.velocity - velocity[of_body]))
    momentum = sums(of_body, own + frame.angular_momentum)
    turned = frame.rotation @ model.body_inertia @ np.swapaxes(frame.rotation, 1, 2)
    inertia = sums(of_body, turned + _steiner(model.body_mass, arm))
    spin = np.linalg.solve(inertia, momentum[:, :, None])[:, :, 0]
    local, local_spin = body_spins(model.body_inertia, frame.rotation, frame.angular_momentum)
    body_energy = (model.body_mass * (frame.velocity**2).sum(axis=1)) + (local * local_spin).sum(1)
    return {
        **{f"centre_{axis}_m": centre[:, k] for k, axis in enumerate(_AXES)},
        **{f"velocity_{axis}_m_s": velocity[:, k] for k, axis in enumerate(_AXES)},
        "speed_m_s": np.linalg.norm(velocity, axis=1),
        **{f"spin_{axis}_rad_s": spin[:, k] for k, axis in enumerate(_AXES)},
        "spin_rad_s": np.linalg.norm(spin, axis=1),
        "kinetic_J": 0.5 * sums(of_body, body_energy),
        "translation_J": 0.5 * mass * (velocity**2).sum(axis=1),
        "rotation_J": 0.5 * (spin * momentum).sum(axis=1),
    }


def body_spins(
    inertia: np.ndarray, rotation: np.ndarray, angular_momentum: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Angular momenta [kg m^2/s], spins [rad/s] of bodies in their own axes, (..., n, 3) each."""
    local = np.einsum("...nji,...nj->...ni", rotation, angular_momentum)
    return local, np.einsum("nij,...nj->...ni", np.linalg.inv(inertia), local)


def _middle_edges(model, of_body, mass):
    """Middle edges [m] of the cuboids with the fragments' inertia at rest."""
    arm = model.centre - centres(of_body, model.body_mass, model.centre)[of_body]
    inertia = sums(of_body, model.body_inertia + _steiner(model.body_mass, arm))
    # Second moments of a cuboid are m a^2 / 12; the sum of two is a principal moment of inertia.
    moments = np.linalg.eigvalsh(inertia)
    return np.sqrt(12.0 * (0.5 * moments.sum(axis=1) - moments[:, 1]) / mass)


def _steiner(mass, arm):
    square = (arm**2).sum(axis=1)[:, None, None] * np.eye(3)
    return mass[:, None, None] * (square - arm[:, :, None] * arm[:, None, :])


def quaternions_of(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions x, y, z, w of rotation matrices (n, 3, 3); (n, 4)."""
    # Divides by the largest component (S. W. Shepperd, J. Guidance and Control 1, 1978, 223-224).
    # SciPy's Rotation takes 0.4 s to import, and every page of a run needs it.
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(rotation, 0, -1)
    x, y, z = h - f, c - g, d - b
    candidates = np.array(
        [
            (1.0 + a + e + i, x, y, z),
            (x, 1.0 + a - e - i, b + d, c + g),
            (y, b + d, 1.0 - a + e - i, f + h),
            (z, c + g, f + h, 1.0 - a - e + i),
        ]
    )
    best = np.einsum("kkn->kn", candidates).argmax(axis=0)
    quaternions = candidates[best, :, np.arange(len(best))]
    return np.roll(quaternions / np.linalg.norm(quaternions, axis=1)[:, None], -1, axis=1)


def body_values(result: Any, frame: Frame, colour: str) -> np.ndarray:
    """Value of every body of a ``Result`` in a frame, (body_count,); colour: one of COLOURS."""
    if choice("colour", colour, COLOURS) == "fragment":
        return fragment_of_body(result.model, result.broken_time <= frame.time_s)
    if colour == "peak_speed":
        return result.peak_speed
    if colour == "displacement":
        return np.linalg.norm(frame.displacement, axis=1)
    return getattr(frame, colour)


def scale_end(values: np.ndarray) -> float:
    """Value that a fiftieth of the bodies exceed, or the largest where that is 0."""
    return float(np.percentile(values, 98.0) or values.max())
