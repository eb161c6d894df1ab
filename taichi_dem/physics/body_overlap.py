"""Overlap of two tetrahedra, by the potential of distance (Munjiza, The combined FEM-DEM, 2004).

The depth of a point in a body is its distance from the nearest face. The integral of both depths
over the shared volume, halved, is W: bodies whose flat sides lie in each other by d over an area A
have W = A d^2 / 2. It is summed along rays from the incentre of a body to points of its faces: each
stands for the pyramid to its share of the face, and the depth in the other body along it is linear
from plane to plane. So W depends on four corners below four planes; forces are exact derivatives.
"""

from functools import reduce
from operator import add

import numpy as np
import taichi as ti

from taichi_dem.kit.products import entry, expression, transposed_matvec
from taichi_dem.kit.types import real, vec3, vec4

#: Turn of ray ends about the middle of a face, times the parts of its edges.
TURN = 0.12
mat4, mat43 = ti.types.matrix(4, 4, real), ti.types.matrix(4, 3, real)


def ray_ends(parts: int) -> np.ndarray:
    """Where the rays of a body end, (4 parts^2, 4), as weights of its corners."""
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
    """Row r of a matrix of four columns."""
    return vec4([entry(matrix, r, k) for k in range(4)])


@expression
def smallest(vector):
    """The smallest of four numbers."""
    return reduce(ti.min, (entry(vector, k) for k in range(4)))


@expression
def raised(matrix, by):
    """A matrix of four rows with a vector added to each."""
    columns = range(matrix.get_shape()[1])
    kind = mat43 if len(columns) == 3 else mat4
    return kind([[entry(matrix, r, k) + entry(by, k) for k in columns] for r in range(4)])


@expression
def turning(corners, push):
    """Sum of the moments of forces on four corners, (4, 3) each."""

    def moment(c, k, m):
        return entry(corners, c, k) * entry(push, c, m) - entry(corners, c, m) * entry(push, c, k)

    axes = ((1, 2), (2, 0), (0, 1))
    return vec3([reduce(add, (moment(c, k, m) for c in range(4))) for k, m in axes])


@ti.func
def inside(start, change):
    """Part of a ray, between 0 and 1, with all depths positive: where it begins and ends.

    start: depths at its beginning; change: from there to its end. Where there is none, low > high,
    and the third number is how far the ray is outside at least [m], else 0.
    """
    low, high, rise, fall, apart = 0.0, 1.0, 0.0, 0.0, 0.0
    for g in ti.static(range(4)):
        if start[g] <= 0.0:
            at = -start[g] / change[g]
            if at > low:
                low, rise = at, change[g]
        elif start[g] + change[g] <= 0.0:
            at = -start[g] / change[g]
            if at < high:
                high, fall = at, -change[g]
    if low > high:
        apart = rise * fall / ti.max(rise + fall, 1e-300) * (low - high)
    return low, high, apart


@ti.func
def add_ray(total, slope, share, start, change, low, high, centre, end):
    """Add the integral of the least depth over a thin pyramid, and its derivatives by the depths.

    low .. high: part of its ray that counts. share: three times its volume.
    """
    least, value, here, rate = 0, 1e300, 0.0, 0.0
    for f in ti.static(range(4)):
        there = start[f] + low * change[f]
        if there < value or (there == value and change[f] < rate):
            least, value, here, rate = f, there, start[f], change[f]
    since = low
    while since < high:
        # The least of linear depths grows ever more slowly: next is the first that crosses it.
        until, following, next_here, next_rate = high, least, here, rate
        for f in ti.static(range(4)):
            if change[f] < rate:
                cut = (start[f] - here) / (rate - change[f])
                if cut < until:
                    until, following, next_here, next_rate = cut, f, start[f], change[f]
        until = ti.max(until, since)
        # Integrals of t^2 and t^3 over the part: a pyramid widens with t^2.
        square = share / 3.0 * (until**3 - since**3)
        cube = share / 4.0 * (until**4 - since**4)
        total += here * square + rate * cube
        weights = centre * (square - cube) + end * cube
        for g in ti.static(range(4)):
            if g == least:
                for c in ti.static(range(4)):
                    slope[c, g] = slope[c, g] + weights[c]
        least, here, rate, since = following, next_here, next_rate, until
    return total, slope


@ti.func
def highest_end(depth, face, least):
    """Bound of the depths at the ends of the rays to a face, of which no weight is below least."""
    highest, total = vec4(-1e30), vec4(0.0)
    for c in ti.static(range(4)):
        if c != face:
            highest, total = ti.max(highest, row(depth, c)), total + row(depth, c)
    return (1.0 - 3.0 * least) * highest + least * total


@ti.func
def sum_of_rays(
    depth, centre, volume, far, ends: ti.template(), least, count, whole: ti.template(), enough
):
    """Integral of the least depth over a body [m4], and its derivatives by the depths [m3].

    Returns also how far all rays are outside at least [m], 0 where one is not. depth[c, g]: of
    corner c of the body below plane g of the other [m]. centre: weights of the corners in its
    incentre. far: distance from which on a pyramid is left out at once [m]. ends, least, count: of
    ``ray_ends``, their smallest weight on a face, and their number. whole: whether to integrate, or
    only to find how far rays are outside, and no further once it is below enough.
    """
    total, slope, outside = 0.0, mat4(0.0), 1e30
    start = transposed_matvec(depth, centre)
    for face in range(4):
        top = ti.max(start, highest_end(depth, face, least))
        if smallest(top) < -far:
            outside = ti.min(outside, -smallest(top))
        else:
            share = 12.0 * volume * centre[face] / count
            for r in range(face * count // 4, (face + 1) * count // 4):
                if ti.static(not whole):
                    if outside < enough:
                        break
                change = transposed_matvec(depth, ends[r])
                highest = smallest(ti.max(start, change))
                if highest > 0.0:
                    change -= start
                    low, high, apart = inside(start, change)
                    outside = ti.max(0.0, ti.min(outside, apart))
                    if ti.static(whole):
                        if high > low:
                            total, slope = add_ray(
                                total, slope, share, start, change, low, high, centre, ends[r]
                            )
                else:
                    outside = ti.min(outside, -highest)
    return total, slope, outside
