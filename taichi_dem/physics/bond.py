"""Kinematics of a bond: how its three contact units open, slide and move (Konno et al., 2.1).

Everything is expressed in the face frame (normal, xi, eta), which is fixed in the master body and
turns with it, so that a rigid motion of the pair opens nothing. The pair force acts at the slave's
vertex on both bodies and the relative velocity is taken there: angular momentum is then exact.
"""

import taichi as ti

from taichi_dem.kit.products import cross, matmul, matmul_transposed, matvec


@ti.dataclass
class BondMotion:
    """Relative motion of the two bodies of a bond, in the face frame.

    axes: rows are normal, xi, eta in world coordinates. branch: master centre to slave centre,
    world [m]. offset: the same in the face frame. turn: slave's body frame to the face frame.
    velocity: slave's centre against the master's material there [m/s]. spin: difference [rad/s].
    """

    axes: ti.types.matrix(3, 3, ti.f64)
    branch: ti.types.vector(3, ti.f64)
    offset: ti.types.vector(3, ti.f64)
    turn: ti.types.matrix(3, 3, ti.f64)
    velocity: ti.types.vector(3, ti.f64)
    spin: ti.types.vector(3, ti.f64)


@ti.func
def bond_motion(frame, branch, rotation_i, rotation_j, velocity, spin_i, spin_j):
    """Motion of slave j against master i.

    frame: normal, xi, eta in the master. branch [m], velocity [m/s]: slave's minus master's.
    """
    axes = matmul_transposed(frame, rotation_i)
    return BondMotion(
        axes=axes,
        branch=branch,
        offset=matvec(axes, branch),
        turn=matmul(axes, rotation_j),
        velocity=matvec(axes, velocity - cross(spin_i, branch)),
        spin=matvec(axes, spin_j - spin_i),
    )


@ti.func
def unit_arm(motion, vertex_slave):
    """Slave's vertex from the slave's centre, in the face frame [m]."""
    return matvec(motion.turn, vertex_slave)


@ti.func
def unit_opening(motion, arm, vertex_master):
    """Opening of a contact unit in the face frame [m]: normal (positive = apart), xi, eta.

    vertex_master: the master's vertex from its centre, in the face frame [m].
    """
    return motion.offset + arm - vertex_master


@ti.func
def unit_velocity(motion, arm):
    """Relative velocity at the slave's vertex in the face frame [m/s]."""
    return motion.velocity + cross(motion.spin, arm)
