"""Named groups of bodies: checked and renumbered (NumPy only)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown, word


def checked_body_groups(groups: Any, body_count: int) -> dict[str, np.ndarray]:
    """Groups of bodies with each body once, in rising order.

    groups: name -> numbers of bodies. Raises InputError for another kind of object, an empty group,
    or what is no number of a body.
    """
    if not isinstance(groups, Mapping):
        raise InputError(f"body_groups must be a dict of name to bodies, got {shown(groups)}")
    return {
        word("name of a body group", name): _checked_bodies(name, bodies, body_count)
        for name, bodies in groups.items()
    }


def _checked_bodies(name, bodies, body_count):
    try:
        found = np.asarray(bodies)
    except ValueError:
        found = np.zeros(0)
    if found.ndim != 1 or not found.size or found.dtype.kind not in "iu":
        raise InputError(
            f"body group {name!r} must be a list of at least one body number, got {shown(bodies)}"
        )
    low, high = int(found.min()), int(found.max())
    if low < 0 or high >= body_count:
        wrong = low if low < 0 else high
        raise InputError(
            f"body group {name!r} must hold body numbers from 0 to {body_count - 1}, got {wrong}"
        )
    return np.unique(found).astype(np.int32)


def renumbered(groups: Mapping[str, np.ndarray], order: np.ndarray) -> dict[str, np.ndarray]:
    """Groups of the bodies that have been put in an order: ``order[k]`` is now number k."""
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return {name: place[bodies] for name, bodies in groups.items()}
