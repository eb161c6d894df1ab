"""A structure of several degrees of freedom, given by its modes.

Source: Craig and Kurdila, Fundamentals of Structural Dynamics, 2nd edition, chapters 10 and 11.

Its places move along the axis of the boxes, up positive, and hang on a base: where the base moves
by y and nothing else happens slowly, all places move by y. With masses M, shapes phi, natural
angular frequencies w_k and damping ratios z_k, phi^T M phi = 1, the modal coordinates p obey

    p_k'' + 2 z_k w_k p_k' + w_k^2 p_k = G_k (2 z_k w_k y' + w_k^2 y) + sum_i phi_ik F_i

with G = phi^T M 1 and forces F_i at the places, which are at x = phi p + r y, r = 1 - phi G, zero
with all modes. Without some, r y is their share in a translation: a base that moves slowly still
takes all places along. What is lost is their flexibility and their resonances.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ca_damper.filling import Filling, check_filling
from ca_damper.oscillator import check_steady
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import (
    LARGEST,
    SMALLEST,
    real_numbers,
    shown,
    whole,
)

#: Most places of a structure.
MOST_PLACES = 1000
#: Largest error of phi^T M phi: as large as that is the share by which the motion may be wrong.
ORTHONORMAL_TO = 1e-4
# Largest asymmetry of a matrix, as a share of its largest entry.
_SYMMETRIC_TO = 1e-9


@dataclass(frozen=True, eq=False)
class ModalStructure:
    """Places of a structure that move along one axis, and the modes in which they move.

    Parameters
    ----------
    masses : ndarray
        Masses of the places [kg], shape (places,), or their matrix, shape (places, places).
    frequencies : ndarray
        Natural frequencies of the modes [Hz], shape (modes,).
    damping_ratios : ndarray
        Shares of critical damping of the modes, shape (modes,), or one number for all.
    shapes : ndarray
        Mode shapes [kg^-1/2], shape (places, modes), with shapes^T masses shapes = 1.

    References
    ----------
    Craig and Kurdila, Fundamentals of Structural Dynamics, 2nd edition, chapters 10 and 11.
    """

    masses: np.ndarray
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray

    def __post_init__(self) -> None:
        masses = _mass_matrix("masses", self.masses)
        shapes = _array("shapes", self.shapes, 2)
        places, modes = shapes.shape
        if places != len(masses):
            raise InputError(
                f"shapes must have a row for each of {counted(len(masses), 'place')}, got "
                f"{places} x {modes} numbers"
            )
        if not 1 <= modes <= places:
            raise InputError(f"shapes must have from 1 to {places} modes, as places, got {modes}")
        frequencies = _of_each("frequencies", "mode", self.frequencies, modes, SMALLEST)
        damping: Any = self.damping_ratios
        damping = damping if np.iterable(damping) else [damping] * modes
        damping_ratios = _of_each("damping_ratios", "mode", damping, modes, 0.0)
        _check_orthonormal(shapes.T @ masses @ shapes)
        for name, value in (
            *(("masses", masses), ("frequencies", frequencies)),
            *(("damping_ratios", damping_ratios), ("shapes", shapes)),
        ):
            value.flags.writeable = False
            object.__setattr__(self, name, value)

    @classmethod
    def from_matrices(
        cls,
        mass: ArrayLike,
        stiffness: ArrayLike,
        damping_ratios: ArrayLike,
        modes: int | None = None,
    ) -> "ModalStructure":
        """Structure of the lowest modes of K phi = w^2 M phi.

        Parameters
        ----------
        mass : array_like
            Masses of the places [kg], shape (places,) or (places, places).
        stiffness : array_like
            Stiffness matrix with the base at rest [N/m], shape (places, places).
        damping_ratios : array_like
            Shares of critical damping, shape (modes,), or one number for all.
        modes : int, optional
            Number of modes; all if None.

        Returns
        -------
        ModalStructure
            The structure; the largest number of each shape is positive.

        Raises
        ------
        InputError
            The matrices do not fit, or the stiffness is not symmetric and positive definite.
        """
        m = _mass_matrix("mass", mass)
        k = _array("stiffness", stiffness, 2)
        if k.shape != m.shape:
            raise InputError(f"stiffness must be of shape {m.shape}, as mass, got {k.shape}")
        kept = len(m) if modes is None else whole("modes", modes, 1, len(m))
        _check_definite("stiffness", k)
        to_unit_mass = np.linalg.inv(np.linalg.cholesky(m))
        squares, vectors = np.linalg.eigh(to_unit_mass @ k @ to_unit_mass.T)
        shapes = (to_unit_mass.T @ vectors)[:, :kept]
        largest = shapes[np.abs(shapes).argmax(axis=0), range(kept)]
        frequencies = np.sqrt(squares[:kept]) / (2.0 * np.pi)
        damping: Any = damping_ratios
        return cls(m, frequencies, damping, shapes * np.sign(largest))

    def __repr__(self) -> str:
        low, high = self.frequencies.min(), self.frequencies.max()
        ends = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        size = f"{counted(self.place_count, 'place')}, {counted(self.mode_count, 'mode')}"
        return in_brief(self, size, f"{ends} Hz")

    @property
    def place_count(self) -> int:
        """Number of places."""
        return len(self.shapes)

    @property
    def mode_count(self) -> int:
        """Number of modes."""
        return self.shapes.shape[1]

    @property
    def participation(self) -> np.ndarray:
        """Share G of each mode in a translation of all places, (modes,) [kg^1/2]."""
        return self.shapes.T @ self.masses @ np.ones(self.place_count)

    @property
    def residual(self) -> np.ndarray:
        """Share r of the base's motion that no mode carries, (places,); 0 with all modes."""
        return 1.0 - self.shapes @ self.participation

    def recoil(self, place: int) -> float:
        """Speed that a unit impulse gives a place [1/kg].

        Parameters
        ----------
        place : int
            Number of the place, from 0.
        """
        row = self.shapes[whole("place", place, 0, self.place_count - 1)]
        return float(row @ row)

    def modal(self, motion: ArrayLike) -> np.ndarray:
        """Modal coordinates p [kg^1/2 m] of a motion of the places, shape (..., modes).

        Parameters
        ----------
        motion : array_like
            Displacements [m], shape (..., places).
        """
        return self._modal(real_numbers("motion", motion))

    def _modal(self, moved):
        """The same of an array, whose numbers need not be finite."""
        if moved.shape[-1:] != (self.place_count,):
            raise InputError(f"motion must have shape (..., {self.place_count}), got {moved.shape}")
        return moved @ self.masses @ self.shapes

    def transfer(self, frequency: ArrayLike, added_masses: object = None) -> np.ndarray:
        """Complex ratio x / y [-] of all places in the steady state, shape (..., places).

        Parameters
        ----------
        frequency : array_like
            Frequencies of the base [Hz], any shape.
        added_masses : array_like, optional
            Masses fixed to the places [kg], shape (places,).

        Raises
        ------
        InputError
            At the natural frequency of a mode without damping.
        """
        omega = 2.0 * np.pi * real_numbers("frequency", frequency)[..., None]
        added = np.zeros(self.place_count)
        if added_masses is not None:
            added = _of_each("added_masses", "place", added_masses, self.place_count, 0.0)
        held = (2.0 * np.pi * self.frequencies) ** 2 + 1j * omega * self._damping
        pull = held * self.participation + omega**2 * (self.shapes.T @ (added * self.residual))
        more = (self.shapes.T * added) @ self.shapes
        own = (held - omega**2)[..., None] * np.eye(self.mode_count)
        matrix = own - omega[..., None] ** 2 * more
        if not self.damping_ratios.all():
            # Each mode by its own scale, so that only one without damping is out of bounds.
            scale = 1.0 / np.hypot(2.0 * np.pi * self.frequencies, omega)
            scaled = matrix * scale[..., None] * scale[..., None, :]
            check_steady("a structure", np.linalg.cond(scaled), frequency)
        moved = np.linalg.solve(matrix, pull[..., None])[..., 0] @ self.shapes.T
        return moved + self.residual

    @property
    def _damping(self) -> np.ndarray:
        return 4.0 * np.pi * self.damping_ratios * self.frequencies


