"""Mesh of tetrahedra with named groups; x points to the right, y up, z towards the viewer."""

import copy
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import InitVar, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import Pictured, counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot
from taichi_dem.kit.validation import (
    direction,
    flag,
    fraction,
    instance,
    shown,
    unit_vector,
    word,
)
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.check import checked_arrays, checked_body_groups, joined_bodies

#: Given the centres of faces or bodies [m], (n, 3), whether each is chosen, (n,).
Choice = Callable[[np.ndarray], Any]
#: Digits of the entries of a rotation: those that every machine's sine agrees on.
_DIGITS = 15


@dataclass(frozen=True, eq=False)
class Mesh(Pictured):
    """Tetrahedra and named groups of faces; immutable.

    Arrays are checked as in ``checked_mesh``; ``dataclasses.replace`` makes another mesh.

    Parameters
    ----------
    points : ndarray
        Coordinates [m], shape (point_count, 3).
    tetrahedra : ndarray
        Point indices, shape (body_count, 4), all of positive volume.
    groups : mapping
        Point indices (n, 3) by name: of outer faces, normals outward, or of inner faces.
    notes : tuple of str, default ()
        Sentences about repairs and findings of the checks.
    source : str, default ""
        Name of the file; ``""`` for a mesh built in memory.
    keep_coincident : bool, default False
        Whether coincident points, and the faces on them, stay apart, as at a joint or a crack.
    body_groups : mapping, optional
        Numbers of bodies (n,) by name, in rising order, as for ``Scene(materials=...)``.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.

    Attributes
    ----------
    bonded_shares : tuple of (str, float)
        Inner groups and the bonded share of the area of their faces; a Scene sets them.
    inner_groups : tuple of str
        Names of the groups of inner faces.

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
        checked = zip(names, (*arrays, bodies, tuple(dict.fromkeys(notes))))
        self.__dict__.update(checked)
        for array in (*arrays[:2], *self.groups.values(), *bodies.values()):
            array.setflags(write=False)

    #: Not among the options: see ``bonded_by``.
    bonded_shares: ClassVar[tuple[tuple[str, float], ...]] = ()
    inner_groups: ClassVar[tuple[str, ...]] = ()

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
        """Point indices (n, 3) of the faces of a group.

        Parameters
        ----------
        name : str
            Name of the group.
        """
        return self._members("face", self.groups, name)

    def group_bodies(self, name: str) -> np.ndarray:
        """Numbers (n,) of the bodies of a group.

        Parameters
        ----------
        name : str
            Name of the body group.
        """
        return self._members("body", self.body_groups, name)

    def _members(self, kind, groups, name):
        if isinstance(name, str) and name in groups:
            return groups[name]
        known = ", ".join(sorted(groups)) or "none"
        raise InputError(f"mesh has no {kind} group {shown(name)}; its {kind} groups are: {known}")

    def bonded_by(self, shares: Mapping[str, float]) -> "Mesh":
        """Return the mesh with only a share of some inner faces bonded.

        Parameters
        ----------
        shares : mapping
            Share by the name of an inner group, 0 (no bond) to 1; of several groups, the smallest.
        """
        if not instance("shares", shares, Mapping) and not self.bonded_shares:
            return self
        for name, share in shares.items():
            self.group_faces(name)
            fraction(f"share of group {name}", share)
            if name not in self.inner_groups:
                raise InputError(
                    f"group {name} must have inner faces, which two bodies share, to be unbonded "
                    "or weaker, got outer faces"
                )
        bonded = copy.copy(self)
        bonded.__dict__["bonded_shares"] = tuple(sorted(shares.items()))
        return bonded

    @property
    def has_open_faces(self) -> bool:
        """Whether coincident faces without a bond may exist."""
        return self.keep_coincident or any(share == 0.0 for _, share in self.bonded_shares)

    def group(self, name: str, chosen: Choice) -> "Mesh":
        """Return the mesh with one more group: outer faces chosen by their centres.

        Parameters
        ----------
        name : str
            Name of the new group.
        chosen : callable
            Function of the centres of all outer faces [m], (n, 3), that returns n truth values.

        Examples
        --------
        >>> mesh = read_mesh(PAPER_BLOCK).group("high", lambda x: x[:, 1] > 1.9)
        >>> "high" in mesh.groups
        True
        """
        outer = geometry.outer_faces(self.tetrahedra)
        return _with_group(self, "groups", name, outer[_choose(self, outer, chosen)])

    def body_group(self, name: str, chosen: Choice) -> "Mesh":
        """Return the mesh with one more group of bodies, chosen by their centres.

        Parameters
        ----------
        name : str
            Name of the new group.
        chosen : callable
            Function of the centres of all bodies [m], (n, 3), that returns n truth values.
        """
        bodies = np.flatnonzero(_choose(self, self.tetrahedra, chosen, "bodies"))
        return _with_group(self, "body_groups", name, bodies)

    def moved(
        self,
        *,
        by: Sequence[float] = (0.0, 0.0, 0.0),
        turned: Sequence[float] = (0.0, 0.0, 0.0),
        about: Sequence[float] | None = None,
    ) -> "Mesh":
        """Return the mesh, with its groups, at another place: turned, then shifted.

        Parameters
        ----------
        by : sequence of float, default (0.0, 0.0, 0.0)
            Shift [m].
        turned : sequence of float, default (0.0, 0.0, 0.0)
            Rotation vector, right-handed, of the angle [degrees]: (0, 0, 90) turns x into y.
        about : sequence of float, optional
            Point on the axis [m]; the middle of the mesh's box by default.
        """
        shift, turn = np.array(direction("by", by)), _rotation(direction("turned", turned))
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        origin = 0.5 * (low + high) if about is None else np.array(direction("about", about))
        points = self.points
        if any(turned):
            points = origin + ((points - origin)[:, None, :] * turn).sum(axis=2)
        return replace(self, points=points + shift)


def volumes(mesh: Mesh) -> np.ndarray:
    """Volumes of the bodies [m3], shape (body_count,)."""
    return geometry.signed_volumes(mesh.points, mesh.tetrahedra)


def element_sizes(mesh: Mesh) -> np.ndarray:
    """Edge of the regular tetrahedron of the volume of each body [m], (body_count,)."""
    return np.cbrt(6.0 * np.sqrt(2.0) * volumes(mesh))


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
        Point indices (k, 3) by name, in either orientation: of outer faces, or of inner ones.
    weld_tolerance : float, default 0.0
        Points not farther apart than this become one [m]; 0 welds nothing.
    keep_coincident : bool, default False
        Accept distinct points at one place. Faces on them are free surfaces, as of two blocks that
        touch, a joint or a crack; they need a contact of outer faces. Else such points are refused.
    body_groups : mapping, optional
        Numbers of tetrahedra (k,) by name.

    Notes
    -----
    Repaired are negative volumes, points without a tetrahedron, and faces twice in a group.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> checked_mesh(corners, [[0, 1, 2, 3]], {"base": [[0, 1, 2]]}).body_count
    1
    """
    mesh: Any = Mesh
    options = {"weld_tolerance": weld_tolerance, "keep_coincident": keep_coincident}
    bodies = {} if body_groups is None else body_groups
    return mesh(points, tetrahedra, groups, body_groups=bodies, **options)


