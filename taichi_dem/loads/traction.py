"""Tractions of a uniform stress on outer faces, as of the rock beyond them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.likely_units import STRENGTH, in_unit
from taichi_dem.kit.products import cross, matvec
from taichi_dem.kit.types import mat3, vec3
from taichi_dem.kit.validation import finite, shown, word
from taichi_dem.loads.pressure import FaceLoad
from taichi_dem.loads.supports import QuietBoundary
from taichi_dem.materials import Material
from taichi_dem.state.model import Model


def checked_stress(name: str, value: object) -> tuple[float, ...]:
    """Six components of a stress [Pa]: xx, yy, zz, xy, yz, zx."""
    given = [*value] if isinstance(value, (list, tuple, np.ndarray)) else []
    if len(given) != 6 or not all(finite(component) for component in given):
        raise InputError(
            f"{name} must be six numbers in Pa, xx, yy, zz, xy, yz and zx, compression negative, "
            f"got {shown(value)}"
        )
    stress = tuple(float(component) for component in given)
    if any(stress):
        in_unit(f"largest of {name}", max(stress, key=abs), STRENGTH)
    return stress


def tensor_of(stress: Sequence[float]) -> np.ndarray:
    """Matrix (3, 3) of six components."""
    xx, yy, zz, xy, yz, zx = stress
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


@ti.data_oriented
class Traction(FaceLoad):
    """Forces of a uniform stress on the faces of a group: they keep direction and size.

    A scene with ``stress`` adds one to each of its quiet boundaries, which do not creep then.

    Parameters
    ----------
    group : str
        Group of outer faces.
    stress : sequence of float
        Components xx, yy, zz, xy, yz and zx [Pa], compression negative.
    """

    def __init__(self, group: str, stress: Sequence[float]):
        self.group = word("group", group)
        self._stress = checked_stress("stress", stress)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Stress by rows [Pa]."""
        return tuple(tensor_of(self._stress).ravel().tolist())

    def stress(self, material: Material, size: float) -> float:
        """The largest component."""
        return max(map(abs, self._stress))

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m] on body i in a motion."""
        stress, force, torque = mat3(0.0), vec3(0.0), vec3(0.0)
        for r, c in ti.static(ti.ndrange(3, 3)):
            stress[r, c] = self.law[3 * r + c]
        for k in range(self.first[i], self.first[i + 1]):
            push = matvec(stress, self.area[k])
            force += push
            torque += cross(matvec(motion.rotation, self.arm[k]), push)
        return force, torque


def with_tractions(effects: Iterable[Any], stress: Sequence[float]) -> list[Any]:
    """Effects, and a traction of a stress on each quiet boundary that has none."""
    effects = list(effects)
    held = {effect.group for effect in effects if isinstance(effect, Traction)}
    quiet = [effect.group for effect in effects if isinstance(effect, QuietBoundary)]
    return [
        *effects,
        *(Traction(group, stress) for group in dict.fromkeys(quiet) if group not in held),
    ]


def check_bonds(model: Model) -> None:
    """Raise InputError where a bond could not bear the stress at the start."""
    pull, across = model.start_tractions[:, 0], length(model.start_tractions[:, 1:])
    strength = model.of_bonds(lambda material: material.tensile_strength)
    slope = model.of_bonds(lambda material: material.friction)
    limit = model.of_bonds(lambda material: material.cohesion) - slope * pull
    for name, share, most in (("tension", pull, strength), ("shear", across, limit)):
        beyond = np.flatnonzero(share > most)
        if len(beyond):
            b, top = beyond[0], model.topology
            raise InputError(
                f"stress must leave every bond below its strength, got a {name} of {share[b]:.3g} "
                f"Pa between bodies {top.master[b]} and {top.slave[b]}, which bear at most "
                f"{np.broadcast_to(most, share.shape)[b]:.3g} Pa"
            )
