"""Mesh of tetrahedra with named groups; x points to the right, y up, z towards the viewer."""

import os
from collections.abc import Mapping
from dataclasses import InitVar, dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import flag, fraction, instance, shown
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.check import checked_arrays, checked_body_groups, joined_bodies
from taichi_dem.mesh.mesh_methods import MeshMethods


@dataclass(frozen=True, eq=False)
class Mesh(MeshMethods):
    """Tetrahedra and named groups of faces; immutable.

    Made from arrays it is checked and mended as ``checked_mesh`` says; ``dataclasses.replace``
    gives another mesh.

    Parameters
    ----------
    points : ndarray
        Coordinates [m], shape (point_count, 3).
    tetrahedra : ndarray
        Point indices, shape (body_count, 4), all of positive volume.
    groups : mapping
        Point indices (n, 3) by name: of outer faces with normals outward, or of inner faces that
        two bodies share.
    notes : tuple of str, default ()
        Sentences about what the checks repaired or found remarkable.
    source : str, default ""
        Name of the file; ``""`` for a mesh built in memory.
    keep_coincident : bool, default False
        Whether points that coincide stay apart, and with them the faces on them, as at a joint or a
        crack.
    body_groups : mapping, optional
        Numbers of bodies (n,) by name, in rising order, as for ``Scene(materials=...)``.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.

    Attributes
    ----------
    bonded_shares : tuple of (str, float)
        Inner groups and the share of the area of their faces that is bonded, 0 for none; a Scene
        sets them.
    inner_groups : tuple of str
        Names of the groups of inner faces.

    Raises
    ------
    InputError
        The arrays are such as ``checked_mesh`` refuses.

    Examples
    --------
    >>> mesh = read_mesh(PAPER_BLOCK)
    >>> mesh.body_count, sorted(mesh.groups)[:2]
    (966, ['back', 'bottom'])
    """

    points: np.ndarray
    tetrahedra: np.ndarray
    groups: Mapping[str, np.ndarray]
    notes: tuple[str, ...] = ()
    source: str = ""
    keep_coincident: bool = False
    body_groups: Mapping[str, np.ndarray] = field(default_factory=dict)
    weld_tolerance: InitVar[float] = 0.0

    def __post_init__(self, weld_tolerance: float) -> None:
        flag("keep_coincident", self.keep_coincident)
        notes = list(instance("notes", self.notes, tuple))
        instance("source", self.source, (str, os.PathLike))
        kept = weld_tolerance, self.keep_coincident
        arrays = checked_arrays(self.points, self.tetrahedra, self.groups, *kept, notes)
        parts = len(np.unique(joined_bodies(arrays[1])))
        if parts > 1:
            notes.append(f"the mesh has {parts} parts that share no face with each other")
        bodies = checked_body_groups(self.body_groups, len(arrays[1]))
        names = "points", "tetrahedra", "groups", "inner_groups", "body_groups", "notes"
        found = zip(names, (*arrays, bodies, tuple(dict.fromkeys(notes))))
        self.__setstate__({**vars(self), **dict(found)})

    #: Not among the options: see ``bonded_by``.
    bonded_shares: ClassVar[tuple[tuple[str, float], ...]] = ()
    inner_groups: ClassVar[tuple[str, ...]] = ()

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "groups": dict(self.groups), "body_groups": dict(self.body_groups)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        groups, body_groups = state["groups"], state["body_groups"]
        held = state["points"], state["tetrahedra"], *groups.values(), *body_groups.values()
        for array in held:
            array.setflags(write=False)
        read_only = {
            "groups": MappingProxyType(groups),
            "body_groups": MappingProxyType(body_groups),
        }
        self.__dict__.update({**state, **read_only})

    def __repr__(self):
        groups = f"groups {', '.join(self.groups)}" if self.groups else "no groups"
        bodies, points = counted(self.body_count, "body"), counted(self.point_count, "point")
        parts = [note for note in self.notes if note.startswith("the mesh has")]
        notes = f"{counted(len(self.notes), 'note')} (.notes)" if self.notes else ""
        return in_brief(self, bodies, points, *parts, notes, groups, self.source)

    @property
    def body_count(self) -> int:
        """Number of tetrahedra."""
        return len(self.tetrahedra)

    @property
    def point_count(self) -> int:
        """Number of points."""
        return len(self.points)

    def group_faces(self, name: str) -> np.ndarray:
        """Faces of a group.

        Parameters
        ----------
        name : str
            Name of the group.

        Returns
        -------
        ndarray
            Point indices, shape (n, 3).

        Raises
        ------
        InputError
            There is no such group.
        """
        return self._members("face", self.groups, name)

    def group_bodies(self, name: str) -> np.ndarray:
        """Bodies of a group.

        Parameters
        ----------
        name : str
            Name of the body group.

        Returns
        -------
        ndarray
            Numbers of bodies, shape (n,).

        Raises
        ------
        InputError
            There is no such group.
        """
        return self._members("body", self.body_groups, name)

    def _members(self, kind, groups, name):
        if isinstance(name, str) and name in groups:
            return groups[name]
        known = ", ".join(sorted(groups)) or "none"
        raise InputError(f"mesh has no {kind} group {shown(name)}; its {kind} groups are: {known}")

    def bonded_by(self, shares: Mapping[str, float]) -> "Mesh":
        """Return the mesh with only a share of the area of some inner faces bonded.

        Parameters
        ----------
        shares : mapping
            Share by the name of an inner group, from 0 (no bond) to 1; the smallest counts where a
            face is in several groups.

        Returns
        -------
        Mesh
            The mesh with its ``bonded_shares``.

        Raises
        ------
        InputError
            A group is not there, or is of outer faces, or a share lies outside [0, 1].
        """
        if not instance("shares", shares, Mapping) and not self.bonded_shares:
            return self
        for name, share in shares.items():
            self.group_faces(name)
            fraction(f"share of group {name}", share)
            if name not in self.inner_groups:
                raise InputError(
                    f"group {name} must be of inner faces, which two bodies share, to be unbonded "
                    "or bonded weaker, got one of outer faces"
                )
        made = object.__new__(Mesh)
        made.__dict__.update({**vars(self), "bonded_shares": tuple(sorted(shares.items()))})
        return made

    @property
    def has_open_faces(self) -> bool:
        """Whether faces may lie on each other that no bond joins."""
        return self.keep_coincident or any(share == 0.0 for _, share in self.bonded_shares)


