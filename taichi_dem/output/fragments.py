"""Fragments: bodies that unbroken bonds still join, as rigid pieces; values to colour bodies by."""

from typing import Any

import numpy as np

from taichi_dem.kit.validation import choice
from taichi_dem.mesh.tetrahedra import signed_volumes
from taichi_dem.output.record import Frame
from taichi_dem.state.model import Model, centres, sums

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
