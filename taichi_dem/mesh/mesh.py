"""Mesh of tetrahedra with named groups; x points to the right, y up, z towards the viewer."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Optional

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import FileName, flag, fraction, instance, path_name, shown
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.check import checked_arrays, checked_body_groups, joined_bodies
from taichi_dem.mesh.mesh_methods import MeshMethods

#: First words of the notes on what has been mended.
_MENDING = ("welded", "dropped", "turned")


@dataclass(frozen=True, eq=False)
class Mesh(MeshMethods):
    """Tetrahedra and named groups of faces, as ``checked_mesh`` makes them; immutable.

    Made directly from arrays, a mesh is checked alike but not repaired. ``dataclasses.replace``
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
    unread : tuple of str, default ()
        Names of the groups of the file that are neither of faces nor of bodies.
    keep_coincident : bool, default False
        Whether points that coincide stay apart, and with them the faces on them, as at a joint or a
        crack.
    body_groups : mapping, optional
        Numbers of bodies (n,) by name, in rising order, as for ``Scene(materials=...)``.

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
        The arrays are such as ``checked_mesh`` would refuse or repair.

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
    unread: tuple[str, ...] = ()
    keep_coincident: bool = False
    body_groups: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        notes: list[str] = []
        flag("keep_coincident", self.keep_coincident)
        for name in ("notes", "unread"):
            instance(name, getattr(self, name), tuple)
        instance("source", self.source, (str, os.PathLike))
        self._hold(self.points, self.tetrahedra, self.groups, self.body_groups, 0.0, notes)
        mended = [note for note in notes if note.split()[0] in _MENDING]
        if mended:
            raise InputError(f"a Mesh takes what checked_mesh gives, which here {mended[0]}")

    #: Not among the options: see ``bonded_by``.
    bonded_shares: ClassVar[tuple[tuple[str, float], ...]] = ()
    inner_groups: ClassVar[tuple[str, ...]] = ()

    def _hold(self, points, tetrahedra, groups, body_groups, tolerance, notes):
        """Keep checked arrays; notes: a list to which sentences on repairs are added."""
        arrays = checked_arrays(points, tetrahedra, groups, tolerance, self.keep_coincident, notes)
        names = "points", "tetrahedra", "groups", "inner_groups", "body_groups"
        bodies = checked_body_groups(body_groups, len(arrays[1]))
        self.__setstate__({**vars(self), **dict(zip(names, (*arrays, bodies)))})

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
        return self._members("face", self.groups, name, (*self.body_groups, *self.unread))

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
        return self._members("body", self.body_groups, name, self.groups)

    def _members(self, kind, groups, name, others):
        if isinstance(name, str) and name in groups:
            return groups[name]
        known = ", ".join(sorted(groups)) or "none"
        why = (
            f" ({name} is one of another kind)" if isinstance(name, str) and name in others else ""
        )
        raise InputError(
            f"mesh has no {kind} group {shown(name)}{why}; its {kind} groups are: {known}"
        )

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
    source: FileName = "",
    weld_tolerance: float = 0.0,
    keep_coincident: bool = False,
    *,
    body_groups: Optional[Mapping[str, ArrayLike]] = None,
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
    source : path, default ""
        Name of the file.
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
    notes: list[str] = []
    flag("keep_coincident", keep_coincident)
    if source != "":
        path_name("source", source)
    made = object.__new__(Mesh)
    made.__dict__.update(source=str(source), unread=(), keep_coincident=keep_coincident)
    bodies = {} if body_groups is None else body_groups
    made._hold(points, tetrahedra, groups, bodies, weld_tolerance, notes)
    parts = len(np.unique(joined_bodies(made.tetrahedra)))
    if parts > 1:
        notes.append(f"the mesh has {parts} parts that share no face with each other")
    made.__dict__.update(notes=tuple(notes))
    return made
