"""Rock behind a plane face with holes drilled into it: their table, the mesh, where gas acts.

The rock is a box from the origin, x to the right, y up, its free face at z = depth.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length
from taichi_dem.kit.sweeps.table import checked_rows
from taichi_dem.kit.validation import FileName, between, plain_fields, positive, told_apart, whole
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.gmsh import places_and_rows, prism, session
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import in_space_order

#: Least angle of a hole with the face [degrees].
_FLATTEST = 20.0
#: Width of a hole [m] from which on its prism has twice as many sides.
_WIDE = 0.2
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
    known = [one.name for one in fields(Hole)]
    holes, rows = [], checked_rows(path)
    row: Any
    for number, row in enumerate(rows, 1):
        unknown = [name for name in row if name not in known]
        missing = [name for name in known[:3] if name not in row]
        if unknown or missing:
            raise InputError(
                f"columns of a table of holes must be {', '.join(known)} (the first three always), "
                f"got {', '.join(row)}"
            )
        try:
            holes.append(Hole(**row))
        except InputError as told:
            raise InputError(f"hole {number}: {told}") from None
    return tuple(holes)


def check_holes(size: Sequence[float], holes: Sequence[Hole]) -> None:
    """Raise InputError unless holes lie in a box of a size (3,) [m] and keep apart."""
    for number, hole in enumerate(holes, 1):
        for place in (hole.at(size[2], 0.0), hole.at(size[2], hole.length_m)):
            room = np.minimum(place, np.array(size) - place)[: 3 if place[2] < size[2] else 2]
            if room.min() <= 0.5 * hole.diameter_m:
                raise InputError(
                    f"hole {number} must lie inside the rock of {_words(size)} m, got "
                    f"({_words(place, ', ')}) m"
                )
    for (a, one), (b, other) in combinations(enumerate(holes, 1), 2):
        gap = _least_distance(size[2], one, other) - 0.5 * (one.diameter_m + other.diameter_m)
        if gap <= 0.0:
            raise InputError(
                f"holes {a} and {b} must not cross, got walls that are {gap:.3g} m apart, from "
                f"({one.x_m:g}, {one.y_m:g}) and ({other.x_m:g}, {other.y_m:g}) m on the face"
            )


def _words(numbers, between=" x "):
    return between.join(f"{one:.4g}" for one in numbers)


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
    growth: float = 0.3,
    sides: int = 6,
    slots: Sequence = (),
    seed: int = 0,
) -> Mesh:
    """Mesh of a box of rock with holes in its face, by Gmsh."""
    check_holes(size, holes)
    near, far = positive("near", near), positive("far", far)
    thinnest = min((one.length_m for one in holes), default=2.0 * far)
    if not near <= min(far, 0.5 * thinnest):
        got, most = told_apart(near, min(far, 0.5 * thinnest))
        raise InputError(
            f"near must be at most far and half of the shortest hole, {most} m, got {got}"
        )
    draw = np.random.default_rng(whole("seed", seed, 0, 2**31 - 1))
    turn, scale = draw.uniform(size=2) if seed else (0.0, 0.5)
    scale = 0.95 + 0.1 * scale
    with session("drilled_rock") as gmsh:
        occ = gmsh.model.occ
        box = [(3, occ.addBox(0.0, 0.0, 0.0, *size))]
        cut = [_prism(occ, size[2], hole, turn, whole("sides", sides, 4, 64)) for hole in holes]
        cut += [(3, occ.addBox(*corner, *edges)) for corner, edges in slots]
        if cut:
            occ.cut(box, cut)
        occ.synchronize()
        _set_sizes(gmsh.model, size, scale * near, scale * far, growth)
        gmsh.model.mesh.generate(3)
        points, tetrahedra = places_and_rows(gmsh, 4)
    groups = _sides(points, tetrahedra, size)
    return in_space_order(checked_mesh(points, tetrahedra, groups))


def _prism(occ, depth, hole, turn, sides):
    count = sides if hole.diameter_m <= _WIDE else 2 * sides
    angle = 2.0 * np.pi / count
    radius = 0.5 * hole.diameter_m * np.sqrt(angle / np.sin(angle))
    way, up = hole.direction, np.array([0.0, 1.0, 0.0])
    across, outside = np.cross(up, -way), hole.diameter_m / np.tan(np.radians(_FLATTEST))
    begin = hole.at(depth, -outside)
    around = angle * (np.arange(count) + turn)
    ring = begin + radius * (np.outer(np.cos(around), across) + np.outer(np.sin(around), up))
    return prism(occ, ring, (outside + hole.length_m) * way)


def _set_sizes(model, size, near, far, growth):
    """Edges grow in proportion to the distance from all curves but the edges of the box."""
    curves, field = [], model.mesh.field
    for dim, tag in model.getEntities(1):
        low, high = np.array(model.getBoundingBox(dim, tag)).reshape(2, 3)
        on = [abs(low - w) + abs(high - w) < 1e-5 for w in (0.0, np.array(size))]
        if np.sum(on) < 2:
            curves.append(tag)
    edge = f"{float(far)!r}"
    if curves:
        away = field.add("Distance")
        field.setNumbers(away, "CurvesList", curves)
        field.setNumber(away, "Sampling", 60)
        edge = f"Min({float(near)!r} + {float(growth)!r} * F{away}, {float(far)!r})"
    edges = field.add("MathEval")
    field.setString(edges, "F", edge)
    field.setAsBackgroundMesh(edges)


def _sides(points, tetrahedra, size):
    """Faces of the six sides of the box by name."""
    outer = geometry.outer_faces(tetrahedra)
    corners, groups = points[outer], {}
    for axis, names in enumerate(_BOX):
        for name, place in zip(names, (0.0, size[axis])):
            on = np.abs(corners[..., axis] - place).max(axis=1) < 1e-6 * max(size)
            groups[name] = outer[on]
    return groups


def with_charges(mesh: Mesh, depth: float, holes: Sequence[Hole]) -> tuple[Mesh, dict[str, float]]:
    """A mesh with a group of the charged walls of each delay, and the delays [s] by group."""
    delays = sorted({hole.delay_s for hole in holes if hole.charged_m > 0.0})
    if not delays:
        raise InputError("a table of holes must have one that is charged, got none")
    stages = {f"stage_{k}": delay for k, delay in enumerate(delays, 1)}
    outer, groups = geometry.outer_faces(mesh.tetrahedra), dict(mesh.groups)
    for name, delay in stages.items():
        together = [one for one in enumerate(holes, 1) if one[1].delay_s == delay]
        walls = [_wall(mesh.points, outer, depth, *one) for one in together if one[1].charged_m]
        groups[name] = np.vstack(walls)
    return replace(mesh, groups=groups), stages


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
