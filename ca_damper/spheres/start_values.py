"""Checks of places and velocities of single spheres at the start."""

from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, real_numbers, shown, whole

# Sizes have a contact law for each pair of them.
_MOST_SIZES, _MOST_OF_A_SIZE = 8, 1_000_000
# Room that rounding may take from spheres that touch exactly.
_ROUNDING = 1e-9


def checked_start(options: Any) -> tuple:
    """Places as a tuple of pairs, none in a wall or in another sphere."""
    places = _pairs("start", options.start, options.capacity)
    radius, slack = _radii(options, len(places))[:, None], _ROUNDING * options.diameter
    inside = places >= radius - slack
    inside &= places <= np.array([options.width, options.height]) - radius + slack
    if not inside.all():
        k = int(np.flatnonzero(~inside.all(axis=1))[0])
        raise InputError(f"start must keep spheres off the walls, got {places[k]} for number {k}")
    gaps = np.linalg.norm(places[:, None] - places[None, :], axis=2)
    near = np.argwhere(np.triu(gaps < radius + radius.T - slack, 1))
    if len(near):
        raise InputError(f"start must not let spheres overlap, numbers {near[0]} do")
    return tuple(map(tuple, places.tolist()))


def checked_start_velocity(options: Any) -> tuple:
    """Velocities as a tuple of pairs."""
    velocity = _pairs("start_velocity", options.start_velocity, options.capacity)
    return tuple(map(tuple, velocity.tolist()))


def checked_sizes(sizes: Any) -> tuple:
    """Pairs of a number and a diameter; InputError for anything else."""
    try:
        pairs = tuple((number, diameter) for number, diameter in sizes)
    except (TypeError, ValueError):
        pairs = ()
    if not 1 <= len(pairs) <= _MOST_SIZES:
        raise InputError(
            f"sizes must hold a number and a diameter [m] for each of 1 to {_MOST_SIZES} sizes, "
            f"got {shown(sizes)}"
        )
    return tuple(
        (whole("number in sizes", number, 1, _MOST_OF_A_SIZE), positive("diameter in sizes", size))
        for number, size in pairs
    )


def _radii(options: Any, count: int) -> np.ndarray:
    if options.sizes is None:
        return np.full(count, options.radius)
    numbers = [number for number, _ in options.sizes]
    if sum(numbers) != count:
        raise InputError(
            f"start must hold {sum(numbers)} places, as many as there are in sizes, got {count}"
        )
    return np.repeat(options.radii, numbers)


def _pairs(name: str, value: Any, most: int) -> np.ndarray:
    """Two numbers for each of at most so many spheres, (spheres, 2)."""
    pairs = real_numbers(name, value)
    if pairs.size and (pairs.ndim != 2 or pairs.shape[1] != 2):
        raise InputError(f"{name} must hold two numbers for each sphere, got {shown(value)}")
    whole(f"spheres in {name}", len(pairs), 0, most)
    return pairs.reshape(-1, 2)
