"""Quality report: shapes by closed forms, step limits by independent assembly."""

import dataclasses

import numpy as np
import pytest

from taichi_dem import CONCRETE, PAPER_BLOCK, quality_report, read_mesh
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import body_properties, topology_of
from taichi_dem.stability.mesh_limits import bond_rates, dashpots_of, springs_of
from taichi_dem.stability.quality import smallest_altitudes

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


def test_regular_tetrahedron_has_its_known_shape():
    # Altitude edge sqrt(2/3), so that the longest edge over it is sqrt(3/2).
    report = quality_report(single(EDGE), CONCRETE)
    assert report.smallest_altitude_m == pytest.approx([EDGE * np.sqrt(2.0 / 3.0)])
    assert report.aspect_ratio == pytest.approx([np.sqrt(1.5)])
    assert report.volume_m3 == pytest.approx([EDGE**3 / (6.0 * np.sqrt(2.0))])
    assert report.mass_kg == pytest.approx(2390.0 * report.volume_m3)


def test_altitude_is_the_distance_of_a_vertex_from_the_opposite_plane():
    mesh = bar(1.0, 0.3, (3, 2, 1))
    for body, found in enumerate(smallest_altitudes(mesh)):
        corners = mesh.points[mesh.tetrahedra[body]]
        heights = []
        for k in range(4):
            a, b, c = np.delete(corners, k, axis=0)
            normal = np.cross(b - a, c - a)
            heights.append(abs((corners[k] - a) @ normal) / np.linalg.norm(normal))
        assert found == pytest.approx(min(heights))


def test_body_without_bonds_has_no_limit():
    report = quality_report(single(), CONCRETE)
    assert np.all(np.isinf(report.critical_step_s))
    assert np.array_equal(report.price(), [1.0])
    assert "inf" in str(report)


def test_rate_of_a_regular_pair_is_that_of_its_spin_about_the_normal():
    # With c_n = c_t = c the fastest motion of a body is the spin about the face's normal: three
    # units of area A/3 at radius edge/sqrt 3 against I = m edge^2/20 give 20/3 c A/m. The
    # motion that couples shear and tilt stays below, at 4.41 c A/m.
    mesh = pair(EDGE)
    area, mass = np.sqrt(3.0) / 4.0 * EDGE**2, body_properties(mesh, CONCRETE.density)[0]
    assert rates(mesh, (1e7, 1e7)) == pytest.approx(20.0 / 3.0 * 1e7 * area / mass)


def test_normal_dashpots_alone_damp_approach_and_tilt():
    # c_t = 0: approach at c_n A/m; tilt about an in-plane axis: A/3 times the sum of y^2 over
    # the vertices, edge^2/2, against I = m edge^2/20: 10/3 c_n A/m, the larger.
    mesh = pair(EDGE)
    area, mass = np.sqrt(3.0) / 4.0 * EDGE**2, body_properties(mesh, CONCRETE.density)[0]
    assert rates(mesh, (1e7, 0.0)) == pytest.approx(10.0 / 3.0 * 1e7 * area / mass)


@pytest.mark.parametrize("law", [dashpots_of, springs_of])
def test_rate_of_two_equal_bodies_is_twice_that_of_one(law):
    # In the regular pair the mode of one body has its mirror image in the other.
    mesh = pair(EDGE)
    coefficients = 2 * (law(CONCRETE)[1],)
    assert whole_system(mesh, coefficients) == pytest.approx(2.0 * rates(mesh, coefficients)[0])


@pytest.mark.parametrize("law", [dashpots_of, springs_of])
@pytest.mark.parametrize("mesh", [pair(0.05, 0.02), bar(0.2, 0.05, (2, 1, 1))])
def test_largest_rate_of_the_whole_mesh_is_bounded_by_the_report(mesh, law):
    # |a - b|^2 <= 2 |a|^2 + 2 |b|^2 in every unit: the whole cannot be faster than twice its
    # fastest body; and it cannot be slower than that body between neighbours at rest.
    fastest = rates(mesh, law(CONCRETE)).max()
    whole = whole_system(mesh, law(CONCRETE))
    assert fastest * (1.0 - 1e-9) <= whole <= 2.0 * fastest * (1.0 + 1e-9)


