"""Meshes of the full block, 3 m deep: by Gmsh with a wanted number of tetrahedra, or stacked."""

import importlib.util
import os

import numpy as np

from taichi_dem import PAPER_BLOCK, read_mesh
from taichi_dem.mesh.gmsh import block_with_hole
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.reorder import in_space_order

DEPTH = 3.0
#: Sizes of elements at the hole and far from it [m] at a scale of one, the paper's at the hole.
SIZE_HOLE, SIZE_FAR = 0.055, 0.22
#: Scales of both, and the tetrahedra that Gmsh then makes: measured.
_MADE = ((0.585, 93490), (1.0, 21038), (1.9, 4537))


def has_gmsh():
    """Whether Gmsh is installed."""
    return importlib.util.find_spec("gmsh") is not None


def scale_for(tetrahedra):
    """Scale of the element sizes for a number of tetrahedra: between measured ones, as a power."""
    scales, counts = np.log(np.array(_MADE)).T
    wanted = np.log(tetrahedra)
    place = np.clip(np.searchsorted(-counts, -wanted), 1, len(counts) - 1)
    (s0, s1), (n0, n1) = scales[place - 1 : place + 1], counts[place - 1 : place + 1]
    return float(np.exp(s0 + (s1 - s0) * (wanted - n0) / (n1 - n0)))


def made_block(path, tetrahedra):
    """The block by Gmsh with about this many tetrahedra; from the file where it is there already.

    Raises InputError, which says how to get Gmsh, when it is not installed.
    """
    if not os.path.exists(path):
        scale = scale_for(tetrahedra)
        sizes = {"size_hole": scale * SIZE_HOLE, "size_far": scale * SIZE_FAR}
        block_with_hole(path, depth=DEPTH, **sizes)
    return in_space_order(read_mesh(path))


def stacked_block(copies):
    """Mirrored copies of the paper's flat block one behind the other, their meeting faces joined.

    Each copy is the mirror image of the one before, so that all faces match. Groups: as in the
    flat block; front and back are those of the ends.
    """
    flat = read_mesh(PAPER_BLOCK)
    depth = float(flat.points[:, 2].max())
    points = np.concatenate([_copied(flat.points, k, depth) for k in range(copies)])
    # Mirrored points differ from their originals in the last bit.
    points, place = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    place = place.reshape(copies, -1)
    groups = {
        name: np.concatenate([p[faces] for p in place]) for name, faces in flat.groups.items()
    }
    groups["back"] = place[0][flat.groups["back"]]
    groups["front"] = place[-1][flat.groups["front" if copies % 2 else "back"]]
    tetrahedra = np.concatenate([p[flat.tetrahedra] for p in place])
    return in_space_order(checked_mesh(points, tetrahedra, groups))


def _copied(points, k, depth):
    """Points of the k-th copy: odd ones are mirrored."""
    height = points[:, 2] if k % 2 == 0 else depth - points[:, 2]
    return np.column_stack([points[:, :2], height + k * depth])
