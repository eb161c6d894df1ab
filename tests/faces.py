"""A tetrahedron at a block of many, and the energy of their contact of faces, in NumPy."""

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.mesh.tetrahedra import all_faces
from tests.turns import matrix

WIDE = 0.08


def segment_distance(c, p, q):
    """Distance of points c (..., 3) from a segment."""
    way = q - p
    share = np.clip(((c - p) @ way) / (way @ way), 0.0, 1.0)
    return np.linalg.norm(c - p - share[..., None] * way, axis=-1)


def triangle_distance(c, corners):
    """Distance of points c (..., 3) from a triangle: its plane where above it, or its edges."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    height = (c - corners[0]) @ normal
    edges = [(corners[k], corners[(k + 1) % 3]) for k in range(3)]
    inside = np.ones(c.shape[:-1], dtype=bool)
    for p, q in edges:
        inside &= (c - p) @ np.cross(normal, q - p) >= 0.0
    beside = np.min([segment_distance(c, p, q) for p, q in edges], axis=0)
    return np.where(inside, np.abs(height), beside)


def cracked():
    """The block in two parts that touch, and are bonded nowhere."""
    half = bar(0.75 * WIDE, WIDE, (2, 2, 2))
    apart = {"left": (half, (0.0, 0.0, 0.0)), "right": (half, (0.75 * WIDE, 0.0, 0.0))}
    return placed_together(apart, keep_coincident=True)


def ring():
    """A block with a square hole through it: its sides have corners that are not convex."""
    whole = bar(1.5 * WIDE, WIDE, (3, 3, 1))
    middle = whole.points[whole.tetrahedra].mean(axis=1) - 0.5 * whole.points.max(axis=0)
    outside = (np.abs(middle) > WIDE / np.array([4.0, 6.0, 1.0]))[:, :2].any(axis=1)
    kept = whole.tetrahedra[outside]
    used, tetrahedra = np.unique(kept, return_inverse=True)
    return checked_mesh(whole.points[used], tetrahedra.reshape(kept.shape), {})


def within_any(points, corners):
    """Whether any of some points lies in any body; corners of their faces (n, 4, 3, 3)."""
    outward = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    heights = np.einsum("pnfk,nfk->pnf", points[:, None, None] - corners[:, :, 0], outward)
    return bool((heights < 0.0).all(axis=2).any())


class AtABlock:
    """The last body of a mesh, a tetrahedron, is put somewhere; all others rest as a block."""

    def __init__(self, block, material=CONCRETE):
        self.block = block
        parts = {"block": (self.block, (0.0,) * 3), "body": (single(0.05), (1.0, 0.0, 0.0))}
        listed = [effects.FaceContact(spheres_per_body=4000, pairs_per_body=100)]
        mesh = placed_together(parts, keep_coincident=True)
        self.simulation = Simulation(Scene(mesh, material, listed), Uniform(1e-9))
        self.model, self.state = self.simulation.model, self.simulation.state
        self.simulation.start()
        size = self.model.spheres.per_face
        self.sphere = self.simulation.values(self.simulation.tables.sphere)
        self.sphere = self.sphere[: 4 * size * self.model.body_count].reshape(-1, 4, size, 4)
        self.low, self.high = self.block.points.min(axis=0), self.block.points.max(axis=0)
        self.outer = self.model.topology.body_bond[:-1] < 0
        self.corners = mesh.points[all_faces(mesh.tetrahedra)].reshape(-1, 4, 3, 3)

    def put(self, place, orientation):
        """Put the tetrahedron there and search."""
        position = self.model.centre.copy()
        position[-1] = place
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (self.model.body_count, 1))
        turned[-1] = orientation
        self.state.set_motion(position, turned)
        self.simulation.broad_phase.search()

    def energy(self):
        """Elastic energy of all contacts [J]."""
        return self.simulation.energy_balance.account()["sphere_strain"]

    def gaps(self):
        """Distances less radii of the tetrahedron's spheres from the free faces of every body of
        the block, and of the block's free spheres from the tetrahedron, (spheres, bodies) each;
        whether a centre lies within the other solid."""
        motion = self.state.motion()
        rotation, place = motion["rotation"][-1], motion["position"][-1]
        own = self.sphere[-1].reshape(-1, 4)
        centre = own[:, :3] @ rotation.T + place
        away = np.full((len(self.outer), len(own)), np.inf)
        for body, face in np.argwhere(self.outer):
            away[body] = np.minimum(away[body], triangle_distance(centre, self.corners[body, face]))
        others = self.sphere[:-1] + 0.0
        others[..., :3] += self.model.centre[:-1, None, None]
        others = others[self.outer].reshape(-1, 4)
        turned = (self.corners[-1] - self.model.centre[-1]) @ rotation.T + place
        near = np.min([triangle_distance(others[:, :3], face) for face in turned], axis=0)
        within = within_any(centre, self.corners[:-1]) or within_any(others[:, :3], turned[None])
        return np.concatenate([(away - own[:, 3]).ravel(), near - others[:, 3]]), within

    def drawn(self, random):
        """A place near the block's surface and an orientation.

        In most cases the centre of a sphere is above an edge of the surface, exactly but for
        rounding, and in some of these the tetrahedron is not turned.
        """
        orientation = random.standard_normal(4)
        if random.random() < 0.25:
            orientation = np.array([1.0, 0.0, 0.0, 0.0])
        orientation /= np.linalg.norm(orientation)
        if random.random() < 0.2:
            return random.uniform(self.low - 0.02, self.high + 0.02), orientation
        face = self.corners[:-1][self.outer][random.integers(self.outer.sum())]
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        sphere = self.sphere[-1].reshape(-1, 4)[random.integers(self.sphere[-1].size // 4)]
        edge = face[0] + random.choice([0.0, random.random()]) * (face[1] - face[0])
        above = sphere[3] * random.uniform(0.9, 1.0) / np.linalg.norm(normal)
        return edge + above * normal - matrix(orientation) @ sphere[:3], orientation
