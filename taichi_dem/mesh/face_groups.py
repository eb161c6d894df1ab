"""Groups chosen by where they are: faces for loads, supports, notches; bodies (NumPy only)."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Callable, Optional

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot
from taichi_dem.kit.validation import direction, instance, shown, unit_vector, word
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh

#: Given the centres of faces or bodies [m], (n, 3), whether each is chosen, (n,).
Choice = Callable[[np.ndarray], Any]


def with_outer_group(mesh: Mesh, name: str, chosen: Choice) -> Mesh:
    """The mesh with one more group: outer faces chosen by their centres.

    chosen: a function of the centres [m], (n, 3), that returns n truth values, as ``lambda x: x[:,
    1] > 0.5``. Raises InputError for a name that is taken, a choice of no face, or other values.
    """
    faces = geometry.all_faces(instance("mesh", mesh, Mesh).tetrahedra)
    outer = faces[geometry.outer_rows(faces)]
    return _with_group(mesh, name, outer[_choose(mesh, outer, chosen)])


def with_body_group(mesh: Mesh, name: str, chosen: Choice) -> Mesh:
    """Return the mesh with one more group of bodies, chosen by their centres.

    Parameters
    ----------
    mesh : Mesh
        Mesh.
    name : str
        Name of the new group, as for ``Scene(materials={name: ...})``.
    chosen : callable
        Function of the centres of the bodies [m], shape (body_count, 3), that returns body_count
        truth values.

    Returns
    -------
    Mesh
        The mesh with this group in its ``body_groups``.

    Raises
    ------
    InputError
        The name is taken, no body is chosen, or the function returns other values.

    Examples
    --------
    >>> mesh = with_body_group(read_mesh(PAPER_BLOCK), "upper", lambda x: x[:, 1] > 1.0)
    >>> mesh.group_bodies("upper").size > 0
    True
    """
    if word("name", name) in instance("mesh", mesh, Mesh).body_groups:
        raise InputError(f"name must be that of a new group, got {shown(name)}, which is there")
    bodies = np.flatnonzero(_choose(mesh, mesh.tetrahedra, chosen, "bodies"))
    if not len(bodies):
        raise InputError(f"group {name} must have at least one body, but none was chosen")
    return replace(mesh, body_groups={**mesh.body_groups, name: bodies})


def with_inner_group(mesh: Mesh, name: str, chosen: Choice) -> Mesh:
    """The mesh with one more group: faces between two bodies chosen by their centres.

    ``Scene(unbonded=[name])`` makes a notch or an open joint of it. chosen, errors: as for
    ``with_outer_group``.
    """
    inner = _inner_faces(mesh)[0]
    return _with_group(mesh, name, inner[_choose(mesh, inner, chosen)])


def with_cut(
    mesh: Mesh,
    name: str,
    point: Sequence[float],
    normal: Sequence[float],
    chosen: Optional[Choice] = None,
) -> Mesh:
    """The mesh with one more group: the faces along which a plane divides the bodies.

    Those between a body whose centre lies behind the plane and one that lies before it, so that no
    bond is left across: as rough as the mesh is, and flat where faces lie in the plane. point [m]
    and normal: of the plane. chosen: which of them, by the centres of the faces, as for
    ``with_outer_group``; None for all. Raises InputError as that, and for a normal of zero.
    """
    origin, along = np.array(direction("point", point)), unit_vector("normal", normal)
    inner, bodies = _inner_faces(mesh)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    before = dot(centre - origin, along) > 0.0
    faces = inner[before[bodies[:, 0]] != before[bodies[:, 1]]]
    if chosen is not None:
        faces = faces[_choose(mesh, faces, chosen)]
    return _with_group(mesh, name, faces)


def _inner_faces(mesh):
    """Faces between two bodies, (n, 3), and these bodies, (n, 2)."""
    rows = geometry.shared_faces(mesh.tetrahedra)
    return geometry.all_faces(mesh.tetrahedra)[rows[:, 0]], rows // 4


def _choose(mesh, corners, chosen, what="faces"):
    """Which faces or bodies, given by their corners, a choice takes, (n,)."""
    centres = mesh.points[corners].mean(axis=1)
    if not callable(chosen):
        raise InputError(f"chosen must be a function of centres of {what}, got {shown(chosen)}")
    found = np.asarray(chosen(centres))
    if found.shape != (len(corners),) or found.dtype != bool:
        raise InputError(
            f"chosen must return one truth value for each of {len(corners)} {what}, got an "
            f"array of {found.dtype} of shape {found.shape}"
        )
    return found


def _with_group(mesh, name, faces):
    if word("name", name) in mesh.groups:
        raise InputError(f"name must be that of a new group, got {shown(name)}, which is there")
    if not len(faces):
        raise InputError(f"group {name} must have at least one face, but none was chosen")
    return replace(mesh, groups={**mesh.groups, name: faces})
