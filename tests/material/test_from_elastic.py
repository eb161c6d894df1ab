"""A material from what is measured gives bonds, dashpots and contacts by the bodies of a mesh."""

import numpy as np
import pytest

from taichi_dem import Scene, Simulation, Uniform, effects
from taichi_dem.materials.bond_rules import bond_geometry
from taichi_dem.materials.material import bond_moduli
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.mesh.topology import topology_of
from taichi_dem.state.model import Model
from tests.material.blocks import DENSITY, NU, E, random_block, rock
from tests.structures import filled

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
    laws = filled("bonds", effects.BondDamping())
    scene = Scene(mesh, rock(damping_ratio=ratio), laws, velocity=velocity)
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
