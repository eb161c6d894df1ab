"""What hard cases of the blast have to come to, from formulas and from a solver of its own."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag, expm

from taichi_dem.mesh.topology import body_properties, topology_of


def damped_opening(mass, stiffness, damping, opening, speed, time_s):
    """Opening [m] of two bodies tied along a line by a spring and a dashpot, overdamped.

    mass: reduced [kg]. stiffness [N/m], damping [N s/m]. opening [m], speed [m/s]: at the start.
    m u'' + c u' + k u = 0: u = A exp(r t) + B exp(s t) with the roots r, s of m x^2 + c x + k.
    """
    slow_fast = -0.5 * (damping + np.sqrt(damping**2 - 4.0 * mass * stiffness)) / mass
    slow = stiffness / (mass * slow_fast)
    first = (speed - slow_fast * opening) / (slow - slow_fast)
    return first * np.exp(slow * time_s) + (opening - first) * np.exp(slow_fast * time_s)


def speed_torn(mass, area, material, speed):
    """Speed [m/s] at which two bodies part whose bond is torn at a speed.

    mass: reduced [kg]. area: of the bond [m^2]. m v' = -A (c v + traction of the softening law),
    up to the failure opening.
    """
    onset = material.tensile_strength / material.normal_stiffness
    failure = material.failure_opening

    def slope(_, state):
        opening, v = state
        falling = material.tensile_strength * (failure - opening) / (failure - onset)
        traction = min(material.normal_stiffness * opening, falling)
        return v, -area / mass * (material.normal_damping * v + traction)

    def failed(_, state):
        return state[0] - failure

    failed.terminal = True
    options = {"rtol": 1e-9, "atol": 1e-15, "events": failed}
    return float(solve_ivp(slope, (0.0, 1.0), (0.0, speed), **options).y[1, -1])


def eased_pair_shift(mesh, material, shift, time_s):
    """Displacement of body 1 against body 0 of a bonded pair, (s, 3) [m], by a matrix exponential.

    shift: of body 1 at the start [m], both at rest. Springs and dashpots are linear in the
    displacements and turns of the bodies, as long as these are small.
    """
    mass, centre, inertia = body_properties(mesh, material.density)
    springs, dashpots = _bond_matrices(mesh, material, centre)
    weight = block_diag(*(part for k in range(2) for part in (mass[k] * np.eye(3), inertia[k])))
    rates = -np.linalg.solve(weight, np.hstack([springs, dashpots]))
    system = np.vstack([np.hstack([np.zeros((12, 12)), np.eye(12)]), rates])
    start = np.zeros(24)
    start[6:9] = shift
    states = np.array([expm(t * system) @ start for t in time_s])
    return states[:, 6:9] - states[:, :3]


def static_sag(mesh, material, acceleration, fixed):
    """Displacements (n, 3) [m] at which bonds carry the weight of all bodies; fixed: (n,) bool."""
    mass, centre, _ = body_properties(mesh, material.density)
    springs, _ = _bond_matrices(mesh, material, centre)
    force = np.zeros((len(mass), 6))
    force[:, :3] = mass[:, None] * np.asarray(acceleration)
    free = np.repeat(~fixed, 6)
    moved = np.zeros(6 * len(mass))
    moved[free] = np.linalg.solve(springs[np.ix_(free, free)], force.ravel()[free])
    return moved.reshape(-1, 6)[:, :3]


def _bond_matrices(mesh, material, centre):
    """Stiffness and damping matrix (6 n, 6 n) of all bonds: J^T D J summed over their units."""
    topology, count = topology_of(mesh), 6 * len(centre)
    springs, dashpots = np.zeros((count, count)), np.zeros((count, count))
    for master, slave, face in zip(topology.master, topology.slave, topology.vertices):
        corners = mesh.points[face]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        area = 0.5 * np.linalg.norm(normal)
        along = np.outer(normal, normal) / (normal @ normal)
        across = np.eye(3) - along
        elastic = material.normal_stiffness * along + material.shear_stiffness * across
        viscous = material.normal_damping * along + material.shear_damping * across
        for corner in corners:
            jacobian = np.zeros((3, count))
            jacobian[:, 6 * master : 6 * master + 6] = -_carried(corner - centre[master])
            jacobian[:, 6 * slave : 6 * slave + 6] = _carried(corner - centre[slave])
            springs += area / 3.0 * jacobian.T @ elastic @ jacobian
            dashpots += area / 3.0 * jacobian.T @ viscous @ jacobian
    return springs, dashpots


def stopped_speed(mesh, material, other, arms, normal, velocity):
    """Velocity (3,) [m/s] of a body after a blow that leaves its point of contact no way to go on.

    mesh, other: single bodies. arms: of the point from either centre [m]. normal: outward of the
    first. velocity: of the first; the other is at rest. The impulse stops the point altogether if
    friction bears it, else the normal motion alone, with friction at its bound.
    """
    (mass, turning), (more, more_turning) = (_mobility(one, material) for one in (mesh, other))
    yields = sum(
        part + _carried(arm)[:, 3:] @ turn @ _carried(arm)[:, 3:].T
        for part, turn, arm in zip((mass, more), (turning, more_turning), arms)
    )
    impulse = -np.linalg.solve(yields, velocity)
    along = impulse @ normal
    across = impulse - along * normal
    bound = material.friction * abs(along)
    if np.linalg.norm(across) > bound:
        push = -normal + material.friction * across / np.linalg.norm(across)
        impulse = push * -(velocity @ normal) / (normal @ yields @ push)
    return velocity + mass @ impulse


def _mobility(mesh, material):
    """Inverse mass (3, 3) and inverse inertia (3, 3) of a single body."""
    mass, _, inertia = body_properties(mesh, material.density)
    return np.eye(3) / mass[0], np.linalg.inv(inertia[0])


def _carried(arm):
    """Motion of a point by that of its body, (3, 6): displacement, and turn about the centre."""
    x, y, z = arm
    return np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])
