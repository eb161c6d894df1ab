"""Volume that bodies share, counted in 512 parts of a body, and how deep they are in each other."""

import math
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.products import cross, dot, entry, expression, matvec
from taichi_dem.kit.types import vec3, vec4
from taichi_dem.mesh.tetrahedra import (
    all_faces,
    area_vectors,
    penetration,
    points_of_parts,
    signed_volumes,
)
from taichi_dem.physics.body_overlap import mat4, mat43, raised, smallest
from taichi_dem.physics.rotation_arrays import rotations
from taichi_dem.report.readings import Kept, Run
from taichi_dem.scene import remedy

#: Share of the smaller body beyond which two bodies count as within each other.
DEEP = 0.1
#: The same beyond which a report warns although contact is listed.
NOTABLE = 0.25
#: Depth of two bodies in each other, over the height of the smaller one, from which on it is told.
DEPTH = 0.05
#: Way of a body, as a share of its radius, after which all are compared again.
MOVED = 0.25
#: Pairs that there is room for at first.
_ROOM = 1024
#: Depth below which nothing is within a body, over its height above that face.
_ROUNDING = 1e-12
#: Halvings of a body's edges, for a first look and for the figure: each part stands for its volume
#: by a point.
_HALVINGS = 2, 3


@dataclass(frozen=True)
class Interpenetration:
    """Pairs of bodies that share volume at a time.

    Parameters
    ----------
    share : float, default 0.0
        Largest share of the volume of the smaller body that a pair shares.
    bodies : tuple, default (-1, -1)
        The pair of bodies.
    time_s : float, default 0.0
        Time of that [s].
    deep : int, default 0
        Largest number of pairs at one time that share more than ``DEEP``.
    depth_share : float, default 0.0
        Largest way that parts a pair, over the least height of the smaller body; 0 below ``DEPTH``.
    depth_m : float, default 0.0
        That way [m]; where other bodies are in the way, the depth is at least that.
    deepest : tuple, default (-1, -1)
        The pair of bodies.
    deepest_s : float, default 0.0
        Time of that [s].
    """

    share: float = 0.0
    bodies: tuple = (-1, -1)
    time_s: float = 0.0
    deep: int = 0
    depth_share: float = 0.0
    depth_m: float = 0.0
    deepest: tuple = (-1, -1)
    deepest_s: float = 0.0

    @property
    def depth(self) -> str:
        """How deep the deepest pair is, in words; "" where none is."""
        if not self.depth_share:
            return ""
        first, second = self.deepest
        return (
            f"bodies {first} and {second} overlapped by {1e3 * self.depth_m:.3g} mm at "
            f"t = {self.deepest_s:.4g} s, {100.0 * self.depth_share:.2g} % of the height of the "
            "smaller one"
        )

    def __str__(self):
        return "; ".join(filter(None, (self._shared(), self.depth)))

    def _shared(self):
        if self.share == 0.0:
            return "no volume shared"
        first, second = self.bodies
        return (
            f"bodies {first} and {second} share {100.0 * self.share:.2g} % of the smaller one at "
            f"t = {self.time_s:.4g} s, most; {self.deep} pairs share more than {100.0 * DEEP:g} %"
        )


