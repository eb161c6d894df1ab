"""A tetrahedron at a block of many, and the energy of their contact of faces, in NumPy."""

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.mesh.tetrahedra import LOCAL_FACES

LONG, WIDE, CELLS = 0.12, 0.08, (3, 2, 2)


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


class AtABlock:
    """The last body of a mesh, a tetrahedron, is put somewhere; all others rest as a block."""

    def __init__(self, method=None, contact=None, material=CONCRETE):
        self.block = bar(LONG, WIDE, CELLS)
        parts = {"block": (self.block, (0.0,) * 3), "body": (single(0.05), (1.0, 0.0, 0.0))}
        listed = [contact or effects.FaceContact()]
        scene = Scene(placed_together(parts), material, listed)
        self.simulation = Simulation(scene, method or Uniform(1e-9))
        self.model, self.state = self.simulation.model, self.simulation.state
        self.simulation.start()
        size = self.model.spheres.per_face
        self.sphere = self.simulation.tables.sphere.to_numpy()
        self.sphere = self.sphere[: 4 * size * self.model.body_count].reshape(-1, 4, size, 4)
        self.low, self.high = self.block.points.min(axis=0), self.block.points.max(axis=0)
        self.outer = self.model.topology.body_bond[:-1] < 0

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
        """Distances less radii of the tetrahedron's spheres from the six sides, and of the block's
        outer spheres from the four faces; whether a centre lies within the other body."""
        motion = self.state.motion()
        rotation, place = motion["rotation"][-1], motion["position"][-1]
        own = self.sphere[-1].reshape(-1, 4)
        centre = own[:, :3] @ rotation.T + place
        gaps, held = [], np.clip(centre, self.low, self.high)
        for axis in range(3):
            for bound in (self.low, self.high):
                side = held.copy()
                side[:, axis] = bound[axis]
                gaps.append(np.linalg.norm(centre - side, axis=1) - own[:, 3])
        others = self.sphere[:-1] + 0.0
        others[..., :3] += self.model.centre[:-1, None, None]
        others = others[self.outer].reshape(-1, 4)
        mesh = self.model.mesh
        corners = mesh.points[mesh.tetrahedra[-1]] - self.model.centre[-1]
        corners = corners @ rotation.T + place
        within = np.ones(len(others), dtype=bool)
        for face in LOCAL_FACES:
            triangle = corners[face]
            gaps.append(triangle_distance(others[:, :3], triangle) - others[:, 3])
            outward = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
            within &= (others[:, :3] - triangle[0]) @ outward < 0.0
        return np.concatenate(gaps), bool((held == centre).all(axis=1).any() or within.any())

    def drawn(self, random):
        """A place near the block's surface and an orientation."""
        place = random.uniform(self.low - 0.02, self.high + 0.02)
        orientation = random.standard_normal(4)
        return place, orientation / np.linalg.norm(orientation)
