"""Tetrahedra that cannot be those of a solid, as they repeat or lie in each other (NumPy only)."""

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh import tetrahedra as geometry


def refuse_bad_sharing(tetrahedra: np.ndarray) -> None:
    """Refuse repeated bodies, faces of three bodies and bodies that lie in each other.

    tetrahedra: (m, 4). Raises InputError.
    """
    _, number, count = np.unique(
        np.sort(tetrahedra, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    repeated = np.flatnonzero(count[number.reshape(-1)] > 1)
    if len(repeated):
        twins = np.flatnonzero(number.reshape(-1) == number.reshape(-1)[repeated[0]])
        raise InputError(f"tetrahedra {_listed(twins)} have the same four points")
    face = geometry.face_numbers(geometry.all_faces(tetrahedra))
    crowded = np.flatnonzero(np.bincount(face) > 2)
    if len(crowded):
        owners = np.flatnonzero(face == crowded[0]) // 4
        raise InputError(
            f"tetrahedra {_listed(owners)} share one face; at most two may "
            f"({len(crowded)} such faces)"
        )
    _refuse_overlap(tetrahedra)


def _refuse_overlap(tetrahedra):
    """Refuse two bodies on the same side of their shared face."""
    rows = geometry.shared_faces(tetrahedra)
    first, second = (geometry.all_faces(tetrahedra)[rows[:, side]] for side in (0, 1))
    start = np.argmax(second == first[:, :1], axis=1)
    following = np.take_along_axis(second, ((start + 1) % 3)[:, None], axis=1)[:, 0]
    bad = np.flatnonzero(following == first[:, 1])
    if len(bad):
        raise InputError(
            f"tetrahedra {_listed(rows[bad[0]] // 4)} lie on the same side of the face they share"
        )


def _listed(numbers):
    """Numbers as "3, 5 and 9"."""
    words = [str(int(k)) for k in numbers]
    return " and ".join([", ".join(words[:-1]), words[-1]])
