"""Meshes of which the elastic constants are known, and random ones, without a mesh generator."""

import itertools
from dataclasses import replace

import numpy as np

from cases.meshes import with_moved_nodes
from taichi_dem import CONCRETE, Material, checked_mesh
from taichi_dem.mesh.shapes import bar

E, NU, DENSITY = 32e9, 0.2, 2450.0
#: A firm, heavy ore with weak bonds.
ORE = replace(
    CONCRETE,
    density=4000.0,
    normal_stiffness=900e9,
    shear_stiffness=150e9,
    normal_damping=10e6,
    tensile_strength=4e6,
    cohesion=5e6,
    friction=0.3,
    fracture_energy=60.0,
    contact_stiffness=4e9,
    contact_damping=1e6,
)


def rock(**changed):
    """A material from what is measured."""
    values = {
        "young": E,
        "poisson": NU,
        "density": DENSITY,
        "tensile_strength": 3e6,
        "fracture_energy": 100.0,
        "friction_angle": 30.0,
        "cohesion": 6e6,
    }
    return Material.from_elastic(**{**values, **changed})


def random_block(cells, seed, amount=0.25, size=1.0):
    """Cube of boxes cut in six, its points shifted by up to a share of a box; faces stay flat."""
    return with_moved_nodes(bar(size, size, (cells,) * 3), amount * size / cells, seed)


def disphenoids(cells, size=1.0):
    """Congruent tetrahedra whose centres are each other's mirror images in their faces.

    The tetragonal disphenoids of a body-centred cubic grid: each has the centres of two boxes that
    share a face, and an edge of this face (Sommerville 1923). cells: boxes along an edge.
    """
    grid = np.array(list(itertools.product(range(cells + 1), repeat=3)), dtype=float)
    middle = np.array(list(itertools.product(range(cells), repeat=3)), dtype=float) + 0.5
    number = {tuple(point): k for k, point in enumerate(np.vstack([grid, middle]).tolist())}
    bodies = []
    for centre in middle:
        for axis in range(3):
            other = centre + np.eye(3)[axis]
            if tuple(other) not in number:
                continue
            across = [np.eye(3)[k] for k in range(3) if k != axis]
            face = centre + 0.5 * np.eye(3)[axis]
            ring = [
                face + 0.5 * (a * across[0] + b * across[1])
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
            for k in range(4):
                corners = centre, other, ring[k], ring[(k + 1) % 4]
                bodies.append([number[tuple(corner)] for corner in corners])
    points = size / cells * np.vstack([grid, middle])
    return checked_mesh(points, bodies, {})
