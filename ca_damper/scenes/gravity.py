"""Gravity on the particles: one number downwards, or two for a tilted or horizontal box."""

from typing import Any

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import LARGEST, finite, positive, shown


def gravity_along(filling: object) -> float:
    """Gravity of a filling along the motion of the container, downwards [m/s^2]."""
    return float(filling.gravity[1] if isinstance(filling.gravity, tuple) else filling.gravity)


def gravity_across(filling: object) -> float:
    """Gravity of a filling across the motion, to the right [m/s^2]."""
    return float(filling.gravity[0]) if isinstance(filling.gravity, tuple) else 0.0


def checked_gravity(value: object) -> Any:
    """One number [m/s^2], or two as a tuple; InputError for anything else."""
    if not isinstance(value, (tuple, list)):
        return positive("gravity", value, zero_allowed=True)
    if len(value) != 2 or not all(finite(x) and abs(float(x)) <= LARGEST for x in value):
        raise InputError(
            "gravity must be one number, or two finite ones (to the right, downwards) of at most "
            f"{LARGEST:g}, got {shown(value)}"
        )
    return tuple(float(x) for x in value)
