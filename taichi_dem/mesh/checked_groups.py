"""Face groups of a mesh checked: outer faces, or inner ones that two bodies share (NumPy only)."""

from collections.abc import Mapping

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.mesh import tetrahedra as geometry


def checked_groups(
    tetrahedra: np.ndarray, groups: Mapping[str, np.ndarray], notes: list[str]
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Groups with each face once, and the names of those of inner faces.

    tetrahedra: (m, 4). groups: name -> (n, 3) point numbers in any order. notes: a list to which
    sentences on what was dropped are added. Faces are ordered by their bodies, and look outward, an
    inner one out of the body of lower index.
    Raises InputError for a group with faces that are none, or with some of both kinds.
    """
    faces = geometry.all_faces(tetrahedra)
    names = list(groups)
    number = geometry.face_numbers(np.vstack([faces, *(groups[name] for name in names)]))
    count = np.bincount(number[: len(faces)], minlength=number.max() + 1)
    row_of = np.full(len(count), -1)
    row_of[number[: len(faces)][::-1]] = np.arange(len(faces))[::-1]
    result, inner, start = {}, [], len(faces)
    for name in names:
        mine = number[start : start + len(groups[name])]
        start += len(mine)
        if (count[mine] == 2).all():
            inner.append(name)
        else:
            _refuse_inner(name, count[mine])
        result[name] = faces[_once(name, row_of[mine], notes)]
    return result, tuple(inner)


def _refuse_inner(name, bodies):
    """Refuse a group with faces that are not outer ones; bodies: how many each has."""
    wrong = int(np.sum(bodies != 1))
    if wrong:
        raise InputError(
            f"group {name!r}: {wrong} of its {len(bodies)} faces are not outer faces of the mesh, "
            "as those of a group must be unless two bodies share each of them"
        )


def _once(name, rows, notes):
    """Faces of one group, each once, in the order of the bodies."""
    once = np.unique(rows)
    if len(once) < len(rows):
        notes.append(f"dropped {len(rows) - len(once)} repeated faces of group {name!r}")
    return once
