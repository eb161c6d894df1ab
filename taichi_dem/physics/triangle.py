"""Closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5)."""

import taichi as ti

from taichi_dem.kit.products import dot


@ti.func
def closest_point(c, p, q, s):
    """Closest point to c of the triangle with the corners p, q and s [m]."""
    first, second = q - p, s - p
    from_p, from_q, from_s = c - p, c - q, c - s
    p1, p2 = dot(first, from_p), dot(second, from_p)
    q1, q2 = dot(first, from_q), dot(second, from_q)
    s1, s2 = dot(first, from_s), dot(second, from_s)
    at_s, at_q, at_p = p1 * q2 - q1 * p2, s1 * p2 - p1 * s2, q1 * s2 - s1 * q2
    point = p
    if p1 <= 0.0 and p2 <= 0.0:
        point = p
    elif q1 >= 0.0 and q2 <= q1:
        point = q
    elif s2 >= 0.0 and s1 <= s2:
        point = s
    elif at_s <= 0.0 and p1 >= 0.0 and q1 <= 0.0:
        point = p + p1 / (p1 - q1) * first
    elif at_p <= 0.0 and q2 >= q1 and s1 >= s2:
        point = q + (q2 - q1) / (q2 - q1 + s1 - s2) * (s - q)
    elif at_q <= 0.0 and p2 >= 0.0 and s2 <= 0.0:
        point = p + p2 / (p2 - s2) * second
    else:
        point = p + (at_q * first + at_s * second) / (at_p + at_q + at_s)
    return point
