"""Checks of mesh arrays: small defects are repaired and reported, others refused (NumPy only)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import finite, shown, told_apart, word
from taichi_dem.mesh import tetrahedra as geometry

#: Share of (longest edge)^3 below which a volume counts as zero, as it may be round-off.
FLAT = 1e-12
#: Points nearer than this share of the mesh's extent count as one and the same place.
COINCIDENT = 1e-9
#: Largest coordinate [m]: a moment of inertia is its fifth power.
_FARTHEST = 1e30


def checked_arrays(
    points: Any, tetrahedra: Any, groups: Any, tolerance: float, coincident: bool, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray], tuple[str, ...]]:
    """Points, tetrahedra and groups as a Mesh holds them, and the names of those of inner faces."""
    places = checked_points(points)
    corners = _checked_indices("tetrahedra", tetrahedra, 4, len(places))
    faces = {
        name: _checked_indices(f"group {name!r}", group, 3, len(places))
        for name, group in _by_name("group", groups, "faces").items()
    }
    label = weld_labels(places, corners, tolerance, notes)
    corners, faces = label[corners], {name: label[faces[name]] for name in faces}
    places, corners, faces = _without_loose_points(places, corners, faces, notes)
    extent = np.ptp(places, axis=0).max()
    pairs = geometry.close_pairs(places, COINCIDENT * extent)
    if len(pairs) and not coincident:
        _refuse_coincident(places, pairs, extent)
    corners = _positive(places, corners, notes)
    _refuse_bad_sharing(corners)
    if len(pairs):
        # Joined where they coincide, no body may lie in another.
        _refuse_bad_sharing(geometry.components(len(places), pairs)[corners])
        count = len(np.unique(pairs))
        notes.append(f"kept {count} points apart that coincide with another: no bond joins them")
    return places, corners, *_checked_faces(corners, faces, notes)


def checked_points(points: Any) -> np.ndarray:
    """Copy as (n, 3) float64, or InputError."""
    checked = _rows("points", points, 3, "iuf", "numbers")
    with np.errstate(over="ignore"):
        checked = checked.astype(np.float64)
    bad = checked[~(np.abs(checked) <= _FARTHEST).all(axis=1)]
    if len(bad):
        raise InputError(
            f"points must be finite, within {_FARTHEST:g} m, but {len(bad)} are not, the first is "
            f"{bad[0].tolist()}"
        )
    return checked


def _rows(what, values, width, kinds, words):
    try:
        rows = np.asarray(values)
    except ValueError:
        raise InputError(f"{what} must be rows of {width} {words} each") from None
    if rows.ndim != 2 or rows.shape[1] != width or not len(rows) or rows.dtype.kind not in kinds:
        raise InputError(
            f"{what} must be rows of {width} {words} each, at least one, got an array of "
            f"{rows.dtype} of shape {rows.shape}"
        )
    return rows


def weld_labels(
    points: np.ndarray, tetrahedra: np.ndarray, tolerance: float, notes: list[str]
) -> np.ndarray:
    """For every point the first of those that become one with it, (n,) int32."""
    lengths = geometry.edge_lengths(points, tetrahedra)
    shortest = lengths[lengths > COINCIDENT * np.ptp(points, axis=0).max()].min(initial=np.inf)
    if not (finite(tolerance) and 0.0 <= tolerance < shortest):
        above = finite(tolerance) and tolerance > 0.0
        bound = told_apart(tolerance, shortest, 6)[1] if above else f"{shortest:.6g}"
        raise InputError(
            f"weld_tolerance must lie in [0, {bound}) m, the shortest edge, got {shown(tolerance)}"
        )
    if tolerance == 0.0:
        return np.arange(len(points), dtype=np.int32)
    label = geometry.components(len(points), geometry.close_pairs(points, tolerance))
    ends = label[tetrahedra[:, geometry.LOCAL_EDGES]]
    joined = (ends[..., 0] == ends[..., 1]) & (lengths > tolerance)
    if joined.any():
        raise InputError(
            f"weld_tolerance must be smaller than {tolerance:g} m: it joins the ends of an edge "
            f"of {lengths[joined].min():.6g} m through points between them"
        )
    count = int(np.sum(label != np.arange(len(points))))
    if count:
        notes.append(f"welded {count} points closer than {tolerance:g} m to another")
    return label.astype(np.int32)


def checked_body_groups(groups: Any, body_count: int) -> dict[str, np.ndarray]:
    """Numbers of bodies by name, each once and in rising order, or InputError."""
    named = _by_name("body group", groups, "bodies")
    return {name: _checked_bodies(name, bodies, body_count) for name, bodies in named.items()}


def _by_name(what, groups, members):
    if not isinstance(groups, Mapping):
        raise InputError(
            f"{what.replace(' ', '_')}s must be a dict of name to {members}, got {shown(groups)}"
        )
    return {word(f"name of a {what}", name): group for name, group in groups.items()}


def _checked_bodies(name, bodies, body_count):
    try:
        checked = np.asarray(bodies)
    except ValueError:
        checked = np.zeros(0)
    if checked.ndim != 1 or not checked.size or checked.dtype.kind not in "iu":
        raise InputError(f"body group {name!r} must be a list of body numbers, got {shown(bodies)}")
    refuse_outside(f"body group {name!r}", "body", checked[:, None], body_count)
    return np.unique(checked).astype(np.int32)


def refuse_outside(what: str, of: str, rows: np.ndarray, count: int) -> None:
    """Refuse numbers (n, k) of points or bodies that are not there."""
    bad = np.flatnonzero(((rows < 0) | (rows >= count)).any(axis=1))
    if len(bad):
        raise InputError(
            f"{what}: {of} numbers must lie in [0, {count - 1}], but row {bad[0]} is "
            f"{rows[bad[0]].tolist()}"
        )


def _checked_indices(what, indices, width, point_count):
    """Copy as (n, width) int32 with all values in range, or InputError."""
    checked = _rows(what, indices, width, "iu", "integer point numbers")
    refuse_outside(what, "point", checked, point_count)
    return checked.astype(np.int32)


def _without_loose_points(points, tetrahedra, groups, notes):
    """Drop the points that no tetrahedron uses; a group's face that uses one gets -1 there."""
    used = np.unique(tetrahedra)
    if len(used) < len(points):
        notes.append(f"dropped {len(points) - len(used)} points that belong to no tetrahedron")
    new = np.full(len(points), -1, dtype=np.int32)
    new[used] = np.arange(len(used), dtype=np.int32)
    return points[used], new[tetrahedra], {name: new[faces] for name, faces in groups.items()}


