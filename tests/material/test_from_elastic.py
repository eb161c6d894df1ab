"""A material from what is measured gives bonds, dashpots and contacts by the bodies of a mesh.

Concrete of the paper's Table 1 has the openings of the paper, and softens to its energy.
"""

import dataclasses

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, elastic_report
from taichi_dem.materials.bond_rules import bond_geometry
from taichi_dem.materials.material import bond_moduli
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.mesh.topology import topology_of
from taichi_dem.state.model import Model
from tests.material.blocks import DENSITY, NU, E, random_block, rock

RATIO = 0.05


def test_stiffness_and_dashpots_of_every_bond_follow_from_its_bodies():
    """k = E_n / h, and c = 2 ratio sqrt(k m / A): the critical dashpot of mass m on A k is at 1."""
    mesh = random_block(2, seed=0)
    model = Model(mesh, rock(), [])
    bonds = bond_geometry(mesh, topology_of(mesh), DENSITY)
    for column, modulus in enumerate(bond_moduli(E, NU)):
        stiffness = modulus / bonds.distance
        assert model.bond_stiffness[:, column] == pytest.approx(stiffness, rel=1e-14)
        whole = model.bond_damping[:, column] * bonds.area
        critical = 2.0 * np.sqrt(stiffness * bonds.area * bonds.pair_mass)
        assert whole == pytest.approx(RATIO * critical, rel=1e-12)


def test_a_pair_swings_and_dies_away_at_the_damping_ratio():
    """u = v / w_d exp(-ratio w t) sin(w_d t), w^2 = A E_n / (h m); after a period.

    The dashpots of the explicit method are of first order in the step: w dt is allowed for.
    """
    mesh, ratio, count = pair(0.05), 0.1, 4000
    model = Model(mesh, rock(damping_ratio=ratio), [])
    bonds = bond_geometry(mesh, model.topology, DENSITY)
    omega = float(np.sqrt(bond_moduli(E, NU)[0] / bonds.distance * bonds.area / bonds.pair_mass)[0])
    damped = omega * np.sqrt(1.0 - ratio**2)
    step = 2.25 * np.pi / damped / count
    speed = 1e-3
    velocity = np.array([[-0.5 * speed, 0.0, 0.0], [0.5 * speed, 0.0, 0.0]])
    listed = [effects.BondDamping()]
    scene = Scene(mesh, rock(damping_ratio=ratio), listed, velocity=velocity)
    simulation = Simulation(scene, Uniform(step))
    simulation.advance_to(count)
    place = simulation.values(simulation.state.position)[:2, 0] - model.centre[:, 0]
    exact = speed / damped * np.exp(-ratio * omega * count * step) * np.sin(2.25 * np.pi)
    assert place[1] - place[0] == pytest.approx(exact, rel=2.0 * omega * step)


def test_all_spheres_of_a_face_are_as_stiff_as_its_bond():
    """In a mesh of equal faces, six spheres: 6 k = E_n A / h; a single body has one too."""
    mesh = pair(0.05)
    bonds = bond_geometry(mesh, topology_of(mesh), DENSITY)
    normal, _ = bond_moduli(E, NU)
    whole = float((normal * bonds.area / bonds.distance)[0])
    for given in (mesh, single(0.05)):
        material = Model(given, rock(), []).material
        assert 6.0 * material.contact_stiffness == pytest.approx(whole, rel=1e-12)
        critical = 2.0 * np.sqrt(material.contact_stiffness * float(bonds.pair_mass[0]))
        assert material.contact_damping == pytest.approx(RATIO * critical, rel=1e-12)


def test_elements_too_large_for_the_fracture_energy_are_refused_by_bond():
    """A bond fails beyond its strength if h < 2 E_n G_f / sigma^2; the largest h decides."""
    mesh = random_block(2, seed=3)
    bonds = bond_geometry(mesh, topology_of(mesh), DENSITY)
    largest = int(bonds.distance.argmax())
    least = 3e6**2 * bonds.distance[largest] / (2.0 * bond_moduli(E, NU)[0])
    Scene(mesh, rock(fracture_energy=1.001 * least))
    words = rf"^fracture_energy must be larger than .* J/m2 at bond {largest}, whose bodies are"
    with pytest.raises(InputError, match=words):
        Scene(mesh, rock(fracture_energy=0.999 * least))


def test_the_report_shows_what_was_asked_and_warns_of_large_elements():
    """Characteristic length E G_f / sigma^2 = 0.36 m; boxes of 0.33 m have elements of 0.36 m."""
    report = elastic_report(Scene(random_block(3, seed=0), rock(), "all"))
    assert report.asked == pytest.approx((E, NU), rel=1e-6)
    assert report.crack_length == pytest.approx(report.stiffness.young * 100.0 / 9e12)
    assert "less than 4 elements at" in report.warnings[0]


def test_concrete_reaches_its_strength_at_the_onset():
    # Linear up to the onset: k_n u_E = sigma_f; the paper's figures give u_E = 14.80 um.
    assert CONCRETE.normal_stiffness * CONCRETE.onset_opening == pytest.approx(6.66e6)
    assert CONCRETE.onset_opening == pytest.approx(14.80e-6, abs=0.005e-6)


def test_area_under_the_traction_curve_is_the_fracture_energy():
    # A triangle of base u_f and height sigma_f, whatever the onset; and u_f = 29.93 um.
    area = 0.5 * CONCRETE.failure_opening * CONCRETE.tensile_strength
    assert area == pytest.approx(99.67)
    assert CONCRETE.failure_opening == pytest.approx(29.93e-6, abs=0.005e-6)
    fall = CONCRETE.softening_slope * (CONCRETE.failure_opening - CONCRETE.onset_opening)
    assert fall == pytest.approx(CONCRETE.tensile_strength)


def test_failure_before_the_strength_is_refused_with_the_least_energy():
    # u_f > u_E means G_f > sigma_f^2 / (2 k_n) = 49.284 J/m2 for the concrete.
    least = CONCRETE.tensile_strength**2 / (2.0 * CONCRETE.normal_stiffness)
    assert dataclasses.replace(CONCRETE, fracture_energy=1.001 * least).softening_slope > 0.0
    with pytest.raises(InputError, match=r"fracture_energy must be larger .* 49\.284 J/m2"):
        dataclasses.replace(CONCRETE, fracture_energy=least)
