"""Methods of a mesh that give another mesh, or a picture of it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from taichi_dem.kit import pictures
from taichi_dem.kit.display import embedded, titled
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, direction, shown, word
from taichi_dem.mesh import tetrahedra as geometry

#: Given the centres of faces or bodies [m], (n, 3), whether each is chosen, (n,).
Choice = Callable[[np.ndarray], Any]
#: A mesh.
Made = TypeVar("Made", bound="MeshMethods")
#: Digits of the entries of a rotation: those that every machine's sine agrees on.
_DIGITS = 15


class MeshMethods:
    """What ``Mesh`` inherits."""

    def group(self: Made, name: str, chosen: Choice) -> Made:
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
        mesh: Any = self
        outer = geometry.outer_faces(mesh.tetrahedra)
        return with_group(mesh, "groups", name, outer[choose(mesh, outer, chosen)])

    def body_group(self: Made, name: str, chosen: Choice) -> Made:
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
        mesh: Any = self
        bodies = np.flatnonzero(choose(mesh, mesh.tetrahedra, chosen, "bodies"))
        return with_group(mesh, "body_groups", name, bodies)

    def moved(
        self: Made,
        *,
        by: Sequence[float] = (0.0, 0.0, 0.0),
        turned: Sequence[float] = (0.0, 0.0, 0.0),
        about: Sequence[float] | None = None,
    ) -> Made:
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


def choose(mesh: Any, corners: np.ndarray, chosen: Choice, what: str = "faces") -> np.ndarray:
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


def with_group(mesh: Any, kind: str, name: str, members: np.ndarray) -> Any:
    """The mesh with one more of its "groups" of faces or "body_groups"."""
    groups = getattr(mesh, kind)
    if word("name", name) in groups:
        raise InputError(f"name must be that of a new group, got {shown(name)}, which is there")
    if not len(members):
        raise InputError(f"group {name} must have at least one member, but none was chosen")
    return replace(mesh, **{kind: {**groups, name: members}})