def volumes(mesh: Mesh) -> np.ndarray:
    """Volumes of the bodies [m3], shape (body_count,)."""
    return geometry.signed_volumes(mesh.points, mesh.tetrahedra)


def checked_mesh(
    points: ArrayLike,
    tetrahedra: ArrayLike,
    groups: Mapping[str, ArrayLike],
    weld_tolerance: float = 0.0,
    keep_coincident: bool = False,
    *,
    body_groups: Mapping[str, ArrayLike] | None = None,
) -> Mesh:
    """Build a Mesh from arrays; repair and report small defects, refuse others.

    Parameters
    ----------
    points : array_like
        Coordinates [m], shape (n, 3).
    tetrahedra : array_like
        Point indices, shape (m, 4), in either orientation.
    groups : mapping
        Point indices (k, 3) by name, in either orientation: of outer faces, or of inner ones that
        two bodies share.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.
    keep_coincident : bool, default False
        Accept distinct points at one place. Faces on them are free surfaces, as of two blocks that
        touch, a joint or a crack, and meet by the contact of outer faces. Without it such points
        are refused, as bodies that seem joined there would not be bonded.
    body_groups : mapping, optional
        Numbers of tetrahedra (k,) by name.

    Returns
    -------
    Mesh
        The checked mesh; its ``notes`` say what was repaired.

    Raises
    ------
    InputError
        A defect cannot be repaired; the sentence has the numbers, counted from 0.

    Notes
    -----
    Repaired are negative volumes, points without a tetrahedron, and faces twice in a group.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> checked_mesh(corners, [[0, 1, 2, 3]], {"base": [[0, 1, 2]]}).body_count
    1
    """
    made: Any = Mesh
    options = {"weld_tolerance": weld_tolerance, "keep_coincident": keep_coincident}
    bodies = {} if body_groups is None else body_groups
    return made(points, tetrahedra, groups, body_groups=bodies, **options)
