"""Constants of bonds and contacts follow from what is measured, and of two materials by rule."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, effects, step_report
from taichi_dem.materials.body_materials import joined
from taichi_dem.materials.bond_rules import bond_geometry
from taichi_dem.materials.material import bond_moduli
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import body_properties, topology_of
from taichi_dem.state.model import Model
from tests.material.blocks import DENSITY, NU, ORE, E, random_block, rock

HALF = ("half", lambda x: x[:, 0] > 0.5)


def halves(first=CONCRETE, second=ORE, effects_=(), mesh=None, **options):
    """A scene of a mesh of 1 m whose right half has the second material."""
    mesh = (mesh or bar(1.0, 0.25, (4, 1, 1))).body_group(*HALF)
    return Scene(mesh, first, effects_, materials={"half": second}, **options)


def test_what_joins_two_materials_is_in_series_and_as_weak_as_the_weaker():
    both = joined(CONCRETE, ORE)
    for kind in ("normal", "shear", "contact"):
        for name in (f"{kind}_stiffness", f"{kind}_damping"):
            first, second = getattr(CONCRETE, name), getattr(ORE, name)
            assert 1.0 / getattr(both, name) == pytest.approx(0.5 / first + 0.5 / second)
    for name in ("tensile_strength", "cohesion", "friction", "fracture_energy"):
        assert getattr(both, name) == min(getattr(CONCRETE, name), getattr(ORE, name))
    assert joined(ORE, CONCRETE) == both
    # No dashpot in series with another is none.
    assert joined(CONCRETE, replace(ORE, contact_damping=0.0)).contact_damping == 0.0


def test_a_bond_of_two_moduli_gives_way_by_the_part_of_its_distance_in_each():
    """1 / k = d_1 / E_1 + d_2 / E_2, d the distances of the centres from the face."""
    mesh = random_block(2, seed=1).body_group(*HALF)
    scene = Scene(mesh, rock(), materials={"half": rock(young=3 * E, damping_ratio=0.2)})
    model, top = Model(mesh, scene.body_materials, []), topology_of(mesh)
    kinds = scene.body_materials.of_body[np.stack([top.master, top.slave])]
    mixed = kinds[0] != kinds[1]
    assert mixed.any()
    centre = body_properties(mesh, 1.0)[1]
    corner = mesh.points[top.vertices]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = [
        np.abs(((corner[:, 0] - centre[side]) * normal).sum(axis=1))
        for side in (top.master, top.slave)
    ]
    for column, modulus in enumerate(bond_moduli(E, NU)):
        soft = sum(d / (modulus * (1.0 + 2.0 * kind)) for d, kind in zip(away, kinds))
        assert model.bond_stiffness[:, column] == pytest.approx(1.0 / soft, rel=1e-12)
    geometry = bond_geometry(mesh, top, rock().density)
    critical = np.sqrt(model.bond_stiffness[:, 0] * geometry.pair_mass / geometry.area)
    ratio = 0.5 * model.bond_damping[:, 0] / critical
    assert ratio[~mixed] == pytest.approx(np.where(kinds[0], 0.2, 0.05)[~mixed])
    assert ((ratio[mixed] > 0.05) & (ratio[mixed] < 0.2)).all()


def test_masses_and_contacts_are_those_of_each_material():
    scene = halves(rock(), rock(density=5000.0, young=2 * E), mesh=random_block(2, seed=1))
    laid, mesh = scene.body_materials, scene.mesh
    model = Model(mesh, laid, [])
    volume = body_properties(mesh, 1.0)[0]
    assert model.body_mass == pytest.approx(np.where(laid.of_body, 5000.0, 2450.0) * volume)
    for k, row in enumerate(laid.pairs):
        bodies = np.flatnonzero(laid.of_body == k)
        alone = laid.materials[k].contact_stiffness.of_mesh(mesh, 1.0, bodies)
        assert row[k].contact_stiffness == alone
    first, second = (laid.pairs[k][k].contact_stiffness for k in range(2))
    assert laid.pairs[0][1].contact_stiffness == 2.0 * first * second / (first + second)


def test_steps_are_those_of_the_stricter_material():
    """Away from the seam each body has the limits that it has in a mesh of its material alone."""
    scene = halves(CONCRETE, ORE, [effects.BondDamping(), effects.SphereContact()])
    mixed = step_report(scene)
    laid, top = scene.body_materials, topology_of(scene.mesh)
    seam = laid.of_body[top.master] != laid.of_body[top.slave]
    inner = np.ones(scene.mesh.body_count, dtype=bool)
    inner[np.concatenate([top.master[seam], top.slave[seam]])] = False
    alone = [step_report(replace(scene, material=each, materials={})) for each in (CONCRETE, ORE)]
    for name in ("bond_stiffness", "bond_dashpot"):
        own = np.where(laid.of_body, alone[1].limits[name], alone[0].limits[name])
        assert np.array_equal(mixed.limits[name][inner], own[inner])
    # A body of concrete may meet one of ore: 2 k1 k2 / (k1 + k2) is 1.6 of its own stiffness.
    ratio = mixed.limits["contact_stiffness"] / np.where(
        laid.of_body, alone[1].limits["contact_stiffness"], alone[0].limits["contact_stiffness"]
    )
    firmer = 2.0 * 4.0 / (1.5 + 4.0)
    assert ratio == pytest.approx(np.where(laid.of_body, 1.0, 1.0 / np.sqrt(firmer)))


def test_a_body_in_two_groups_of_different_materials_is_refused():
    mesh = bar(1.0, 0.25, (4, 1, 1)).body_group(*HALF)
    mesh = mesh.body_group("low", lambda x: x[:, 1] < 0.13)
    with pytest.raises(InputError, match="is in the groups half and low, which have different"):
        Scene(mesh, CONCRETE, materials={"half": ORE, "low": CONCRETE})


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
        assert whole == pytest.approx(0.05 * critical, rel=1e-12)


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
        assert material.contact_damping == pytest.approx(0.05 * critical, rel=1e-12)