@dataclass(frozen=True)
class Box:
    """A container with particles, of the size of its filling, at a place of a structure.

    The mass of the box itself is part of the masses of the structure.

    Parameters
    ----------
    place : int
        Number of the place, from 0.
    particles : int
        Number of particles.
    seed : int, optional
        Number that starts its particles, with the seed of the run. None: its number in the list.
    filling : Filling, optional
        Its own filling, of the class, rules and effects of the others. None: that of the run.
    """

    place: int
    particles: int
    seed: int | None = None
    filling: Filling | None = None

    def __post_init__(self) -> None:
        for name, most in (("place", MOST_PLACES - 1), ("particles", 2**31 - 1)):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0, most))
        if self.seed is not None:
            object.__setattr__(self, "seed", whole("seed", self.seed, 0, 1_000_000))
        if self.filling is not None:
            check_filling(self.filling)


def _array(name: str, value: object, axes: int, least: float = -LARGEST) -> np.ndarray:
    """Numbers with so many axes; InputError for others."""
    numbers = real_numbers(name, value, least)
    if numbers.ndim != axes or not numbers.size:
        kind = "a list of numbers" if axes == 1 else "a matrix of numbers"
        raise InputError(f"{name} must be {kind}, got {shown(value)}")
    return numbers


def _of_each(name: str, owner: str, value: object, count: int, least: float) -> np.ndarray:
    """A number of each of so many owners, (count,), none below the least; InputError."""
    numbers = _array(name, value, 1, least)
    if len(numbers) != count:
        wanted = counted(count, "number")
        raise InputError(f"{name} must be {wanted}, one for each {owner}, got {shown(value)}")
    return numbers


