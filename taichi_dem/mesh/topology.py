"""Bonds, free faces, parts, mass properties and contact spheres of bodies (NumPy only)."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import dot, length, product, transposed
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.mesh import Mesh

#: Density of all bodies [kg/m3], or of each, (body_count,).
Density = float | np.ndarray
#: Share of the mesh's extent by which a point may lie outside of a body: rounding.
_ROUNDING = 1e-9
#: How far a part may come by deforming and breaking, as a share of its longest side. Nobody can
#: know before the run; so parts count as near each other up to the length of one of them.
NEARNESS = 0.5
#: Steps towards the centre of a small ball around spheres, and a negligible distance [m].
_CENTRINGS, _SMALL = 10, 1e-300


@dataclass(frozen=True, eq=False)
class Topology:
    """Bonds, which are shared faces, and free faces of a mesh; int32 indices.

    The master is the body of lower index (Konno et al., section 2.1); bonds are sorted by (master,
    slave). vertices: points of the face, right-hand normal out of the master. body_bond: bond at
    local face f of a body, -1 at an outer face. is_open: whether a body lies behind a free face.
    """

    master: np.ndarray
    slave: np.ndarray
    master_face: np.ndarray
    slave_face: np.ndarray
    vertices: np.ndarray
    body_bond: np.ndarray
    outer_body: np.ndarray
    outer_face: np.ndarray
    is_open: np.ndarray
    bonded_share: np.ndarray
    groups: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict, repr=False)

    @property
    def bond_count(self) -> int:
        """Number of shared faces."""
        return len(self.master)

    @property
    def outer_count(self) -> int:
        """Number of faces without a bond."""
        return len(self.outer_body)


@lru_cache(maxsize=1)
def topology_of(mesh: Mesh) -> Topology:
    """Match the faces of all bodies; that of the last mesh is kept, which several ask for."""
    rows, share = _bonded_faces(mesh)
    order = np.lexsort((rows[:, 1] // 4, rows[:, 0] // 4))
    rows, share = rows[order].astype(np.int32), share[order]
    body, face = rows // 4, rows % 4
    body_bond = np.full((mesh.body_count, 4), -1, dtype=np.int32)
    for side in (0, 1):
        body_bond[body[:, side], face[:, side]] = np.arange(len(rows))
    outer_body, outer_face = np.nonzero(body_bond < 0)
    shared = np.zeros(4 * mesh.body_count, dtype=bool)
    shared[geometry.shared_faces(mesh.tetrahedra).ravel()] = True
    return Topology(
        master=body[:, 0].copy(),
        slave=body[:, 1].copy(),
        master_face=face[:, 0].copy(),
        slave_face=face[:, 1].copy(),
        vertices=geometry.all_faces(mesh.tetrahedra)[rows[:, 0]],
        body_bond=body_bond,
        outer_body=outer_body.astype(np.int32),
        outer_face=outer_face.astype(np.int32),
        is_open=shared[4 * outer_body + outer_face],
        bonded_share=share,
    )


def _bonded_faces(mesh):
    """Pairs of faces 4 * body + f with a bond, (n, 2), and the bonded share of each, (n,)."""
    rows = geometry.shared_faces(mesh.tetrahedra)
    share = np.ones(len(rows))
    if mesh.bonded_shares:
        faces = geometry.all_faces(mesh.tetrahedra)[rows[:, 0]]
        groups = [mesh.group_faces(name) for name, _ in mesh.bonded_shares]
        number, *members = geometry.numbers_in(faces, *groups)
        of_face = np.ones(1 + max(map(np.max, (number, *members))))
        for (_, least), mine in zip(mesh.bonded_shares, members):
            of_face[mine] = np.minimum(of_face[mine], least)
        share = of_face[number]
    return rows[share > 0.0], share[share > 0.0]


def skin(topology: Topology, broken: Any) -> Any:
    """Faces that show: outer ones and both sides of broken bonds."""
    bodies = (topology.outer_body, topology.master[broken], topology.slave[broken])
    faces = (topology.outer_face, topology.master_face[broken], topology.slave_face[broken])
    body = np.concatenate(bodies)
    return body, np.concatenate(faces), np.arange(len(body)) >= topology.outer_count


def face_vertices(mesh: Mesh, body: np.ndarray, face: np.ndarray) -> np.ndarray:
    """Points of local faces in the order whose right-hand normal points outward, (n, 3) int32."""
    return np.take_along_axis(mesh.tetrahedra[body], geometry.LOCAL_FACES[face], axis=1)


def faces_of_group(mesh: Mesh, topology: Topology, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Body and local face of every face of a group, two arrays (n,) int32, in the group's order."""
    check_free(mesh, name)
    if name not in topology.groups:
        topology.groups[name] = _faces_of_group(mesh, topology, name)
    return topology.groups[name]


