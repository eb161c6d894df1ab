"""Rock behind a plane face with holes drilled into it: their table, the mesh, where gas acts."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.sweeps.table import checked_rows
from taichi_dem.kit.validation import FileName, between, plain_fields, positive, whole
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.gmsh import places_and_rows, prism, session
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import in_space_order

#: Least angle of a hole with the face [degrees].
_FLATTEST = 20.0
#: Sides of a hole's prism, twice as many from a width [m] on; growth of edges with each metre.
_PRISM, _WIDE, _GROWTH = 5, 0.2, 0.35
#: Distance from the axis within which a face belongs to the wall, in radii, and the least share of
#: a charged wall that the mesh must show.
_ON_WALL, _SEEN = 1.35, 0.6
#: Names of the sides of the box by axis.
_BOX = ("left", "right"), ("bottom", "top"), ("back", "front")


@dataclass(frozen=True)
class Hole:
    """A hole in the face."""

    x_m: float
    y_m: float
    length_m: float
    angle_deg: float = 90.0
    charge_from_m: float = 0.0
    delay_s: float = 0.0
    diameter_m: float = 0.05

    def __post_init__(self):
        plain_fields(self)
        for name in ("x_m", "y_m", "length_m", "diameter_m"):
            positive(name, getattr(self, name))
        between("angle_deg", self.angle_deg, _FLATTEST, 180.0 - _FLATTEST)
        between("charge_from_m", self.charge_from_m, 0.0, self.length_m)
        positive("delay_s", self.delay_s, zero_allowed=True)

    @property
    def direction(self) -> np.ndarray:
        """Unit vector into the rock, (3,)."""
        angle = np.radians(self.angle_deg)
        # Exactly straight at a right angle.
        across = 0.0 if self.angle_deg == 90.0 else np.cos(angle)
        return np.array([across, 0.0, -np.sin(angle)])

    def at(self, depth: float, along_m: float) -> np.ndarray:
        """Point of the axis at a distance from the face z = depth, along the hole [m]."""
        return np.array([self.x_m, self.y_m, depth]) + along_m * self.direction

    @property
    def charged_m(self) -> float:
        """Length of the charge [m]."""
        return self.length_m - self.charge_from_m


def read_holes(path: FileName) -> tuple[Hole, ...]:
    """Read holes from a CSV file with a row each and the fields of ``Hole`` as columns."""
    known, rows = [column.name for column in fields(Hole)], checked_rows(path)
    if not {*known[:3]} <= {*rows[0]} <= {*known}:
        raise InputError(
            f"columns of a table of holes must be {', '.join(known)} (the first three always), "
            f"got {', '.join(rows[0])}"
        )
    holes = []
    for number, row in enumerate(rows, 1):
        given: Any = row
        try:
            holes.append(Hole(**given))
        except InputError as told:
            raise InputError(f"hole {number}: {told}") from None
    return tuple(holes)


def check_holes(size: Sequence[float], holes: Sequence[Hole]) -> None:
    """Raise InputError unless holes lie in a box of a size (3,) [m] and keep apart."""
    for number, hole in enumerate(holes, 1):
        for place in (hole.at(size[2], 0.0), hole.at(size[2], hole.length_m)):
            room = np.minimum(place, np.array(size) - place)[: 3 if place[2] < size[2] else 2]
            if room.min() <= 0.5 * hole.diameter_m:
                box, got = (", ".join(f"{x:.4g}" for x in first) for first in (size, place))
                raise InputError(
                    f"hole {number} must lie inside the rock of ({box}) m, got ({got})"
                )
    for (a, first), (b, second) in combinations(enumerate(holes, 1), 2):
        gap = _least_distance(size[2], first, second) - 0.5 * (first.diameter_m + second.diameter_m)
        if gap <= 0.0:
            raise InputError(
                f"holes {a} and {b} must not cross, got walls that are {gap:.3g} m apart, from "
                f"({first.x_m:g}, {first.y_m:g}) and ({second.x_m:g}, {second.y_m:g}) m on the face"
            )


def _least_distance(depth, one, other):
    """Least distance of the axes of two holes [m]: nearest points of two pieces of lines."""
    along = np.linspace(0.0, 1.0, 2001)[:, None]
    points = one.at(depth, 0.0) + along * one.length_m * one.direction
    from_start = points - other.at(depth, 0.0)
    foot = np.clip(dot(from_start, other.direction), 0.0, other.length_m)
    return float(length(from_start - foot[:, None] * other.direction).min())


def drilled_rock(
    size: Sequence[float],
    holes: Sequence[Hole],
    near: float,
    far: float,
    *,
    slots: Sequence = (),
    seed: int = 0,
) -> Mesh:
    """Mesh of a box of rock with holes and slots in its face, by Gmsh; a seed makes another one."""
    check_holes(size, holes)
    near, far = positive("near", near), positive("far", far)
    draw = np.random.default_rng(whole("seed", seed, 0, 2**31 - 1))
    turn, scale = draw.uniform(size=2) if seed else (0.0, 0.5)
    scale = 0.95 + 0.1 * scale
    with session("drilled_rock") as gmsh:
        occ = gmsh.model.occ
        box = [(3, occ.addBox(0.0, 0.0, 0.0, *size))]
        cut = [_prism(occ, size[2], hole, turn) for hole in holes]
        cut += [(3, occ.addBox(*corner, *edges)) for corner, edges in slots]
        occ.cut(box, cut)
        occ.synchronize()
        _set_sizes(gmsh.model, size, scale * near, scale * far)
        gmsh.model.mesh.generate(3)
        points, tetrahedra = places_and_rows(gmsh, 4)
    groups = _sides(points, geometry.outer_faces(tetrahedra), size)
    return in_space_order(checked_mesh(points, tetrahedra, groups))


def _sides(points, outer, size):
    """Outer faces on the six sides of the box by name."""
    corners, groups = points[outer], {}
    for axis, names in enumerate(_BOX):
        for name, place in zip(names, (0.0, size[axis])):
            on = np.abs(corners[..., axis] - place).max(axis=1) < 1e-6 * max(size)
            groups[name] = outer[on]
    return groups


def _prism(occ, depth, hole, turn):
    """The prism of a hole, which begins outside the rock where it is inclined."""
    count = _PRISM if hole.diameter_m <= _WIDE else 2 * _PRISM
    angle = 2.0 * np.pi / count
    radius = 0.5 * hole.diameter_m * np.sqrt(angle / np.sin(angle))
    along, up = hole.direction, np.array([0.0, 1.0, 0.0])
    across, outside = np.cross(up, -along), hole.diameter_m / np.tan(np.radians(_FLATTEST))
    begin = hole.at(depth, -outside)
    around = angle * (np.arange(count) + turn)
    ring = begin + radius * (np.outer(np.cos(around), across) + np.outer(np.sin(around), up))
    return prism(occ, ring, (outside + hole.length_m) * along)


def _set_sizes(model, size, near, far):
    """Edges grow in proportion to the distance from all curves but the edges of the box."""
    curves, field = [], model.mesh.field
    for dim, tag in model.getEntities(1):
        low, high = np.array(model.getBoundingBox(dim, tag)).reshape(2, 3)
        on = [abs(low - w) + abs(high - w) < 1e-5 for w in (0.0, np.array(size))]
        if np.sum(on) < 2:
            curves.append(tag)
    away = field.add("Distance")
    field.setNumbers(away, "CurvesList", curves)
    field.setNumber(away, "Sampling", 60)
    edges = field.add("MathEval")
    edge = f"Min({float(near)!r} + {_GROWTH!r} * F{away}, {float(far)!r})"
    field.setString(edges, "F", edge)
    field.setAsBackgroundMesh(edges)


def with_charges(mesh: Mesh, depth: float, holes: Sequence[Hole]) -> tuple[Mesh, dict[str, Hole]]:
    """A mesh with a group of the charged walls of each delay and diameter, and a hole of each."""
    stages: dict[tuple, list] = {}
    for number, hole in enumerate(holes, 1):
        if hole.charged_m > 0.0:
            stages.setdefault((hole.delay_s, hole.diameter_m), []).append((number, hole))
    if not stages:
        raise InputError("a table of holes must have one that is charged, got none")
    outer, groups, charges = geometry.outer_faces(mesh.tetrahedra), dict(mesh.groups), {}
    for k, key in enumerate(sorted(stages), 1):
        walls = [_wall(mesh.points, outer, depth, *stage) for stage in stages[key]]
        groups[f"stage_{k}"], charges[f"stage_{k}"] = np.vstack(walls), stages[key][0][1]
    return replace(mesh, groups=groups), charges


def _wall(points, outer, depth, number, hole):
    """Outer faces of the charged part of a hole and of its end."""
    corners = points[outer]
    away = corners - hole.at(depth, 0.0)
    along = dot(away, hole.direction)
    across = length(away - along[..., None] * hole.direction)
    middle, reach = along.mean(axis=1), _ON_WALL * 0.5 * hole.diameter_m
    inside = (hole.charge_from_m <= middle) & (middle <= hole.length_m + 0.1 * hole.diameter_m)
    on = inside & (across.max(axis=1) <= reach)
    area = length(geometry.area_vectors(points, outer[on])).sum()
    share = area / (np.pi * hole.diameter_m * hole.charged_m)
    if share < _SEEN:
        raise InputError(
            f"hole {number} at ({hole.x_m:g}, {hole.y_m:g}) m needs elements that show its charge "
            f"of {hole.charged_m:.3g} m: the mesh has faces on {100.0 * share:.0f} % of its wall"
        )
    return outer[on]
