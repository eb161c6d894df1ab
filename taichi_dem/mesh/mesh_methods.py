"""Methods of a mesh that give another mesh, or a picture of it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from taichi_dem.kit import pictures
from taichi_dem.kit.display import embedded, titled
from taichi_dem.kit.validation import FileName, direction

if TYPE_CHECKING:
    from taichi_dem.mesh.mesh import Mesh

#: Digits of the entries of a rotation: those that every machine's sine agrees on.
_DIGITS = 15


class MeshMethods:
    """What ``Mesh`` inherits."""

    def group(self, name: str, chosen: Callable[[np.ndarray], Any]) -> "Mesh":
        """Return the mesh with one more group: outer faces chosen by their centres.

        Parameters
        ----------
        name : str
            Name of the new group.
        chosen : callable
            Function of the centres of all outer faces [m], (n, 3), that returns n truth values.

        Returns
        -------
        Mesh
            The mesh with the group.

        Raises
        ------
        InputError
            The name is taken, no face is chosen, or other values are returned.

        Examples
        --------
        >>> mesh = read_mesh(PAPER_BLOCK).group("high", lambda x: x[:, 1] > 1.9)
        >>> "high" in mesh.groups
        True
        """
        from taichi_dem.mesh.face_groups import with_outer_group

        mesh: Any = self
        return with_outer_group(mesh, name, chosen)

    def body_group(self, name: str, chosen: Callable[[np.ndarray], Any]) -> "Mesh":
        """Return the mesh with one more group of bodies, chosen by their centres.

        Parameters
        ----------
        name : str
            Name of the new group.
        chosen : callable
            Function of the centres of all bodies [m], (n, 3), that returns n truth values.

        Returns
        -------
        Mesh
            The mesh with the group.

        Raises
        ------
        InputError
            The name is taken, no body is chosen, or other values are returned.
        """
        from taichi_dem.mesh.face_groups import with_body_group

        mesh: Any = self
        return with_body_group(mesh, name, chosen)

    def moved(
        self,
        *,
        by: Sequence[float] = (0.0, 0.0, 0.0),
        turned: Sequence[float] = (0.0, 0.0, 0.0),
        about: Optional[Sequence[float]] = None,
    ) -> "Mesh":
        """Return the mesh at another place: turned, then shifted.

        Parameters
        ----------
        by : sequence of float, default (0.0, 0.0, 0.0)
            Shift [m].
        turned : sequence of float, default (0.0, 0.0, 0.0)
            Vector along the axis of the turn, right-handed, and as long as its angle [degrees]:
            (0, 0, 90) turns x into y.
        about : sequence of float, optional
            Point on the axis [m]; the middle of the mesh's box by default.

        Returns
        -------
        Mesh
            The moved mesh, with the same groups.

        Raises
        ------
        InputError
            A value is not three finite numbers.
        """
        from dataclasses import replace

        mesh: Any = self
        shift, turn = np.array(direction("by", by)), _rotation(direction("turned", turned))
        low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
        origin = 0.5 * (low + high) if about is None else np.array(direction("about", about))
        points = mesh.points
        if any(turned):
            points = origin + ((points - origin)[:, None, :] * turn).sum(axis=2)
        return replace(mesh, points=points + shift)

    def picture(self, path: FileName) -> None:
        """Write a PNG picture of the outer faces, coloured by group, with axes in m.

        Parameters
        ----------
        path : path
            File; its name ends in .png.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        pictures.write_picture(self, path)

    def _repr_html_(self) -> str:
        return titled(repr(self), embedded(pictures.png(self), "The mesh, coloured by group"))


def _rotation(turned):
    """Rotation matrix of a vector in degrees: cos 1 + sin [n x] + (1 - cos) n n^T."""
    angle = float(np.sqrt(np.square(turned).sum()))
    if angle == 0.0:
        return np.eye(3)
    axis, radians = np.array(turned) / angle, np.radians(angle % 360.0)
    cross = np.cross(np.eye(3), axis)
    cos, sin = np.cos(radians), np.sin(radians)
    made = cos * np.eye(3) + sin * cross + (1.0 - cos) * axis[:, None] * axis[None, :]
    return np.round(made, _DIGITS)