def _refuse_coincident(points, pairs, extent):
    """Refuse coincident points: bodies that seem joined there would not be bonded."""
    first = points[pairs[0, 0]]
    raise InputError(
        f"{len(np.unique(pairs[:, 1]))} points coincide with another, the first at "
        f"({first[0]:g}, {first[1]:g}, {first[2]:g}) m; pass "
        f"weld_tolerance={2.0 * COINCIDENT * extent:.1e} to join them, or "
        "keep_coincident=True to keep the faces on them apart"
    )


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


def _refuse_bad_sharing(tetrahedra):
    """Refuse faces of three bodies, and bodies that lie in each other, also repeated ones."""
    face = geometry.face_numbers(geometry.all_faces(tetrahedra))
    crowded = np.flatnonzero(np.bincount(face) > 2)
    if len(crowded):
        owners = np.flatnonzero(face == crowded[0]) // 4
        raise InputError(
            f"tetrahedra {_listed(owners)} share one face; at most two may "
            f"({len(crowded)} such faces)"
        )
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
    *most, last = map(str, numbers.tolist())
    return f"{', '.join(most)} and {last}"


def _checked_faces(tetrahedra, groups, notes):
    """Groups with each face once, and the names of those of inner faces."""
    faces = geometry.all_faces(tetrahedra)
    number, *members = geometry.numbers_in(faces, *groups.values())
    most = max(map(np.max, (number, *members)))
    count = np.bincount(number, minlength=most + 1)
    row_of = np.full(len(count), -1)
    row_of[number[::-1]] = np.arange(len(faces))[::-1]
    result, inner = {}, []
    for name, mine in zip(groups, members):
        wrong = int(np.sum(count[mine] != 1))
        if (count[mine] == 2).all():
            inner.append(name)
        elif wrong:
            raise InputError(
                f"group {name!r}: {wrong} of its {len(mine)} faces are not outer faces; all "
                "faces of a group must be outer faces, or all must be shared by two bodies"
            )
        once = np.unique(row_of[mine])
        if len(once) < len(mine):
            notes.append(f"dropped {len(mine) - len(once)} repeated faces of group {name!r}")
        result[name] = faces[once]
    return result, tuple(inner)


def joined_bodies(tetrahedra: np.ndarray) -> np.ndarray:
    """For every body the first of those it is joined to through shared faces, (body_count,)."""
    return geometry.components(len(tetrahedra), geometry.shared_faces(tetrahedra) // 4)


def unbonded_places(tetrahedra: np.ndarray) -> str:
    """A sentence on parts that meet in points without a common face, "" where there are none."""
    part = np.unique(joined_bodies(tetrahedra), return_inverse=True)[1]
    held = np.unique(np.stack([tetrahedra.ravel(), np.repeat(part, 4)]), axis=1)[0]
    count = int((np.bincount(held) > 1).sum())
    if count:
        return (
            f"{count} points belong to several of the mesh's {part.max() + 1} parts, which share "
            "no face and are not bonded"
        )
    return ""
