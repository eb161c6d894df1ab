"""Groups of inner faces chosen by where they are, for notches and joints (NumPy only)."""

from collections.abc import Sequence

import numpy as np

from taichi_dem.kit.fixed_order import dot
from taichi_dem.kit.validation import direction, unit_vector
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.mesh_methods import Choice, choose, with_group


def with_inner_group(mesh: Mesh, name: str, chosen: Choice) -> Mesh:
    """The mesh with one more group: faces between two bodies chosen by their centres.

    ``Scene(unbonded=[name])`` makes a notch or an open joint of it. chosen, errors: as for
    ``Mesh.group``.
    """
    inner = _inner_faces(mesh)[0]
    return with_group(mesh, "groups", name, inner[choose(mesh, inner, chosen)])


def with_cut(
    mesh: Mesh,
    name: str,
    point: Sequence[float],
    normal: Sequence[float],
    chosen: Choice | None = None,
) -> Mesh:
    """The mesh with one more group: the faces along which a plane divides the bodies.

    Those between a body whose centre lies behind the plane and one that lies before it, so that no
    bond is left across: as rough as the mesh is, and flat where faces lie in the plane. point [m]
    and normal: of the plane. chosen: which of them, by the centres of the faces, as for
    ``Mesh.group``; None for all. Raises InputError as that, and for a normal of zero.
    """
    origin, along = np.array(direction("point", point)), unit_vector("normal", normal)
    inner, bodies = _inner_faces(mesh)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    before = dot(centre - origin, along) > 0.0
    faces = inner[before[bodies[:, 0]] != before[bodies[:, 1]]]
    if chosen is not None:
        faces = faces[choose(mesh, faces, chosen)]
    return with_group(mesh, "groups", name, faces)


def _inner_faces(mesh):
    """Faces between two bodies, (n, 3), and these bodies, (n, 2)."""
    rows = geometry.shared_faces(mesh.tetrahedra)
    return geometry.all_faces(mesh.tetrahedra)[rows[:, 0]], rows // 4
