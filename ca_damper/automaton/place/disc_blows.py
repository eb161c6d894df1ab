"""Laws of blows between discs and between grains and walls, as pure functions.

Places across a column are not kept: a grain is anywhere in its column with equal probability.
Two discs of diameter d in neighbouring columns are then b apart across with the density b / d^2,
for b up to d, and touch once their heights differ by z d with z^2 + (b / d)^2 = 1. Those that have
not touched so far are a share (1 + z^2) / 2 of all pairs, which gives the rate below. Two discs
that pass each other meet with the probability 1/2: with its own column and those on both sides a
disc sweeps two diameters, as discs do.
"""

import taichi as ti

#: Least free width [diameters] that a row leaves: its grains never stand at quite the same height.
LEAST_WIDTH = 0.125


@ti.func
def contact_rate(approach, rise, free_width):
    """Rate of blows [1/s] of two grains in neighbouring columns.

    approach: speed along their line of centres, in diameters [1/s]. rise: vertical part of that
    line. free_width: what grains beside them leave to the two [diameters], 2 where there are none;
    rods on a line meet in inverse proportion to it (Tonks 1936).
    """
    return 2.0 * approach / (1.0 + rise * rise) * 2.0 / ti.max(free_width, LEAST_WIDTH)


@ti.func
def chord(rise):
    """Width [diameters] that a disc takes at a height of ``rise`` diameters beside it, up to 1."""
    return ti.sqrt(ti.max(0.0, 1.0 - rise * rise))


@ti.func
def line_of_centres(draw):
    """Line between two discs that meet in a column, (across, up), for a draw in [0, 1).

    All impact parameters from one edge to the other are equally likely, as in a gas of discs.
    """
    across = 2.0 * draw - 1.0
    return ti.Vector([across, chord(across)])


@ti.func
def dragged(slip, most):
    """Friction against a slip: as large as the slip, but not larger than ``most``; signed."""
    size = ti.min(most, ti.abs(slip))
    return size if slip > 0.0 else -size


@ti.func
def speed_change(relative, line, restitution, friction):
    """Change of velocity [m/s] of the first of two equal grains; the second has the opposite.

    relative: velocity of the first seen from the second; line: of centres, from the first to the
    second, of length 1; both (across, up). Zero unless they approach.
    """
    normal = relative.dot(line)
    change = ti.Vector([0.0, 0.0])
    if normal > 0.0:
        push = 0.5 * (1.0 + restitution) * normal
        slip = relative[1] * line[0] - relative[0] * line[1]
        drag = dragged(0.5 * slip, friction * push)
        change = ti.Vector([drag * line[1] - push * line[0], -drag * line[0] - push * line[1]])
    return change


@ti.func
def common_velocity(velocity, approaches, blows, recoil, restitution):
    """Velocity of the container after all blows of a step on floor and ceiling [m/s].

    V' = (M V + m sum(v + e (v - V))) / (M + n m), whatever the order of the blows; each grain
    leaves with V' - e (v - V). approaches: sum of v - V [m/s]. blows: n of them. recoil: m / M.
    """
    return velocity + recoil * (1.0 + restitution) * approaches / (1.0 + blows * recoil)


@ti.func
def most_drag(slip, share):
    """Largest friction [m/s] of one of n grains at the side walls: with more they would drag on.

    At this limit grains of one slip and the container have one velocity afterwards. slip: velocity
    seen from the container [m/s]. share: n m / M, or that of a Recoil.
    """
    return ti.abs(slip) / (1.0 + share)
