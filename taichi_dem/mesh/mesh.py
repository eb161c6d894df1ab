"""Mesh of tetrahedra with named groups of faces, checked once at the border.

x points to the right, y up, z towards the viewer.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Optional

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import (
    FileName,
    flag,
    fraction,
    instance,
    path_name,
    shown,
    told_apart,
    word,
)
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.body_groups import checked_body_groups
from taichi_dem.mesh.checked_groups import checked_groups
from taichi_dem.mesh.mesh_methods import MeshMethods
from taichi_dem.mesh.parts_in_files import parts_of
from taichi_dem.mesh.sharing import refuse_bad_sharing
from taichi_dem.mesh.weld import COINCIDENT, weld_labels

#: Share of (longest edge)^3 below which a volume counts as zero, as it may be round-off.
FLAT = 1e-12

#: First words of the notes on what has been mended.
_MENDING = ("welded", "dropped", "turned")

#: The extent of a mesh lies between these [m]: a moment of inertia is its fifth power.
_LEAST_EXTENT, _MOST_EXTENT = 1e-30, 1e30


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
    unread : tuple of tuple of (str, str), default ()
        Groups of the file that are neither of faces nor of bodies: pairs of name and kind.
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
    unread: tuple[tuple[str, str], ...] = ()
    keep_coincident: bool = False
    body_groups: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        notes: list[str] = []
        flag("keep_coincident", self.keep_coincident)
        for name in ("notes", "unread"):
            instance(name, getattr(self, name), tuple)
        instance("source", self.source, (str, os.PathLike))
        given = self.points, self.tetrahedra, self.groups, 0.0
        parts = _checked(*given, self.keep_coincident, notes)
        self._hold(parts, checked_body_groups(self.body_groups, len(parts[1])))
        mended = [note for note in notes if note.split()[0] in _MENDING]
        if mended:
            raise InputError(f"a Mesh takes what checked_mesh gives, which here {mended[0]}")

    #: Not among the options: see ``bonded_by``.
    bonded_shares: ClassVar[tuple[tuple[str, float], ...]] = ()
    inner_groups: ClassVar[tuple[str, ...]] = ()

    def _hold(self, parts, body_groups):
        """Keep arrays that cannot be written to; parts: what ``_checked`` gives."""
        points, tetrahedra, groups, inner_groups = parts
        object.__setattr__(self, "inner_groups", inner_groups)
        for array in (points, tetrahedra, *groups.values(), *body_groups.values()):
            array.setflags(write=False)
        for name, value in zip(("points", "tetrahedra"), (points, tetrahedra)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "groups", MappingProxyType(dict(groups)))
        object.__setattr__(self, "body_groups", MappingProxyType(dict(body_groups)))

    def __getstate__(self) -> dict[str, Any]:
        named = {"groups": dict(self.groups), "body_groups": dict(self.body_groups)}
        return {**vars(self), **named}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        parts = self.points, self.tetrahedra, self.groups, self.inner_groups
        self._hold(parts, self.body_groups)

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
        if not isinstance(name, str) or name not in self.groups:
            known = ", ".join(sorted(self.groups)) or "none"
            kinds = ["bodies"] * (isinstance(name, str) and name in self.body_groups)
            kinds += [kind for other, kind in self.unread if other == name]
            why = f" ({name} is a group of {kinds[0]}: make one of faces)" if kinds else ""
            raise InputError(f"mesh has no face group {shown(name)}{why}; its groups are: {known}")
        return self.groups[name]

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
        if not isinstance(name, str) or name not in self.body_groups:
            known = ", ".join(sorted(self.body_groups)) or "none"
            of_faces = isinstance(name, str) and name in self.groups
            why = f" ({name} is a group of faces: make one of bodies)" if of_faces else ""
            raise InputError(
                f"mesh has no body group {shown(name)}{why}; its body groups are: {known}"
            )
        return self.body_groups[name]

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


def group_area(mesh: Mesh, name: str) -> float:
    """Area of the faces of a group [m2]."""
    vectors = geometry.area_vectors(mesh.points, mesh.group_faces(name))
    return float(np.linalg.norm(vectors, axis=1).sum())


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
    parts = _checked(points, tetrahedra, groups, weld_tolerance, keep_coincident, notes)
    _note_parts(parts[1], notes)
    made = object.__new__(Mesh)
    made.__dict__.update(notes=tuple(notes), source=str(source), unread=())
    made.__dict__.update(keep_coincident=keep_coincident)
    made._hold(
        parts, checked_body_groups({} if body_groups is None else body_groups, len(parts[1]))
    )
    return made


def _checked(points, tetrahedra, groups, weld_tolerance, keep_coincident, notes):
    """Points, tetrahedra and groups as ``checked_mesh`` wants them; notes: of what was mended."""
    places = _checked_points(points)
    corners = _checked_indices("tetrahedra", tetrahedra, 4, len(places))
    faces = _checked_groups(groups, len(places))
    label = welded_numbers(places, corners, weld_tolerance, notes)
    corners, faces = label[corners], {name: label[faces[name]] for name in faces}
    places, corners, faces = _without_loose_points(places, corners, faces, notes)
    _refuse_extent(places)
    if not keep_coincident:
        _refuse_coincident(places)
    corners = _positive(places, corners, notes)
    refuse_bad_sharing(corners)
    if keep_coincident:
        _check_coincident(places, corners, weld_tolerance, notes)
    return places, corners, *checked_groups(corners, faces, notes)


def welded_numbers(
    points: ArrayLike, tetrahedra: ArrayLike, tolerance: float, notes: list[str]
) -> np.ndarray:
    """For every point the first of those that become one with it, (n,) int32.

    points, tetrahedra, tolerance: as for ``checked_mesh``, with the same errors. notes: a list to
    which a sentence is added where points become one.
    """
    points = _checked_points(points)
    tetrahedra = _checked_indices("tetrahedra", tetrahedra, 4, len(points))
    label = weld_labels(points, tetrahedra, tolerance)
    count = int(np.sum(label != np.arange(len(points))))
    if count:
        notes.append(f"welded {count} points closer than {tolerance:g} m to another")
    return label.astype(np.int32)


def _checked_points(points: Any) -> np.ndarray:
    """Copy as (n, 3) float64, or InputError."""
    try:
        points = np.array(points)
        points = points.astype(np.float64) if points.dtype.kind in "iuf" else None
    except (TypeError, ValueError, OverflowError):
        points = None
    if points is None:
        raise InputError("points must be an array of numbers, shape (n, 3)")
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points must have shape (n, 3), got {points.shape}")
    bad = np.flatnonzero(~(np.abs(points) <= _MOST_EXTENT).all(axis=1))
    if len(bad):
        raise InputError(
            f"points must be finite, within {_MOST_EXTENT:g} m, but {len(bad)} are not, the first "
            f"is number {bad[0]}: {points[bad[0]].tolist()}"
        )
    return points


def _checked_groups(groups: Any, point_count: int) -> dict[str, np.ndarray]:
    """Groups as a dict of name to (n, 3) int32, or InputError."""
    if not isinstance(groups, Mapping):
        raise InputError(f"groups must be a dict of name to faces, got {shown(groups)}")
    return {
        word("name of a group", name): _checked_indices(f"group {name!r}", faces, 3, point_count)
        for name, faces in groups.items()
    }


def _checked_indices(what: str, indices: Any, width: int, point_count: int) -> np.ndarray:
    """Copy as (n, width) int32 with all values in range, or InputError."""
    try:
        indices = np.asarray(indices)
    except ValueError:
        raise InputError(f"{what} must be rows of {width} point numbers each") from None
    if indices.size == 0:
        raise InputError(f"{what} must not be empty")
    if indices.ndim != 2 or indices.shape[1] != width:
        raise InputError(f"{what} must have shape (n, {width}), got {indices.shape}")
    if indices.dtype.kind not in "iu":
        raise InputError(f"{what} must hold integer point numbers, got {indices.dtype}")
    bad = np.flatnonzero(((indices < 0) | (indices >= point_count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"{what}: point numbers must lie in [0, {point_count - 1}], but row {bad[0]} is "
            f"{indices[bad[0]].tolist()}"
        )
    return indices.astype(np.int32)


def _without_loose_points(points, tetrahedra, groups, notes):
    """Drop the points that no tetrahedron uses; a group's face that uses one gets -1 there."""
    used = np.unique(tetrahedra)
    if len(used) < len(points):
        notes.append(f"dropped {len(points) - len(used)} points that belong to no tetrahedron")
    new = np.full(len(points), -1, dtype=np.int32)
    new[used] = np.arange(len(used), dtype=np.int32)
    return points[used], new[tetrahedra], {name: new[faces] for name, faces in groups.items()}


