"""The limits of steps that a mesh is told to have are those of its motion as a whole."""

import numpy as np
import pytest

from taichi_dem import CONCRETE
from taichi_dem.elasticity.rates import bond_rates, dashpots_of, springs_of
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.mesh.topology import body_properties, topology_of

EDGE = 0.05


def whole_system(mesh, coefficients):
    """Largest eigenvalue of M^-1 G of all bodies moving together, assembled unit by unit.

    G is the Hessian of half the power (or energy) of all units, (A/3) (c_n u_n^2 + c_t u_t^2),
    u the velocity of the slave's vertex relative to the master's.
    """
    top = topology_of(mesh)
    mass, centre, inertia = body_properties(mesh, CONCRETE.density)
    big = np.zeros((6 * mesh.body_count,) * 2)
    for bond in range(top.bond_count):
        corners = mesh.points[top.vertices[bond]]
        vector = np.cross(corners[1] - corners[0], corners[2] - corners[0]) / 2.0
        area = np.linalg.norm(vector)
        for point in corners:
            jump = np.zeros((3, 6 * mesh.body_count))
            for body, sign in ((top.slave[bond], 1.0), (top.master[bond], -1.0)):
                jump[:, 6 * body : 6 * body + 3] = sign * np.eye(3)
                for axis in range(3):
                    turned = np.cross(np.eye(3)[axis], point - centre[body])
                    jump[:, 6 * body + 3 + axis] = sign * turned
            normal = vector / area @ jump
            big += area / 3.0 * (coefficients[0] - coefficients[1]) * np.outer(normal, normal)
            big += area / 3.0 * coefficients[1] * jump.T @ jump
    weight = np.zeros_like(big)
    for body in range(mesh.body_count):
        start = 6 * body
        weight[start : start + 3, start : start + 3] = mass[body] * np.eye(3)
        weight[start + 3 : start + 6, start + 3 : start + 6] = inertia[body]
    return np.linalg.eigvals(np.linalg.solve(weight, big)).real.max()


def rates(mesh, coefficients):
    return bond_rates(mesh, topology_of(mesh), CONCRETE.density, coefficients)


@pytest.mark.parametrize(
    ("coefficients", "factor"), [((1e7, 1e7), 20.0 / 3.0), ((1e7, 0.0), 10.0 / 3.0)]
)
def test_rate_of_a_regular_pair_is_that_of_its_fastest_turn(coefficients, factor):
    """In units of c_n A/m: with c_t = c_n the spin about the face's normal, else the tilt.

    Three units of area A/3 at radius edge/sqrt 3 against I = m edge^2/20 give 20/3; about an
    in-plane axis A/3 times the sum of y^2 over the vertices, edge^2/2, gives 10/3.
    """
    mesh = pair(EDGE)
    area, mass = np.sqrt(3.0) / 4.0 * EDGE**2, body_properties(mesh, CONCRETE.density)[0]
    assert rates(mesh, coefficients) == pytest.approx(factor * 1e7 * area / mass)


@pytest.mark.parametrize("law", [dashpots_of, springs_of])
@pytest.mark.parametrize("mesh", [pair(0.05, 0.02), bar(0.2, 0.05, (2, 1, 1))])
def test_largest_rate_of_the_whole_mesh_is_bounded_by_the_report(mesh, law):
    # |a - b|^2 <= 2 |a|^2 + 2 |b|^2 in every unit: the whole cannot be faster than twice its
    # fastest body; and it cannot be slower than that body between neighbours at rest.
    fastest = rates(mesh, law(CONCRETE)).max()
    whole = whole_system(mesh, law(CONCRETE))
    assert fastest * (1.0 - 1e-9) <= whole <= 2.0 * fastest * (1.0 + 1e-9)
