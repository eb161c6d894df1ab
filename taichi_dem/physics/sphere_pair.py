"""Contact of two spheres after fracture (Konno et al., 2.2): normal force and sliding friction."""

import taichi as ti


@ti.func
def normal_force(stiffness, damping, overlap, opening_rate):
    """Repulsion [N] of two overlapping spheres, never an attraction.

    stiffness [N/m], damping [N s/m], overlap [m], opening_rate: speed at which they part [m/s].
    """
    return ti.max(0.0, stiffness * overlap - damping * opening_rate)


@ti.func
def friction_force(coefficient, damping, force_normal, slide):
    """Friction [N] on the second sphere, against its sliding velocity slide [m/s].

    Sliding friction coefficient * force_normal, but never more than damping * |slide|, which
    keeps it from chattering where the sliding stops.
    """
    speed = slide.norm()
    force = 0.0 * slide
    if speed > 0.0:
        force = slide * (-ti.min(coefficient * force_normal, damping * speed) / speed)
    return force