class SharedVolume(Kept):
    """Finds bodies within each other, at the start and at recording times after some body moved.

    Of the last look: pairs (n, 2) that share volume and their share of the smaller body (n,); close
    (n, 2): pairs that may be deep in each other, and depth: their ways apart [m] (n,).
    figures: those of ``worst`` so far; first: those at the start.
    """

    kept = "place", "orientation", "figures", "first"

    def __init__(self, run: Run):
        self.run, model = run, run.model
        self.arms = model.mesh.points[model.mesh.tetrahedra] - model.centre[:, None]
        self.points = [points_of_parts(halvings) for halvings in _HALVINGS]
        # From nowhere: the first look is never left out.
        self.place = np.full_like(model.centre, np.inf)
        self.orientation = np.zeros((model.body_count, 4))
        self.figures = self.first = np.array([0.0, -1.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0])
        self.pairs, self.share = np.zeros((0, 2), dtype=np.int32), np.zeros(0)
        self.close, self.depth = self.pairs, self.share
        # Of each body above its four faces [m].
        area = area_vectors(model.mesh.points, all_faces(model.mesh.tetrahedra))
        volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra)
        self.height = 3.0 * volume[:, None] / np.linalg.norm(area, axis=1).reshape(-1, 4)

    @property
    def has_looked(self) -> bool:
        """Whether bodies have been compared."""
        return not np.isinf(self.place).all()

    @property
    def worst(self) -> Interpenetration:
        """The worst pair so far."""
        return _told(self.figures)

    def sample(self, time_s: float, finished: bool = False) -> None:
        """Compare the bodies where one has moved, or at the end."""
        if self._way() <= (0.0 if finished else MOVED):
            return
        self.place, self.orientation = self._now()
        self._compare(self.corners())
        share = self.share.max(initial=0.0)
        figures = self.figures.copy()
        if share > figures[0]:
            figures[:4] = share, *self.pairs[self.share.argmax()], time_s
        figures[4] = max(figures[4], (self.share > DEEP).sum())
        self._deepen(figures, time_s)
        self.figures = figures
        if time_s == 0.0:
            self.first = figures

    def _deepen(self, figures, time_s):
        """Take in the depth of the deepest pair."""
        lowest, mass = self.height.min(axis=1), self.run.model.body_mass
        small = np.where(np.diff(mass[self.close], axis=1)[:, 0] < 0.0, *self.close.T[::-1])
        share = self.depth / lowest[small]
        if share.max(initial=0.0) > max(DEPTH, figures[5]):
            worst = int(share.argmax())
            figures[5:] = share[worst], self.depth[worst], *self.close[worst], time_s

    def _way(self):
        """Longest way of a body since the last look, as a share of its radius."""
        place, orientation = self._now()
        # A motion whose square is no number is that of a runaway, which the divergence check names.
        with np.errstate(over="ignore"):
            travelled = length(place - self.place) / self.run.model.body_radius
            # The norm of the difference of both rotation matrices.
            turn = length(orientation - self.orientation) * length(orientation + self.orientation)
            return float((travelled + math.sqrt(2.0) * turn).max())

    def _now(self):
        """Positions [m] and orientations of the bodies."""
        state, here = self.run.state, slice(self.run.model.body_count)
        return values(state.position, here), values(state.orientation, here)

    def corners(self, bodies: Any = slice(None)) -> np.ndarray:
        """Corners of some bodies at present [m], (n, 4, 3)."""
        place, orientation = self._now()
        turn = rotations(orientation[bodies])
        return place[bodies, None] + np.einsum("nij,ncj->nci", turn, self.arms[bodies])

    def findings(self) -> tuple[str, ...]:
        """Sentences where bodies are within each other although contact is listed; or none."""
        contact, worst, first = self.run.model.contact, self.worst, _told(self.first)
        findings = [*self.at_start()]
        if contact is None or worst == first:
            return tuple(findings)
        law = type(contact).__name__
        advice = f"a larger {contact.knob} or more points in {law} keep them apart"
        if not contact.geometry.outer_faces:
            advice = f"{remedy(contact)} lets them touch there too"
        if worst.share > max(NOTABLE, first.share):
            findings.append(f"{_words(worst, f't = {worst.time_s:.4g} s')}: {advice}")
        if worst.depth_share > first.depth_share:
            findings.append(f"{worst.depth}: {advice}")
        return tuple(findings)

    def at_start(self) -> tuple[str, ...]:
        """A sentence where bodies that may touch begin within each other; or none."""
        contact, first = self.run.model.contact, _told(self.first)
        words = first.depth if first.share == 0.0 else _words(first, "the start")
        if contact is None or not words:
            return ()
        rest = f", or {type(contact).__name__} takes their overlap as unloaded"
        return (f"{words}: move them apart{rest * (not contact.geometry.by_face)}",)

    def _compare(self, corners):
        """Find all pairs and their shares; corners (n, 4, 3) [m]."""
        # Bond -1 stands for an outer face, which is as free as a broken one.
        free = np.append(self.run.state.broken(), True)[self.run.model.topology.body_bond]
        surface = np.flatnonzero(free.any(axis=1))
        tied = np.where(free, -1, self.run.model.neighbours)
        order, last = _in_rows(corners[surface])
        body = surface[order].astype(np.int32)
        own = np.ascontiguousarray(corners[body])
        box = np.stack([own.min(axis=1), own.max(axis=1)], axis=1)
        mass, count = np.ascontiguousarray(self.run.model.body_mass[body]), np.ones(1, np.int32)
        overlaps, height = np.zeros((0, 4)), np.ascontiguousarray(self.height[body])
        while count[0] > len(overlaps):
            overlaps, count = np.zeros((max(_ROOM, count[0]), 4)), np.zeros(1, np.int32)
            _launch_pairs(last, box, own, mass, height, *self.points, overlaps, count)
        overlaps = overlaps[: count[0]]
        pairs = body[overlaps[:, :2].astype(np.int32)]
        strangers = (tied[pairs[:, 0]] != pairs[:, 1:]).all(axis=1)
        order = np.lexsort(overlaps[strangers][:, [1, 0]].T)
        pairs = np.sort(pairs[strangers][order], axis=1)
        self.share, near = overlaps[strangers][order, 2:].T
        self.pairs, self.share = pairs[self.share > 0.0], self.share[self.share > 0.0]
        self.close = pairs[near > 0.0]
        self.depth = penetration(*corners[self.close].swapaxes(0, 1))