def _refuse_extent(points):
    """Refuse a mesh so small that its inertia falls to zero."""
    extent = np.ptp(points, axis=0).max()
    if extent < _LEAST_EXTENT:
        got, least = told_apart(extent, _LEAST_EXTENT)
        raise InputError(f"points must span at least {least} m, got {got} m")


def _refuse_coincident(points):
    """Refuse coincident points: bodies that seem joined there would not be bonded."""
    pairs, distance = _coincident(points)
    if len(pairs):
        first = points[pairs[0, 0]]
        raise InputError(
            f"{len(np.unique(pairs[:, 1]))} points coincide with another, the first at "
            f"({first[0]:g}, {first[1]:g}, {first[2]:g}) m; pass "
            f"weld_tolerance={2.0 * distance:.1e} to join them, or keep_coincident=True to keep "
            "the faces on them apart"
        )


def _coincident(points):
    """Pairs of points at one place, (n, 2), and the distance that counts as none [m]."""
    distance = COINCIDENT * np.ptp(points, axis=0).max()
    none = np.empty((0, 2), dtype=np.int64)
    return geometry.close_pairs(points, distance) if distance > 0.0 else none, distance


def _check_coincident(points, tetrahedra, weld_tolerance, notes):
    """Say how many points are kept apart; refuse a wish to weld, and bodies in one place.

    Joined where they coincide, the bodies must make a mesh that has no bodies in each other.
    """
    if weld_tolerance:
        raise InputError(
            f"weld_tolerance must be 0 with keep_coincident=True, got {shown(weld_tolerance)}"
        )
    pairs, _ = _coincident(points)
    if len(pairs):
        refuse_bad_sharing(geometry.components(len(points), pairs)[tetrahedra])
        count = len(np.unique(pairs))
        notes.append(f"kept {count} points apart that coincide with another: no bond joins them")


def _positive(points, tetrahedra, notes):
    """Turn negative volumes, refuse flat ones."""
    volume = geometry.signed_volumes(points, tetrahedra)
    longest = geometry.edge_lengths(points, tetrahedra).max(axis=1)
    flat = np.flatnonzero(np.abs(volume) <= FLAT * longest**3)
    if len(flat):
        raise InputError(
            f"{len(flat)} tetrahedra have no volume, the first is number {flat[0]} with "
            f"{volume[flat[0]]:.3g} m3 (at least {FLAT:g} of its longest edge cubed is needed)"
        )
    negative = volume < 0.0
    if negative.any():
        notes.append(f"turned {int(negative.sum())} tetrahedra of negative volume")
        tetrahedra = np.where(negative[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra)
    return np.ascontiguousarray(tetrahedra, dtype=np.int32)


def _note_parts(tetrahedra, notes):
    """Say when the bodies are not all joined through shared faces."""
    parts = len(np.unique(parts_of(tetrahedra)))
    if parts > 1:
        notes.append(f"the mesh has {parts} parts that share no face with each other")
