"""Contact after fracture, of spheres (Konno et al., 2.2) or bodies: normal force and friction."""

import taichi as ti

from taichi_dem.kit.products import dot, matvec, norm, squared

#: Bits of ``State.active_effects`` beside those of loads and supports: of contact, of its friction,
#: and of two bodies of which one was within the other.
CONTACT, RUBBED, SUNK = 1 << 61, 1 << 60, 1 << 59
#: Share of the smaller body at which two bodies, which touch with all faces, count as one within
#: the other.
DEEPEST_SHARE = 0.5


@ti.func
def friction_force(coefficient, damping, force_normal, slide):
    """Friction [N] on the second sphere, against its sliding velocity slide [m/s].

    Sliding friction coefficient * force_normal, at most damping * |slide|, against chatter.
    """
    speed = norm(slide)
    force = 0.0 * slide
    if speed > 0.0:
        force = slide * (-ti.min(coefficient * force_normal, damping * speed) / speed)
    return force


@ti.func
def cut_to(vector, bound):
    """The vector, shortened to a bound where it is longer."""
    size = norm(vector)
    if size > bound:
        vector *= bound / size
    return vector


@ti.func
def add_within(held, more, bound):
    """Held + share * more, with the largest share up to 1 that keeps its size within a bound.

    held: vector no longer than the bound.
    """
    square, along = squared(more), dot(held, more)
    left = ti.max(0.0, bound * bound - squared(held))
    share = 1.0
    if square + 2.0 * along > left:
        root = ti.sqrt(along * along + square * left)
        # Two ways to write one root of the quadratic: neither subtracts nearly equal numbers.
        if along > 0.0:
            share = left / (root + along)
        else:
            share = (root - along) / square
    return held + share * more


@ti.dataclass
class Nearest:
    """Two bodies' surfaces where they are nearest, in the first body's frame.

    first: centre of the first's sphere and its radius [m]. apart: from there to the second's
    centre [m]. reach: their distance when they touch [m]. size: the sum of the radii [m]. Of bodies
    see ``BodyGeometry.nearest``; area, couple: as in ``Meeting``.
    """

    first: ti.types.vector(4, ti.f64)
    apart: ti.types.vector(3, ti.f64)
    reach: ti.f64
    size: ti.f64
    area: ti.f64
    couple: ti.types.vector(3, ti.f64)


@ti.func
def is_within(surfaces, margin):
    """Whether the surfaces of a ``Nearest`` are nearer than a margin [m]."""
    wide = surfaces.reach + margin
    return squared(surfaces.apart) < wide * wide


@ti.dataclass
class Meeting:
    """Where two spheres meet: overlap [m], negative while they are apart.

    normal: from the first to the second, world. arm: from the first body's centre to the middle
    of the overlap, world [m]. area, weight: factors of a law's numbers and of its dashpot's rate,
    1 for spheres. couple: moment about the contact's point per normal force, world [m].
    """

    overlap: ti.f64
    normal: ti.types.vector(3, ti.f64)
    arm: ti.types.vector(3, ti.f64)
    area: ti.f64
    couple: ti.types.vector(3, ti.f64)
    weight: ti.f64


@ti.func
def meeting(first, reach, apart, rotation):
    """Meeting of two spheres; all but rotation as in ``Nearest``.

    rotation: of the first body.
    """
    distance = ti.max(norm(apart), 1e-30)
    overlap = reach - distance
    normal = matvec(rotation, apart) / distance
    arm = matvec(rotation, first.xyz) + (first[3] - 0.5 * overlap) * normal
    return Meeting(
        overlap=overlap, normal=normal, arm=arm, area=1.0, couple=0.0 * normal, weight=1.0
    )


@ti.func
def active_bits(push, rub):
    """CONTACT for a repulsion that is not zero, with RUBBED for such friction; both of one unit."""
    active = ti.i64(0)
    if push > 0.0:
        active = ti.i64(CONTACT)
        if squared(rub) > 0.0:
            active = ti.i64(CONTACT | RUBBED)
    return active