def _mass_matrix(name: str, value: object) -> np.ndarray:
    """Matrix of masses given as that or as its diagonal; InputError unless it is positive."""
    numbers = real_numbers(name, value)
    if len(np.atleast_1d(numbers)) > MOST_PLACES:
        raise InputError(f"{name} must be of at most {MOST_PLACES} places, got {len(numbers)}")
    if numbers.ndim == 1:
        return np.diag(_array(name, numbers, 1, SMALLEST))
    _check_definite(name, _array(name, numbers, 2))
    return numbers


def _check_definite(name: str, matrix: np.ndarray) -> None:
    """InputError unless a matrix is square, symmetric and positive definite."""
    rows, columns = matrix.shape
    if rows != columns:
        raise InputError(f"{name} must be a square matrix, got {rows} x {columns} numbers")
    uneven = float(np.abs(matrix - matrix.T).max())
    if uneven > _SYMMETRIC_TO * np.abs(matrix).max():
        raise InputError(f"{name} must be a symmetric matrix, got one that is off by {uneven:g}")
    # Scaled to a diagonal of ones, so that units and unequal places do not count.
    diagonal = np.diag(matrix)
    least = float(diagonal.min())
    if least > 0.0:
        scale = 1.0 / np.sqrt(diagonal)
        least = float(np.linalg.eigvalsh(matrix * scale[:, None] * scale)[0])
    if least <= 1e-13:
        raise InputError(
            f"{name} must be a positive definite matrix, got one whose least eigenvalue, scaled to "
            f"a diagonal of ones, is {least:.3g}"
        )


def _check_orthonormal(products: np.ndarray) -> None:
    """InputError unless phi^T M phi is the unit matrix, with the product that is worst."""
    wrong = np.abs(products - np.eye(len(products)))
    i, j = sorted(map(int, np.unravel_index(wrong.argmax(), wrong.shape)))
    if not wrong[i, j] <= ORTHONORMAL_TO:
        raise InputError(
            f"shapes must be orthonormal, shapes^T masses shapes = 1 within {ORTHONORMAL_TO:g}, "
            f"got {products[i, j]:.6g} for modes {i} and {j}"
        )
