"""Collision laws as pure functions: values in, values out.

Komatsuzaki et al., 5.3 and 5.4. Speeds are signed along the direction of the particle that hits;
a result below zero sends that particle back.
"""

import taichi as ti

from ca_damper.automaton.lattice import DIRECTIONS, turned_back


@ti.func
def speed_after_pair(speed, other, restitution):
    """Speed [m/s] of the particle that hits, eq. (9); ``other`` is that of the equal it meets.

    With the two exchanged it is the speed of the one that is hit: their sum stays.
    """
    return 0.5 * ((speed + other) - restitution * (speed - other))


@ti.func
def speed_after_wall(speed, wall, restitution):
    """Speed [m/s] of a particle that meets a wall of speed ``wall`` and great mass, eq. (10)."""
    return wall - restitution * (speed - wall)


@ti.func
def deflected(direction, draw):
    """Way back from ``direction``: straight for half of the draws in [0, 1), oblique else (5.3)."""
    back = turned_back(direction)
    if draw >= 0.75:
        back = (back + 1) % DIRECTIONS
    elif draw >= 0.5:
        back = (back + DIRECTIONS - 1) % DIRECTIONS
    return back
