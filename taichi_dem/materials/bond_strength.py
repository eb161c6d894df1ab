"""Strength of each bond of a scene over that of its material (NumPy only)."""

from collections.abc import Iterable

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import real_numbers, shown
from taichi_dem.materials.body_materials import BodyMaterials
from taichi_dem.materials.material import Material, check_energy, unchecked
from taichi_dem.materials.strength import factors
from taichi_dem.mesh.mesh import Mesh, volumes
from taichi_dem.mesh.topology import topology_of


def given_strength(mesh: Mesh, given: object) -> np.ndarray:
    """Factors that a scene asks for, an array (bond_count,) or a function of middles of faces."""
    top = topology_of(mesh)
    middle = mesh.points[top.vertices].mean(axis=1)
    strength = real_numbers("strength", given(middle) if callable(given) else given)
    if strength.shape != (top.bond_count,) or not (strength > 0.0).all():
        raise InputError(
            f"strength must be a positive number for each of {top.bond_count} bonds, as an array "
            f"or by a function of the middles of their faces, got {shown(strength)}"
        )
    return strength


def bond_strength(laid: BodyMaterials, given: object, seed: int) -> np.ndarray | None:
    """Strength of each bond over that of its material, (bond_count,); None where all have 1."""
    factor = None if given is None else given_strength(laid.mesh, given)
    if any(material.strength_spread for material in laid.materials):
        drawn = _drawn(laid, seed)
        factor = drawn if factor is None else factor * drawn
    return factor


def _drawn(laid, seed):
    """Factors of ``strength_spread``, (bond_count,)."""
    top, volume = topology_of(laid.mesh), volumes(laid.mesh)
    pairs = np.array([[(p.strength_spread, p.strength_volume) for p in row] for row in laid.pairs])
    spread, reference = pairs[laid.of_body[top.master], laid.of_body[top.slave]].T
    # A bond's pyramids are a quarter of each of its bodies.
    own = 0.25 * (volume[top.master] + volume[top.slave])
    return factors(spread, reference, own, seed)


def strongest(pairs: Iterable[Material], factor: np.ndarray | None) -> tuple[Material, ...]:
    """Materials as their strongest bond sees them; InputError where it would fail at once."""
    if factor is None or not len(factor):
        return tuple(pairs)
    most = float(factor.max())
    largest = tuple(
        unchecked(
            pair,
            normal_stiffness=float(pair.normal_stiffness) / most,
            shear_stiffness=float(pair.shear_stiffness) / most,
        )
        for pair in pairs
    )
    for pair in largest:
        check_energy(pair, f" of the strongest bond, which has {most:.3g} times the mean strength")
    return largest