def _told(figures):
    """Figures as an ``Interpenetration``."""
    share, first, second, time_s, deep, sunk, travelled, body, other, then = figures.tolist()
    deepest = sunk, travelled, (int(body), int(other)), then
    return Interpenetration(share, (int(first), int(second)), time_s, int(deep), *deepest)


def _words(found, when):
    """An ``Interpenetration`` at a time as the beginning of a sentence."""
    return (
        f"bodies {found.bodies[0]} and {found.bodies[1]} share {100.0 * found.share:.2g} % of the "
        f"smaller one at {when}, and {found.deep} pairs more than {100.0 * DEEP:g} %"
    )


def _in_rows(corners):
    """Order of bodies along the longest axis, and the place up to which each may overlap."""
    axis = np.ptp(corners, axis=(0, 1)).argmax()
    begin, end = corners[..., axis].min(axis=1), corners[..., axis].max(axis=1)
    order = np.argsort(begin, kind="stable")
    return order, np.searchsorted(begin[order], end[order]).astype(np.int32)


@ti.kernel
def _find_pairs(
    last: ti.types.ndarray(dtype=ti.i32, ndim=1),
    box: ti.types.ndarray(dtype=vec3, ndim=2),
    corners: ti.types.ndarray(dtype=mat43, ndim=1),
    mass: ti.types.ndarray(dtype=ti.f64, ndim=1),
    height: ti.types.ndarray(dtype=vec4, ndim=1),
    few: ti.types.ndarray(dtype=vec4, ndim=1),
    many: ti.types.ndarray(dtype=vec4, ndim=1),
    found: ti.types.ndarray(dtype=ti.f64, ndim=2),
    count: ti.types.ndarray(dtype=ti.i32, ndim=1),
):
    """Count and write pairs of bodies that share volume, as far as there is room, in any order."""
    for i in range(last.shape[0]):
        for j in range(i + 1, last[i]):
            if (box[i, 0] < box[j, 1]).all() and (box[j, 0] < box[i, 1]).all():
                small, large = i, j
                if mass[i] > mass[j]:
                    small, large = j, i
                share, near = 0.0, 0.0
                depths = _depths(corners[large], corners[small])
                if _reach(depths, vec4(1.0)) > _ROUNDING:
                    if _share(depths, few) > 0.0:
                        share = _share(depths, many)
                    if _reach(depths, height[large]) > DEPTH * height[small].min():
                        near = 1.0
                if share + near > 0.0:
                    a = ti.atomic_add(count[0], 1)
                    if a < found.shape[0]:
                        found[a, 0], found[a, 1], found[a, 2], found[a, 3] = i, j, share, near


_launch_pairs = Launch(_find_pairs)


@ti.func
def _depths(first, second):
    """Of each corner of the second body below each face of the first, over its height, (4, 4)."""
    depths = mat4(0.0)
    for f in ti.static(range(4)):
        base = first[(f + 1) % 4, :]
        normal = cross(first[(f + 2) % 4, :] - base, first[(f + 3) % 4, :] - base)
        normal /= dot(normal, first[f, :] - base)
        depths[f, :] = matvec(raised(second, -base), normal)
    return depths


@expression
def _reach(depths, height):
    """Least of the four depths that the corners reach below a face, times a height of each face."""
    highest = (reduce(ti.max, (entry(depths, f, c) for c in range(4))) for f in range(4))
    return reduce(ti.min, (depth * entry(height, f) for f, depth in enumerate(highest)))


@ti.func
def _share(depths, points: ti.template()):
    """Share of the points of a body that lie below all faces of the other."""
    count = 0
    for m in range(points.shape[0]):
        count += ti.cast(smallest(matvec(depths, points[m])) > 0.0, ti.i32)
    return count / ti.cast(points.shape[0], ti.f64)