def test_limits_follow_from_the_rates():
    # Forward Euler of a decay at rate 2 lambda: 2/(2 lambda). Symplectic Euler of an
    # oscillation at sqrt(2) omega: 2/(sqrt(2) omega).
    mesh = bar(0.2, 0.05, (2, 1, 1))
    report = quality_report(mesh, CONCRETE)
    assert report.dashpot_step_s * rates(mesh, dashpots_of(CONCRETE)) == pytest.approx(1.0)
    square = rates(mesh, springs_of(CONCRETE))
    assert report.spring_step_s**2 * square == pytest.approx(2.0)


def test_dashpot_step_is_where_forward_euler_turns_unstable():
    # March v' = -rate v of the pair's fastest motion, spins against each other: exact for
    # equal dashpots, where |1 - step rate| passes 1 at the reported step.
    even = dataclasses.replace(CONCRETE, normal_damping=1e7, shear_damping=1e7)
    step = quality_report(pair(EDGE), even).dashpot_step_s.min()
    rate = whole_system(pair(EDGE), dashpots_of(even))
    assert abs(1.0 - 0.999 * step * rate) < 1.0 < abs(1.0 - 1.001 * step * rate)


def test_steps_scale_with_size_and_damping():
    # lambda = c A/m ~ c / (density size), omega^2 ~ k / (density size).
    small = quality_report(bar(0.2, 0.05, (2, 1, 1)), CONCRETE)
    large = quality_report(bar(0.8, 0.2, (2, 1, 1)), CONCRETE)
    assert large.dashpot_step_s == pytest.approx(4.0 * small.dashpot_step_s)
    assert large.spring_step_s == pytest.approx(2.0 * small.spring_step_s)
    assert large.aspect_ratio == pytest.approx(small.aspect_ratio)
    soft = dataclasses.replace(CONCRETE, normal_damping=11.3e6, shear_damping=5.05e6)
    report = quality_report(bar(0.2, 0.05, (2, 1, 1)), soft)
    assert report.dashpot_step_s == pytest.approx(2.0 * small.dashpot_step_s)


def test_undamped_material_is_limited_by_its_springs_only():
    bare = dataclasses.replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
    report = quality_report(pair(), bare)
    assert np.all(np.isinf(report.dashpot_step_s))
    assert np.array_equal(report.critical_step_s, report.spring_step_s)


def test_price_is_what_the_mesh_gains_without_the_worst_bodies():
    report = quality_report(read_mesh(PAPER_BLOCK), CONCRETE)
    worst = report.worst(5)
    for count in range(1, 6):
        kept = np.delete(report.critical_step_s, worst[:count])
        gain = kept.min() / report.critical_step_s.min()
        assert report.price(5)[count - 1] == pytest.approx(gain)
    assert report.price(2000)[-1] == np.inf  # without any body


def test_printed_report_names_the_counts_and_the_worst_body():
    report = quality_report(read_mesh(PAPER_BLOCK), CONCRETE)
    text = str(report)
    assert text.startswith(f"{report.body_count} bodies, {report.point_count} points")
    assert f"{report.worst(1)[0]:8d}" in text
    assert len(text.splitlines()) == 7 + 1 + 3 + 10


def test_paper_block_has_the_limits_of_the_papers_mesh():
    # An independent mesh of the same block and size gave 5.7e-8 s (dashpots) and 2.4e-6 s
    # (springs); the smallest body decides, and 8 chords of 2 cm make it smaller than 5 cm ones:
    # within a factor of two. Table 1's c/k = 50 us lets the dashpots bind everywhere.
    report = quality_report(read_mesh(PAPER_BLOCK), CONCRETE)
    assert 0.5 < report.dashpot_step_s.min() / 5.7e-8 < 2.0
    assert 0.5 < report.spring_step_s.min() / 2.4e-6 < 2.0
    assert np.all(report.dashpot_step_s < report.spring_step_s)
    assert report.aspect_ratio.max() < 7.0
