"""Volume that bodies share: the measure of interpenetration, counted in 512 parts of a body.

Bodies are rigid, so two of them that are not bonded may share volume only where nothing keeps them
apart: no contact, faces without spheres, or contact that is too soft or too sparse.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from taichi_dem.kit.types import vec3, vec4
from taichi_dem.mesh.tetrahedra import components, points_of_parts
from taichi_dem.scene import remedy
from taichi_dem.state.model import Model
from taichi_dem.state.state import State

#: Share of the smaller body beyond which two bodies count as within each other.
DEEP = 0.1
#: The same beyond which a report warns although contact is listed.
NOTABLE = 0.25
#: Way of a body, as a share of its radius, after which all are compared again.
MOVED = 0.25
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
    """

    share: float = 0.0
    bodies: tuple = (-1, -1)
    time_s: float = 0.0
    deep: int = 0

    def __str__(self):
        if self.share == 0.0:
            return "no volume shared"
        first, second = self.bodies
        return (
            f"at most {100.0 * self.share:.2g} % of a body, by bodies {first} and {second} at "
            f"{self.time_s:.4g} s; {self.deep} pairs above {100.0 * DEEP:g} %"
        )


class SharedVolume:
    """Finds bodies within each other, at recording times after which some body has moved.

    worst: the ``Interpenetration`` so far. Of the last look: pairs (n, 2) and their share (n,),
    near_pairs (m, 2) all pairs that no plane of a face parts, those that share most first.
    """

    def __init__(self, model: Model, state: State):
        self.model, self.state = model, state
        self.arms = model.mesh.points[model.mesh.tetrahedra] - model.centre[:, None]
        self.points = [points_of_parts(halvings) for halvings in _HALVINGS]
        self.worst = Interpenetration()
        self.seen = model.centre, np.tile(np.eye(3), (model.body_count, 1, 1))
        self.pairs, self.share = np.zeros((0, 2), dtype=np.int32), np.zeros(0)
        self.near_pairs = self.pairs

    def sample(self, time_s: float, finished: bool = False) -> bool:
        """Compare the bodies where one has moved, or at the end; whether they were compared."""
        way = self.way()
        if way <= (0.0 if finished else MOVED):
            return False
        self.seen = self.now()
        self._compare(self.corners(*self.seen))
        self._note(time_s)
        return True

    def way(self) -> float:
        """Longest way of a body since the last look, as a share of its radius."""
        place, turn = self.now()
        # A motion whose square is no number is that of a runaway, which the divergence check names.
        with np.errstate(over="ignore"):
            way = np.linalg.norm(place - self.seen[0], axis=1) / self.model.body_radius
            return float((way + np.linalg.norm(turn - self.seen[1], axis=(1, 2))).max())

    def corners(self, place: np.ndarray, turn: np.ndarray, bodies: Any = slice(None)) -> np.ndarray:
        """Corners of some bodies [m], (n, 4, 3), from places and rotations of all."""
        return place[bodies, None] + np.einsum("nij,ncj->nci", turn[bodies], self.arms[bodies])

    def now(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and rotations of the bodies."""
        here = slice(self.model.body_count)
        return values(self.state.position, here), values(self.state.rotation, here)

    def findings(self) -> tuple[str, ...]:
        """A sentence where bodies are within each other although contact is listed; or none."""
        contact, worst = self.model.contact, self.worst
        if contact is None or worst.share <= NOTABLE:
            return ()
        law = type(contact).__name__
        advice = f"a larger contact_stiffness, or more divisions of {law}, keeps them apart"
        if not contact.outer_faces:
            advice = f"{remedy(contact)} lets them touch there too"
        first, second = worst.bodies
        return (
            f"bodies {first} and {second} share {100.0 * worst.share:.2g} % of the smaller one at "
            f"t = {worst.time_s:.4g} s, and {worst.deep} pairs more than {100.0 * DEEP:g} %: "
            f"{advice}",
        )

    def fragments(self) -> int:
        """Number of pieces that intact bonds hold together."""
        top = self.model.topology
        ends = np.column_stack([top.master, top.slave])[~self.state.broken()]
        return len(np.unique(components(self.model.body_count, ends)))

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        worst = self.worst
        figures = [worst.share, *worst.bodies, worst.time_s, worst.deep]
        return {
            "shared": np.array(figures, dtype=np.float64),
            "seen": self.seen[0].copy(),
            "turned": self.seen[1].copy(),
        }

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        share, first, second, time_s, deep = saved["shared"].tolist()
        self.worst = Interpenetration(share, (int(first), int(second)), time_s, int(deep))
        self.seen = saved["seen"].copy(), saved["turned"].copy()

    def _note(self, time_s):
        deep = max(self.worst.deep, int((self.share > DEEP).sum()))
        found = self.worst.share, self.worst.bodies, self.worst.time_s
        if len(self.share) and self.share.max() > self.worst.share:
            place = int(self.share.argmax())
            found = float(self.share[place]), tuple(self.pairs[place].tolist()), time_s
        self.worst = Interpenetration(*found, deep)

    def _compare(self, corners):
        """Find all pairs and their shares; corners (n, 4, 3) [m]."""
        top, broken = self.model.topology, self.state.broken()
        # Bond -1 stands for an outer face, which is as free as a broken one.
        free = np.append(broken, True)[top.body_bond]
        surface = np.flatnonzero(free.any(axis=1))
        tied = np.full((self.model.body_count, 4), -1, dtype=np.int32)
        ends = np.column_stack([top.master, top.slave])
        for body, bonds in ((top.master, top.master_face), (top.slave, top.slave_face)):
            other = ends.sum(axis=1) - body
            tied[body, bonds] = np.where(broken, -1, other)
        order, last = _in_rows(corners[surface])
        body = surface[order].astype(np.int32)
        own = np.ascontiguousarray(corners[body])
        box = np.concatenate([own.min(axis=1), own.max(axis=1)], axis=1)
        args = last, box, own, body, np.ascontiguousarray(tied[body])
        count = np.zeros(len(body) + 1, dtype=np.int32)
        _near_pairs(*args, count, np.zeros((1, 2), dtype=np.int32), False)
        first = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int32)
        places = np.zeros((max(1, int(count.sum())), 2), dtype=np.int32)
        _near_pairs(*args, first, places, True)
        near = np.sort(body[places[: int(count.sum())]], axis=1)
        volume = np.ascontiguousarray(self.model.body_mass[body])
        share = np.ones(len(near))
        for points in self.points:
            left = np.flatnonzero(share > 0.0)
            found = np.zeros(len(left))
            _shares(own, np.ascontiguousarray(places[left]), volume, points, found)
            share[left] = found
        self.near_pairs = near[np.argsort(-share, kind="stable")]
        self.pairs, self.share = near[left], found


def _in_rows(corners):
    """Order of bodies along the longest axis, and the place up to which each may overlap."""
    axis = np.ptp(corners, axis=(0, 1)).argmax()
    begin, end = corners[..., axis].min(axis=1), corners[..., axis].max(axis=1)
    order = np.argsort(begin, kind="stable")
    return order, np.searchsorted(begin[order], end[order]).astype(np.int32)


@ti.kernel
def _near_pairs(
    last: ti.types.ndarray(dtype=ti.i32, ndim=1),
    box: ti.types.ndarray(dtype=ti.f64, ndim=2),
    corners: ti.types.ndarray(dtype=ti.f64, ndim=3),
    body: ti.types.ndarray(dtype=ti.i32, ndim=1),
    tied: ti.types.ndarray(dtype=ti.i32, ndim=2),
    place: ti.types.ndarray(dtype=ti.i32, ndim=1),
    pairs: ti.types.ndarray(dtype=ti.i32, ndim=2),
    write: bool,
):
    """Count, or write from their places on, pairs of bodies that no plane of a face parts."""
    for i in range(last.shape[0]):
        count = 0
        for j in range(i + 1, last[i]):
            if _boxes_meet(box, i, j) == 1 and _strangers(tied, body, i, j) == 1:
                if _outside(corners, i, j) == 0 and _outside(corners, j, i) == 0:
                    if write:
                        pairs[place[i] + count, 0], pairs[place[i] + count, 1] = i, j
                    count += 1
        if not write:
            place[i] = count


@ti.func
def _strangers(tied: ti.template(), body: ti.template(), i, j):
    """1 for bodies that no bond holds together."""
    strangers = 1
    for f in ti.static(range(4)):
        strangers *= ti.cast(tied[i, f] != body[j], ti.i32)
    return strangers


@ti.func
def _boxes_meet(box: ti.template(), i, j):
    """1 where the boxes around two bodies overlap."""
    meet = 1
    for k in ti.static(range(3)):
        meet *= ti.cast(box[i, k] < box[j, 3 + k] and box[j, k] < box[i, 3 + k], ti.i32)
    return meet


@ti.func
def _corner(corners: ti.template(), i, c):
    return vec3(corners[i, c, 0], corners[i, c, 1], corners[i, c, 2])


@ti.func
def _plane(corners: ti.template(), i, f):
    """Plane of the face opposite corner f: inward normal, 1 at that corner, and its offset."""
    base = _corner(corners, i, (f + 1) % 4)
    second, third = _corner(corners, i, (f + 2) % 4), _corner(corners, i, (f + 3) % 4)
    normal = (second - base).cross(third - base)
    normal /= normal.dot(_corner(corners, i, f) - base)
    return vec4(normal[0], normal[1], normal[2], -normal.dot(base))


@ti.func
def _outside(corners: ti.template(), i, j):
    """1 where all corners of body j lie beyond one face of body i."""
    outside, f = 0, 0
    while f < 4 and outside == 0:
        plane, inside = _plane(corners, i, f), 0
        for c in range(4):
            height = plane.xyz.dot(_corner(corners, j, c)) + plane[3]
            inside |= ti.cast(height > 0.0, ti.i32)
        outside = 1 - inside
        f += 1
    return outside


@ti.kernel
def _shares(
    corners: ti.types.ndarray(dtype=ti.f64, ndim=3),
    pairs: ti.types.ndarray(dtype=ti.i32, ndim=2),
    volume: ti.types.ndarray(dtype=ti.f64, ndim=1),
    points: ti.types.ndarray(dtype=ti.f64, ndim=2),
    share: ti.types.ndarray(dtype=ti.f64, ndim=1),
):
    """Share of the smaller body of every pair whose parts lie within the other."""
    for a in range(pairs.shape[0]):
        small, large = pairs[a, 0], pairs[a, 1]
        if volume[small] > volume[large]:
            small, large = large, small
        count = 0
        planes = ti.Matrix.zero(ti.f64, 4, 4)
        for f in ti.static(range(4)):
            plane = _plane(corners, large, f)
            for k in ti.static(range(4)):
                planes[f, k] = plane[k]
        for m in range(points.shape[0]):
            point = vec3(0.0)
            for c in ti.static(range(4)):
                point += points[m, c] * _corner(corners, small, c)
            inside = 1
            for f in ti.static(range(4)):
                height = vec3(planes[f, 0], planes[f, 1], planes[f, 2]).dot(point) + planes[f, 3]
                inside &= ti.cast(height > 0.0, ti.i32)
            count += inside
        share[a] = count / ti.cast(points.shape[0], ti.f64)
