"""Scenes with a material from what is measured: bonds, dashpots, contacts, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Material,
    Scene,
    Simulation,
    Uniform,
    effects,
    elastic_report,
    step_report,
)
from taichi_dem.elasticity.bond_rules import bond_geometry
from taichi_dem.elasticity.moduli import bond_moduli
from taichi_dem.engine.model import Model
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import topology_of
from tests.material.blocks import DENSITY, NU, E, random_block, rock

RATIO = 0.05
STILL = np.array([1.0, 0.0, 0.0, 0.0])


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


def test_distances_of_bodies_fill_three_volumes():
    """A tetrahedron's centre is a quarter of its altitude from a face: area times h, four faces."""
    mesh = random_block(3, seed=2)
    bonds = bond_geometry(mesh, topology_of(mesh), DENSITY)
    topology = topology_of(mesh)
    shared = (topology.body_bond >= 0).sum(axis=1)
    mass = Model(mesh, rock(), []).body_mass
    assert bonds.area @ bonds.distance == pytest.approx(0.75 * (shared @ mass) / DENSITY, rel=1e-12)


@pytest.mark.parametrize(
    "method", [Uniform, pytest.param(ImplicitDashpots, marks=pytest.mark.slow)]
)
def test_a_pair_swings_and_dies_away_at_the_damping_ratio(method):
    """u = v / w_d exp(-ratio w t) sin(w_d t), w^2 = A E_n / (h m); after a period, by both methods.

    The dashpots of the explicit method are of first order in the step: w dt is allowed for.
    """
    mesh, ratio, count = pair(0.05), 0.1, 4000
    model = Model(mesh, rock(damping_ratio=ratio), [])
    bonds = bond_geometry(mesh, model.topology, DENSITY)
    omega = float(np.sqrt(bond_moduli(E, NU)[0] / bonds.distance * bonds.area / bonds.pair_mass)[0])
    damped = omega * np.sqrt(1.0 - ratio**2)
    step = 2.25 * np.pi / damped / count
    scene = Scene(mesh, rock(damping_ratio=ratio), [effects.BondDamping()])
    simulation = Simulation(scene, method(step))
    speed = 1e-3
    velocity = np.array([[-0.5 * speed, 0.0, 0.0], [0.5 * speed, 0.0, 0.0]])
    simulation.state.set_motion(model.centre, np.tile(STILL, (2, 1)), velocity)
    simulation.advance_to(count)
    place = simulation.state.position.to_numpy()[:2, 0] - model.centre[:, 0]
    exact = speed / damped * np.exp(-ratio * omega * count * step) * np.sin(2.25 * np.pi)
    assert place[1] - place[0] == pytest.approx(exact, rel=2.0 * omega * step)


def test_silent_damping_of_bonds_gives_no_dashpots():
    silent = Scene(pair(0.05), rock(), [effects.BondDamping().silent()])
    simulation = Simulation(silent, Uniform(1e-7))
    dashpot = simulation.advance.tables.dashpot
    assert not dashpot.coefficient.to_numpy().any()


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


def test_contacts_bear_about_the_steps_that_bonds_bear():
    """A face of spheres is one spring where bonds are four: a step of one to four times as long.

    In meshes of uneven bodies the softest and stiffest differ: from half of that on.
    """
    for seed in range(3):
        steps = step_report(random_block(3, seed), rock())
        ratio = steps.borne("solved", "contact").min() / steps.borne("solved").min()
        assert 0.5 < ratio < 4.0


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


def test_slip_weakening_asks_the_softest_bond():
    mesh = random_block(2, seed=3)
    bonds = bond_geometry(mesh, topology_of(mesh), DENSITY)
    least = 6e6**2 * bonds.distance.max() / (2.0 * bond_moduli(E, NU)[1])
    Scene(mesh, rock(), [effects.SlipWeakening(1.001 * least)])
    with pytest.raises(InputError, match=r"^fracture_energy of slip_weakening must be larger than"):
        Scene(mesh, rock(), [effects.SlipWeakening(0.999 * least)])


def test_a_closed_form_for_constants_per_area_refuses_a_material_of_moduli():
    with pytest.raises(InputError, match="needs a material of constants per area"):
        _ = rock().onset_opening


@pytest.mark.parametrize("value", [-1.0, 90.0, np.nan, "30"])
def test_angles_of_friction_out_of_range_are_refused(value):
    with pytest.raises(InputError, match=r"^friction_angle must be a number from 0 to below 90"):
        rock(friction_angle=value)


def test_a_rule_of_contacts_is_no_constant_of_bonds():
    wrong = rock().contact_stiffness
    with pytest.raises(InputError, match=r"^normal_stiffness must be a finite number"):
        replace(CONCRETE, normal_stiffness=wrong)


def test_angle_and_ratio_become_the_constants_of_the_laws():
    material = rock(friction_angle=30.0, damping_ratio=0.0)
    assert material.friction == pytest.approx(1.0 / np.sqrt(3.0))
    assert not material.has_bond_damping
    assert not material.has_contact_damping
    assert isinstance(material, Material)


def blast(word):
    """A random block under a blow that breaks it, all laws from the material."""
    blow = effects.GasPressure("left", peak=4e7, rise=2e-5, decay_ratio=1.0)
    return Scene(random_block(3, seed=1, size=0.2), rock(), word, loads=[blow])


@pytest.mark.slow
def test_laws_on_demand_give_the_bits_of_all_laws():
    """With effects="auto" and "all" alike, through fracture, sleep off."""
    end = {}
    for word in ("auto", "all"):
        scene = replace(blast(word), sleep=0.0) if word == "auto" else blast(word)
        simulation = Simulation(scene, ImplicitDashpots(5e-7))
        simulation.advance_to(300)
        end[word] = {
            name: field.to_numpy()
            for name, field in simulation.state.fields().items()
            if name in ("position", "velocity", "broken_tick")
        }
    assert (end["all"]["broken_tick"][: simulation.model.bond_count] >= 0).any()
    for name, values in end["all"].items():
        assert np.array_equal(values, end["auto"][name]), name


def test_the_report_names_what_was_asked_and_warns_of_large_elements():
    """Characteristic length E G_f / sigma^2 = 0.36 m; boxes of 0.33 m have elements of 0.36 m."""
    report = elastic_report(Scene(random_block(3, seed=0), rock(), "all"))
    assert report.asked == pytest.approx((E, NU), rel=1e-6)
    assert report.crack_length == pytest.approx(report.stiffness.young * 100.0 / 9e12)
    assert "less than 4 elements at" in report.warnings[0]
    small = elastic_report(Scene(bar(0.1, 0.02, (10, 2, 2)), rock(), "all"))
    assert not small.warnings
    assert small.elements.min() > 4.0
    for text in ("asked for", "along x", "long waves", "characteristic length", "largest stable"):
        assert text in str(small)


def test_a_material_of_constants_per_area_was_made_for_no_modulus():
    report = elastic_report(Scene(bar(0.5, 0.1, (5, 1, 1)), CONCRETE, "all"))
    assert report.asked is None
    assert "asked for" not in str(report)
