"""Closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""

import taichi as ti

from taichi_dem.kit.types import vec3

#: Where a closest point lies: INSIDE, on edge e (from corner e to the next) at EDGE + e, or at
#: corner v at CORNER + v.
INSIDE, EDGE, CORNER = 0, 1, 4


@ti.dataclass
class Closest:
    """Point of a triangle that is closest to another [m]; region: where it lies."""

    point: vec3
    region: ti.i32


@ti.func
def closest_point(c, p, q, s):
    """Closest point to c of the triangle with the corners p, q and s [m], a ``Closest``."""
    first, second = q - p, s - p
    from_p, from_q, from_s = c - p, c - q, c - s
    p1, p2 = first.dot(from_p), second.dot(from_p)
    q1, q2 = first.dot(from_q), second.dot(from_q)
    s1, s2 = first.dot(from_s), second.dot(from_s)
    at_s, at_q, at_p = p1 * q2 - q1 * p2, s1 * p2 - p1 * s2, q1 * s2 - s1 * q2
    point, region = p, INSIDE
    if p1 <= 0.0 and p2 <= 0.0:
        region = CORNER
    elif q1 >= 0.0 and q2 <= q1:
        point, region = q, CORNER + 1
    elif s2 >= 0.0 and s1 <= s2:
        point, region = s, CORNER + 2
    elif at_s <= 0.0 and p1 >= 0.0 and q1 <= 0.0:
        point, region = p + p1 / (p1 - q1) * first, EDGE
    elif at_p <= 0.0 and q2 >= q1 and s1 >= s2:
        point, region = q + (q2 - q1) / (q2 - q1 + s1 - s2) * (s - q), EDGE + 1
    elif at_q <= 0.0 and p2 >= 0.0 and s2 <= 0.0:
        point, region = p + p2 / (p2 - s2) * second, EDGE + 2
    else:
        point = p + (at_q * first + at_s * second) / (at_p + at_q + at_s)
    return Closest(point=point, region=region)