def with_inner_group(mesh: Mesh, name: str, chosen: Choice) -> Mesh:
    """The mesh with one more group: faces between two bodies chosen by their centres."""
    # ``Scene(unbonded=[name])`` makes a notch or an open joint of the group.
    inner = _inner_faces(mesh)[0]
    return _with_group(mesh, "groups", name, inner[_choose(mesh, inner, chosen)])


def with_cut(
    mesh: Mesh,
    name: str,
    point: Sequence[float],
    normal: Sequence[float],
    chosen: Choice | None = None,
) -> Mesh:
    """The mesh with one more group: the faces along which a plane divides the bodies."""
    origin, along = np.array(direction("point", point)), unit_vector("normal", normal)
    inner, bodies = _inner_faces(mesh)
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    before = dot(centre - origin, along) > 0.0
    faces = inner[before[bodies[:, 0]] != before[bodies[:, 1]]]
    if chosen is not None:
        faces = faces[_choose(mesh, faces, chosen)]
    return _with_group(mesh, "groups", name, faces)


def _inner_faces(mesh):
    """Faces between two bodies, (n, 3), and these bodies, (n, 2)."""
    rows = geometry.shared_faces(mesh.tetrahedra)
    return geometry.all_faces(mesh.tetrahedra)[rows[:, 0]], rows // 4


def _rotation(turned):
    """Rotation matrix of a vector in degrees: cos 1 + sin [n x] + (1 - cos) n n^T."""
    angle = float(np.sqrt(np.square(turned).sum()))
    if angle == 0.0:
        return np.eye(3)
    axis, radians = np.array(turned) / angle, np.radians(angle % 360.0)
    cross = np.cross(np.eye(3), axis)
    cos, sin = np.cos(radians), np.sin(radians)
    matrix = cos * np.eye(3) + sin * cross + (1.0 - cos) * axis[:, None] * axis[None, :]
    return np.round(matrix, _DIGITS)


def _choose(mesh: Mesh, corners: np.ndarray, chosen: Choice, what: str = "faces") -> np.ndarray:
    """Which faces or bodies, given by their corners, a choice takes, (n,)."""
    centres = mesh.points[corners].mean(axis=1)
    if not callable(chosen):
        raise InputError(f"chosen must be a function of centres of {what}, got {shown(chosen)}")
    choice = np.asarray(chosen(centres))
    if choice.shape != (len(corners),) or choice.dtype != bool:
        raise InputError(
            f"chosen must return one truth value for each of {len(corners)} {what}, got an "
            f"array of {choice.dtype} of shape {choice.shape}"
        )
    return choice


def _with_group(mesh: Mesh, kind: str, name: str, members: np.ndarray) -> Mesh:
    """The mesh with one more of its "groups" of faces or "body_groups"."""
    groups = getattr(mesh, kind)
    if word("name", name) in groups:
        raise InputError(f"name must be that of a new group, got {shown(name)}, which exists")
    if not len(members):
        raise InputError(f"group {name} must have at least one member, but none was chosen")
    more: Any = {kind: {**groups, name: members}}
    return replace(mesh, **more)