def _faces_of_group(mesh, topology, name):
    outer = face_vertices(mesh, topology.outer_body, topology.outer_face)
    number, wanted = geometry.numbers_in(outer, mesh.group_faces(name))
    place = np.full(max(number.max(), wanted.max()) + 1, -1)
    place[wanted] = np.arange(len(wanted))
    faces = np.flatnonzero(place[number] >= 0)
    faces = faces[np.argsort(place[number[faces]], kind="stable")]
    return topology.outer_body[faces], topology.outer_face[faces]


def check_free(mesh: Mesh, name: str) -> None:
    """Raise InputError for a group of inner faces that bonds join: nothing acts on them."""
    if name in mesh.inner_groups and (name, 0.0) not in mesh.bonded_shares:
        raise InputError(
            f"group {name} must be of outer faces, or unbonded (Scene(unbonded=[{name!r}])), "
            "got inner faces that are bonded"
        )


def body_properties(mesh: Mesh, density: Density) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass [kg] (n,), centre of mass [m] (n, 3), inertia about it [kg m2] (n, 3, 3)."""
    # Second moment S = m/20 sum_k x_k x_k^T about the centroid, inertia tr(S) 1 - S (F. Tonon, J.
    # Math. Stat. 1(1), 2005, 8-11).
    corners = mesh.points[mesh.tetrahedra]
    centre = corners.mean(axis=1)
    mass = density * geometry.signed_volumes(mesh.points, mesh.tetrahedra)
    arms = corners - centre[:, None]
    second = mass[:, None, None] / 20.0 * product(transposed(arms), arms)
    trace = np.trace(second, axis1=1, axis2=2)
    return mass, centre, trace[:, None, None] * np.eye(3) - second


def body_at(mesh: Mesh, name: str, point: np.ndarray) -> int:
    """Number of the body that holds a point, the lowest where several share it."""
    faces = geometry.all_faces(mesh.tetrahedra)
    normal = geometry.unit_normals(mesh.points, faces)
    outside = dot(point - mesh.points[faces[:, 0]], normal).reshape(-1, 4).max(axis=1)
    holding = np.flatnonzero(outside <= _ROUNDING * np.ptp(mesh.points, axis=0).max())
    if len(holding):
        return int(holding[0])
    away = length(mesh.points[mesh.tetrahedra].mean(axis=1) - point)
    raise InputError(
        f"{name} must lie in a body, got ({point[0]:g}, {point[1]:g}, {point[2]:g}) m; the centre "
        f"of the nearest, body {away.argmin()}, is {away.min():.3g} m away"
    )


def parts_of(mesh: Mesh) -> np.ndarray:
    """Number of the part of each body, from 0, (body_count,)."""
    joined = geometry.components(mesh.body_count, _bonded_faces(mesh)[0] // 4)
    return np.unique(joined, return_inverse=True)[1].reshape(-1)


def part_boxes(corners: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boxes around parts: lowest and highest coordinates [m], two arrays (part_count, 3)."""
    order = np.argsort(part, kind="stable")
    first = np.searchsorted(part[order], np.arange(part.max() + 1))
    low = np.minimum.reduceat(corners.min(axis=1)[order], first)
    return low, np.maximum.reduceat(corners.max(axis=1)[order], first)


def any_overlap(low: np.ndarray, high: np.ndarray) -> bool:
    """Whether two boxes overlap; touching is not enough."""
    # Sorted by their lower x, a box is compared only with boxes that begin before its end.
    order = np.argsort(low[:, 0], kind="stable")
    low, high = low[order], high[order]
    ends = np.searchsorted(low[:, 0], high[:, 0])
    return any(
        ((low[k + 1 : end] < high[k]) & (low[k] < high[k + 1 : end])).all(axis=1).any()
        for k, end in enumerate(ends.tolist())
    )


