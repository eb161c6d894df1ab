"""Exact solutions for small scenes: the yardsticks of hard cases, laws and methods."""

import numpy as np

from taichi_dem.materials.bond_rules import per_bond
from taichi_dem.mesh.topology import body_properties, topology_of


def damped_opening(mass, stiffness, damping, opening, speed, time_s):
    """Opening [m] of two bodies tied along a line by a spring and a dashpot, not critical.

    mass: reduced [kg]. stiffness [N/m], damping [N s/m]. opening [m], speed [m/s]: at the start.
    m u'' + c u' + k u = 0: u = A exp(r t) + B exp(s t) with the roots r, s of m x^2 + c x + k.
    """
    fast = -0.5 * (damping + np.emath.sqrt(damping**2 - 4.0 * mass * stiffness)) / mass
    slow = stiffness / (mass * fast)
    first = (speed - fast * opening) / (slow - fast)
    time = np.asarray(time_s)
    return np.real(first * np.exp(slow * time) + (opening - first) * np.exp(fast * time))


def velocity_after_impact(meshes, material, arms, normal, velocity):
    """Velocity (3,) [m/s] of a body after a plastic impact on one at rest.

    meshes: both, of a single body each. arms: of the point of contact from either centre [m].
    normal: outward of the first. velocity: of the first, which does not spin. The impulse stops the
    point of contact altogether if friction bears it, else its normal motion alone, with friction at
    its bound.
    """
    bodies = [body_properties(mesh, material.density) for mesh in meshes]
    yields = sum(
        np.eye(3) / mass[0] + turn @ np.linalg.inv(inertia[0]) @ turn.T
        for (mass, _, inertia), turn in zip(bodies, (carried(arm)[:, 3:] for arm in arms))
    )
    impulse = -np.linalg.solve(yields, velocity)
    along = impulse @ normal
    across = impulse - along * normal
    if np.linalg.norm(across) > material.friction * abs(along):
        push = -normal + material.friction * across / np.linalg.norm(across)
        impulse = push * -(velocity @ normal) / (normal @ yields @ push)
    return velocity + impulse / bodies[0][0][0]


class LinearBonds:
    """Bonds of a mesh as matrices, for displacements and turns that are small.

    mass, stiffness, damping: (6 n, 6 n), by displacement and turn of body after body. The latter
    two are J^T D J summed over the units of all bonds.
    """

    def __init__(self, mesh, material):
        mass, centre, inertia = body_properties(mesh, material.density)
        size = 6 * len(mass)
        self.mass, self.stiffness, self.damping = (np.zeros((size, size)) for _ in range(3))
        for body, start in enumerate(range(0, size, 6)):
            linear, turning = slice(start, start + 3), slice(start + 3, start + 6)
            self.mass[linear, linear] = mass[body] * np.eye(3)
            self.mass[turning, turning] = inertia[body]
        topology = topology_of(mesh)
        springs = material.normal_stiffness, material.shear_stiffness
        dashpots = material.normal_damping, material.shear_damping
        laws = [per_bond(mesh, topology, material.density, pair) for pair in (springs, dashpots)]
        for b, bodies in enumerate(zip(topology.master, topology.slave)):
            corners = mesh.points[topology.vertices[b]]
            share = topology.bonded_share[b]
            self._add_bond(corners, bodies, centre, [share * law[b] for law in laws])

    def _add_bond(self, corners, bodies, centre, laws):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        unit_area = 0.5 * np.linalg.norm(normal) / 3.0
        along = np.outer(normal, normal) / (normal @ normal)
        across = np.eye(3) - along
        elastic, viscous = (normal * along + shear * across for normal, shear in laws)
        rows = np.concatenate([np.arange(6 * body, 6 * body + 6) for body in bodies])
        block = np.ix_(rows, rows)
        for corner in corners:
            master, slave = (carried(corner - centre[body]) for body in bodies)
            jacobian = np.hstack([-master, slave])
            self.stiffness[block] += unit_area * jacobian.T @ elastic @ jacobian
            self.damping[block] += unit_area * jacobian.T @ viscous @ jacobian

    def largest_rate(self, matrix):
        """Largest eigenvalue of M^-1 times the stiffness [1/s^2] or the damping [1/s]."""
        return np.linalg.eigvals(np.linalg.solve(self.mass, matrix)).real.max()

    def state_matrix(self):
        """Matrix A (12 n, 12 n) of x' = A x for displacements and turns, then their rates."""
        size = len(self.mass)
        forces = np.hstack([self.stiffness, self.damping])
        rates = -np.linalg.solve(self.mass, forces)
        return np.vstack([np.eye(size, 2 * size, size), rates])

    def static_displacement(self, acceleration, fixed):
        """Displacements (n, 3) [m] at which the bonds carry the weight of all bodies.

        acceleration: of gravity, (3,) [m/s^2]. fixed: bodies that cannot move, booleans (n,).
        """
        free = np.repeat(~fixed, 6)
        weight = self.mass @ np.tile(np.append(acceleration, np.zeros(3)), len(fixed))
        moved = np.zeros(len(free))
        moved[free] = np.linalg.solve(self.stiffness[np.ix_(free, free)], weight[free])
        return moved.reshape(-1, 6)[:, :3]


def carried(arm):
    """Motion of a point by that of its body, (3, 6): displacement, and turn about the centre."""
    x, y, z = arm
    return np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
