"""Overlap of two tetrahedra, by the potential of distance (Munjiza, The combined FEM-DEM, 2004).

The depth of a point in a body is its distance from the nearest face. The integral of both depths
over the shared volume, halved, is W: bodies whose flat sides lie in each other by d over an area A
have W = A d^2 / 2. It is summed along rays from the incentre of a body to points of its faces: each
stands for the pyramid to its share of the face, and the depth in the other body along it is linear
from plane to plane. So W is a function of the depths of four corners below four planes, and
forces are its exact derivatives.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.products import cross, dot, entry, expression
from taichi_dem.kit.types import real, vec3

#: Turn of ray ends about the middle of a face, times the parts of its edges.
TURN = 0.12
#: Distance beyond which a pyramid is left out at once, as a share of the size of its body.
FAR = 0.05
mat4 = ti.types.matrix(4, 4, real)


def ray_ends(parts: int) -> np.ndarray:
    """Where the rays of a body end, (4 parts^2, 4), as weights of its corners.

    The ends are the centroids of parts^2 equal triangles of each face, turned about its middle: on
    lines of symmetry they would run along the faces between bodies that fit each other. Face f is
    opposite corner f, whose weight is 0.
    """
    at = [(u + t, v + t) for t in (1 / 3, 2 / 3) for u in range(parts) for v in range(parts - u)]
    at = [(u, v) for u, v in at if u + v < parts]
    u, v = np.array(at).T / parts
    weights = np.column_stack([1.0 - u - v, u, v])
    weights += TURN / parts * (np.roll(weights, 1, axis=1) - np.roll(weights, -1, axis=1))
    ends = np.zeros((4, len(at), 4))
    for face in range(4):
        ends[face][:, np.arange(4) != face] = weights
    return ends.reshape(-1, 4)


@expression
def row(matrix, r):
    """Row r of a matrix of three columns."""
    return vec3([entry(matrix, r, k) for k in range(3)])


@ti.func
def inside(start, change):
    """Part of a ray, between 0 and 1, with all depths positive: where it begins and ends.

    start: depths at its beginning; change: from there to its end. Where there is none, low > high,
    and the third number is how far the ray is outside at least [m].
    """
    low, high, rise, fall = 0.0, 1.0, 0.0, 0.0
    for g in ti.static(range(4)):
        if start[g] <= 0.0:
            at = -start[g] / change[g]
            if at > low:
                low, rise = at, change[g]
        elif start[g] + change[g] <= 0.0:
            at = -start[g] / change[g]
            if at < high:
                high, fall = at, -change[g]
    return low, high, rise * fall / ti.max(rise + fall, 1e-300) * (low - high)


@ti.func
def least(first, last, g: ti.template()):
    """Part of a line, between 0 and 1, on which value g is the least of four linear ones."""
    low, high = 0.0, 1.0
    for f in ti.static(range(4)):
        if ti.static(f != g):
            before, after = first[f] - first[g], last[f] - last[g]
            if before < 0.0 and after <= 0.0:
                high = 0.0
            elif before < 0.0:
                low = ti.max(low, before / (before - after))
            elif after < 0.0:
                high = ti.min(high, before / (before - after))
    return low, high


@ti.func
def sum_of_rays(depth, centre, volume, ends: ti.template(), count):
    """Integral of the least depth over a body [m4], and its derivatives by the depths [m3].

    Returns also how far all rays are outside at least [m], 0 where one is not. depth[c, g]: of
    corner c of the body below plane g of the other [m]. centre: weights of the corners in its
    incentre. ends, count: of ``ray_ends`` and their number.
    """
    total, slope, outside = 0.0, mat4(0.0), 1e30
    turned = depth.transpose()
    start = turned @ centre
    # Rays are seldom as near as the pyramid that they stand for: one by one, unless it is far off.
    far = FAR * volume ** (1.0 / 3.0)
    for face in range(4):
        top = start
        for c in ti.static(range(4)):
            if c != face:
                top = ti.max(top, turned[:, c])
        if top.min() < -far:
            outside = ti.min(outside, -top.min())
        else:
            share = 12.0 * volume * centre[face] / count
            for r in range(face * count // 4, (face + 1) * count // 4):
                end = ends[r]
                change = turned @ end
                highest = ti.max(start, change).min()
                if highest > 0.0:
                    change -= start
                    low, high, apart = inside(start, change)
                    outside = ti.max(0.0, ti.min(outside, apart))
                    if high > low:
                        first, last, whole = start + low * change, start + high * change, high - low
                        for g in ti.static(range(4)):
                            since, until = least(first, last, g)
                            if until > since:
                                # Integrals of t^2 and t^3 over the part: a pyramid widens with t^2.
                                since, until = low + since * whole, low + until * whole
                                square = share * (until**3 - since**3) / 3.0
                                cube = share * (until**4 - since**4) / 4.0
                                total += start[g] * square + change[g] * cube
                                for c in ti.static(range(4)):
                                    slope[c, g] += centre[c] * (square - cube) + end[c] * cube
                else:
                    outside = ti.min(outside, -highest)
    return total, slope, outside


@ti.func
def pushed_out(slope, normals, corners):
    """Force [m3] on a body's corners along the other's normals, its moment [m4], and volume [m3].

    Returns also the first moment [m4] of the shared volume. slope: of ``sum_of_rays``; normals,
    corners: 4 x 3, in one frame.
    """
    force, moment, at, volume = vec3(0.0), vec3(0.0), vec3(0.0), 0.0
    for c in ti.static(range(4)):
        push, weight = vec3(0.0), 0.0
        for g in ti.static(range(4)):
            push += slope[c, g] * row(normals, g)
            weight += slope[c, g]
        corner = row(corners, c)
        force += push
        moment += cross(corner, push)
        at += weight * corner
        volume += weight
    return force, moment, at, volume


@ti.func
def depths(corners, normals, distances):
    """Depth of each corner below each plane [m], (4, 4)."""
    depth = mat4(0.0)
    for c in ti.static(range(4)):
        for g in ti.static(range(4)):
            depth[c, g] = distances[g] - dot(row(normals, g), row(corners, c))
    return depth