def may_meet(scene: Any, part: np.ndarray) -> bool:
    """Whether parts of a scene at rest may meet, as far as can be known before a run."""
    # Each part may move by ``NEARNESS`` of its size, by ``BodyEffect.travel``, and without end
    # along its velocity relative to the mean; displacements that all parts share do not count.
    drives = [effect for effect in scene.effects if effect.role in ("load", "support")]
    travels = np.array([effect.travel() for effect in drives]).reshape(-1, 2, 3)
    anywhere = np.isinf(travels).all(axis=(1, 2))
    flights = _flights(scene, part)
    weight_only = not any(hasattr(effect, "group") for effect in drives) and not anywhere.any()
    if (weight_only or not travels.any()) and not flights.any():
        return False
    low, high = part_boxes(scene.mesh.points[scene.mesh.tetrahedra], part)
    reach = NEARNESS * (high - low).max(axis=1, keepdims=True)
    low, high = low - reach + flights[0], high + reach + flights[1]
    acts = np.array([parts_under(scene.mesh, effect, part) for effect in drives], dtype=bool)
    acts = acts.reshape(-1, part.max() + 1)
    alike = (acts == acts[:, :1]).all()
    for travel, on in zip(travels[anywhere] if alike else travels, acts[anywhere | ~alike]):
        low[on] += travel[0]
        high[on] += travel[1]
    return any_overlap(low, high)


def _flights(scene, part):
    """Lowest and highest displacement of parts by their initial velocities, (2, part_count, 3)."""
    count = part.max() + 1
    flights = np.zeros((2, count, 3))
    if scene.initial_motion:
        rows = scene.initial_motion["velocity"]
        sums = np.array([np.bincount(part, along, count) for along in rows.T]).T
        velocity = sums / np.bincount(part, minlength=count)[:, None]
        beside = velocity - velocity.mean(axis=0)
        # Rounding of the mean makes no part move against the others.
        moving = np.abs(beside) > 1e-9 * np.abs(velocity).max()
        flights[0][moving & (beside < 0.0)] = -np.inf
        flights[1][moving & (beside > 0.0)] = np.inf
    return flights


def parts_under(mesh: Mesh, effect: Any, part: np.ndarray) -> np.ndarray:
    """Whether a load, support or ground acts on each part, (part_count,)."""
    marks = np.zeros(part.max() + 1, dtype=bool)
    body: slice | np.ndarray = slice(None)
    if hasattr(effect, "group"):
        body, _ = faces_of_group(mesh, topology_of(mesh), effect.group)
    marks[part[body]] = True
    return marks


def edge_colours(links: np.ndarray, body_count: int) -> np.ndarray:
    """Colour of every link, (n,) from 0 on; links that share a body differ."""
    # Greedy; before a new colour is taken, a chain of two colours is flipped if that frees one.
    # Four bonds a body need at most five colours.
    given = _Colouring(links, body_count)
    (first, second), taken = given.ends, given.taken
    for link, i, j in zip(range(len(first)), first, second):
        both = taken[i] | taken[j]
        colour = (~both & (both + 1)).bit_length() - 1
        given.put(link, colour if colour < len(given.counts) else given.freed(i, j))
    return np.array(given.colours, dtype=np.int32)


class _Colouring:
    """Links that have a colour so far.

    taken: bits of the colours at each body; at: its links by colour; counts: links of each colour.
    """

    def __init__(self, links, body_count):
        self.ends = [array("i", column.astype(np.int32).tobytes()) for column in links.T]
        self.width = 2 * int(np.bincount(links.ravel(), minlength=1).max())
        self.taken, self.counts = [0] * body_count, []
        self.colours = array("i", bytes(4 * len(links)))
        self.at = array("i", bytes(4 * self.width * body_count))

    def put(self, link, colour):
        """Give a link a colour that is free at both of its bodies."""
        if colour == len(self.counts):
            self.counts.append(0)
        self.counts[colour] += 1
        self.colours[link] = colour
        for ends in self.ends:
            body = ends[link]
            self.taken[body] |= 1 << colour
            self.at[self.width * body + colour] = link

    def freed(self, i, j):
        """A colour made free at both bodies by flipping a chain from the second; else a new one."""
        colours = range(len(self.counts))
        for mine in (k for k in colours if not self.taken[i] >> k & 1):
            for other in (k for k in colours if not self.taken[j] >> k & 1):
                chain, end = self._chain(j, mine, other)
                if end != i:
                    self._flip(chain, (j, end), mine, other)
                    return mine
        return len(colours)

    def _chain(self, body, first, second):
        """Links of two alternating colours from a body on, and the body where they end."""
        chain, colour = [], first
        while self.taken[body] >> colour & 1:
            link = self.at[self.width * body + colour]
            chain.append(link)
            body = self.ends[0][link] + self.ends[1][link] - body
            colour = first + second - colour
        return chain, body

    def _flip(self, chain, ends, first, second):
        """Exchange the colours of a chain of links between two bodies."""
        for body in ends:
            self.taken[body] ^= 1 << first | 1 << second
        for link in chain:
            colour = self.colours[link]
            self.counts[colour] -= 1
            self.put(link, first + second - colour)
        while not self.counts[-1]:
            self.counts.pop()


@dataclass(frozen=True, eq=False)
class ContactSpheres:
    """Spheres of every face of every body in body frames [m]: centre (body_count, 4, n, 3), radius.

    cluster: centre and radius of a ball around a face's spheres; extent: radius around a body's.
    """

    centre: np.ndarray
    radius: np.ndarray
    cluster: np.ndarray
    extent: np.ndarray


def interior_crossings(divisions: int) -> np.ndarray:
    """Barycentric coordinates (k, 3) of the interior crossings for edges cut in n equal parts."""
    n = divisions
    rows = [(a, b, n - a - b) for a in range(1, n) for b in range(1, n - a)]
    return np.array(rows, dtype=float) / n


def spheres_of_faces(mesh: Mesh, centre: np.ndarray, divisions: int = 5) -> ContactSpheres:
    """Spheres tangent to their own face and as large as the other three faces allow."""
    # Radius: least of d_g / (1 - m_f . m_g) over the other faces g, with d_g the distance of the
    # touching point from face g and m the inward unit normals.
    faces = geometry.all_faces(mesh.tetrahedra).reshape(-1, 4, 3)
    corners = mesh.points[faces] - centre[:, None, None, :]
    inward = -geometry.area_vectors(mesh.points, faces.reshape(-1, 3)).reshape(-1, 4, 3)
    inward /= length(inward)[..., None]
    touch = product(interior_crossings(divisions), corners)
    height = product(touch, transposed(inward)[:, None])
    height -= dot(corners[:, :, 0], inward)[:, None, None, :]
    slope = 1.0 - product(inward, transposed(inward))
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = height / slope[:, :, None, :]
    allowed[:, np.arange(4), :, np.arange(4)] = np.inf
    radius = allowed.min(axis=-1)
    middle = touch + radius[..., None] * inward[:, :, None, :]
    extent = (length(middle) + radius).max(axis=(1, 2))
    return ContactSpheres(middle, radius, _clusters(middle, radius), extent)


def _clusters(middle, radius):
    """Small balls around the spheres of each face: centre and radius, (body_count, 4, 4)."""
    # Steps towards the farthest sphere shrink; ten take 7 % off the radius on average, a thousand 9
    # % (Badoiu and Clarkson 2003).
    centre = middle.mean(axis=2)
    for k in range(_CENTRINGS):
        away, reach = _reach(middle, radius, centre)
        far = reach.argmax(axis=2)[..., None]
        towards = np.take_along_axis(away, far[..., None], axis=2)[:, :, 0]
        towards /= np.maximum(length(towards)[..., None], _SMALL)
        centre = centre + towards * reach.max(axis=2)[..., None] / (k + 2)
    reach = _reach(middle, radius, centre)[1].max(axis=2)
    return np.concatenate([centre, reach[..., None]], axis=-1)


def _reach(middle, radius, centre):
    away = middle - centre[:, :, None]
    return away, length(away) + radius
