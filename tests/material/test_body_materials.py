"""Which material a body has, what joins two of them, and all that asks before a run."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
    effects,
    elastic_report,
    mesh_stiffness,
    quality_report,
    step_report,
    with_body_group,
)
from taichi_dem.body_materials import MOST, joined
from taichi_dem.diagnostics.estimates import estimates_before
from taichi_dem.diagnostics.missing_effects import unserved
from taichi_dem.elasticity.bond_rules import bond_geometry
from taichi_dem.elasticity.moduli import bond_moduli
from taichi_dem.engine.model import Model
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.mesh.topology import body_properties, topology_of
from taichi_dem.methods import Uniform
from taichi_dem.scene import scene_warnings
from taichi_dem.simulate import run_identity
from tests.material.blocks import NU, E, random_block, rock

HALF = ("half", lambda x: x[:, 0] > 0.5)
ORE = replace(
    CONCRETE,
    density=4000.0,
    normal_stiffness=900e9,
    tensile_strength=3e6,
    friction=0.7,
    contact_stiffness=4e9,
    contact_damping=0.0,
)


def halves(first=CONCRETE, second=ORE, effects_=(), mesh=None, **options):
    """A scene of a mesh of 1 m whose right half has the second material."""
    mesh = with_body_group(mesh or bar(1.0, 0.25, (4, 1, 1)), *HALF)
    return Scene(mesh, first, effects_, materials={"half": second}, **options)


def test_what_joins_two_materials_is_in_series_and_as_weak_as_the_weaker():
    both = joined(CONCRETE, ORE)
    for name in ("normal_stiffness", "contact_stiffness"):
        first, second = getattr(CONCRETE, name), getattr(ORE, name)
        assert 1.0 / getattr(both, name) == pytest.approx(0.5 / first + 0.5 / second)
    assert both.contact_damping == 0.0
    assert (both.tensile_strength, both.friction) == (3e6, 0.58)
    same = ("shear_stiffness", "normal_damping", "shear_damping", "cohesion", "fracture_energy")
    assert all(getattr(both, name) == getattr(CONCRETE, name) for name in same)
    assert joined(ORE, CONCRETE) == both
    assert joined(CONCRETE, replace(CONCRETE)) == CONCRETE


def test_a_bond_of_two_moduli_gives_way_by_the_part_of_its_distance_in_each():
    """1 / k = d_1 / E_1 + d_2 / E_2, d the distances of the centres from the face."""
    mesh = with_body_group(random_block(2, seed=1), *HALF)
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


def tables(scene):
    model = Model(scene.mesh, scene.body_materials, scene.effects)
    arrays = model.body_mass, model.body_inertia, model.bond_stiffness, model.bond_damping
    strength = model.of_bonds(lambda material: material.tensile_strength)
    return [*arrays, np.broadcast_to(strength, model.bond_count)]


def assert_same(first, second):
    assert all(np.array_equal(one, other) for one, other in zip(first, second))


def test_the_order_of_groups_changes_no_bit_and_no_checkpoint():
    mesh = with_body_group(bar(1.0, 0.25, (8, 1, 1)), "a", lambda x: x[:, 0] < 0.3)
    mesh = with_body_group(mesh, "b", lambda x: x[:, 0] > 0.6)
    given = {"a": ORE, "b": replace(ORE, density=1000.0)}
    scenes = [
        Scene(mesh, CONCRETE, materials=dict(order))
        for order in (given.items(), [*given.items()][::-1])
    ]
    assert_same(*map(tables, scenes))
    first, second = (run_identity(scene, Uniform(1e-8)) for scene in scenes)
    assert first == second
    other = Scene(mesh, CONCRETE, materials={"a": given["b"], "b": given["a"]})
    assert run_identity(other, Uniform(1e-8)) != first


def test_groups_of_equal_materials_are_one_material():
    plain = Scene(bar(1.0, 0.25, (4, 1, 1)), CONCRETE)
    same = halves(CONCRETE, replace(CONCRETE))
    assert same.body_materials.is_one
    assert_same(tables(plain), tables(same))
    identities = [run_identity(scene, Uniform(1e-8)) for scene in (plain, same)]
    assert identities[0] == identities[1]
    # A material that no body has counts for nothing.
    mesh = with_body_group(plain.mesh, "all", lambda x: x[:, 0] > 0.0)
    assert_same(tables(Scene(mesh, ORE)), tables(Scene(mesh, CONCRETE, materials={"all": ORE})))


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
        quality = quality_report(scene.mesh, laid)
        found = quality.spring_step_s if name == "bond_stiffness" else quality.dashpot_step_s
        assert np.array_equal(found, mixed.limits[name])
    # A body of concrete may meet one of ore: 2 k1 k2 / (k1 + k2) is 1.6 of its own stiffness.
    ratio = mixed.limits["contact_stiffness"] / np.where(
        laid.of_body, alone[1].limits["contact_stiffness"], alone[0].limits["contact_stiffness"]
    )
    firmer = 2.0 * 4.0 / (1.5 + 4.0)
    assert ratio == pytest.approx(np.where(laid.of_body, 1.0, 1.0 / np.sqrt(firmer)))
    assert mixed.step_s.min() <= min(report.step_s.min() for report in alone) * np.sqrt(2.0)


def test_laws_are_those_that_any_material_needs():
    bare = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0, friction=0.0)
    for first, second in ((bare, CONCRETE), (CONCRETE, bare)):
        names = [effect.name for effect in halves(first, second, "all").effects]
        assert {"bond_damping", "friction"} <= set(names)
    # Friction by dashpots alone is none where a material has none.
    names = [effect.name for effect in halves(CONCRETE, ORE, "all").effects]
    assert "sticking_friction" in names
    listed = [effects.SphereContact(), effects.Friction()]
    (words,) = scene_warnings(halves(CONCRETE, ORE, listed))
    assert "friction never acts on bodies of a material" in words
    model = Model(halves(bare, CONCRETE).mesh, halves(bare, CONCRETE).body_materials, [])
    assert "dashpot" in unserved(model)


def test_estimates_take_the_weakest():
    gas = effects.GasPressure("left", peak=1e6, rise=1e-5)
    scene = halves(CONCRETE, ORE, [gas])
    model = Model(scene.mesh, scene.body_materials, scene.effects)
    group = {each.effect: each.group for each in estimates_before(model, 1e-3)}
    alone = Model(scene.mesh, ORE, scene.effects)
    own = {each.effect: each.group for each in estimates_before(alone, 1e-3)}
    assert group["softening"] == own["softening"]


def test_a_block_of_two_materials_is_as_soft_as_both_halves_in_a_row():
    """Along x compliances add by length; what ties the halves across adds under 3 %."""
    mesh = random_block(3, seed=1)
    scene = halves(rock(), rock(young=2 * E, tensile_strength=2e6), mesh=mesh)
    report = elastic_report(scene)
    own = [mesh_stiffness(mesh, each).young_along[0] for each in scene.body_materials.materials]
    share = body_properties(mesh, 1.0)[0] @ scene.body_materials.of_body
    soft = (1.0 - share) / own[0] + share / own[1]
    assert report.stiffness.young_along[0] == pytest.approx(1.0 / soft, rel=0.03)
    assert report.asked is None
    lengths = np.unique(report.crack_length)
    assert lengths[1] / lengths[0] == pytest.approx(2.0 * (3.0 / 2.0) ** 2)
    assert f"{lengths[0]:.3g} to {lengths[1]:.3g} m" in str(report)


def test_a_quiet_boundary_takes_the_density_of_its_bodies():
    """Of a bar of one material twice as heavy on the right, in tables by body."""
    mesh = with_body_group(bar(1.0, 0.25, (4, 1, 1)), *HALF)
    heavy = Scene(mesh, CONCRETE, materials={"half": replace(CONCRETE, density=9560.0)})
    assert Model(mesh, heavy.body_materials, []).materials.density.max() == 9560.0


REFUSED = {
    "no dict": (ORE, "materials must be a dict of body group to Material, got"),
    "no group": ({"none": ORE}, "no body group 'none'; its body groups are: half, low"),
    "faces": ({"left": ORE}, "left is a group of faces: make one of bodies"),
    "number": (
        {"half": 3.0},
        "materials must be a dict of body group to Material, got {'half': 3.0}",
    ),
    "both": ({"half": ORE, "low": CONCRETE}, "is in the groups half and low, which have different"),
    "brittle": (
        {
            "half": replace(
                CONCRETE, normal_stiffness=1e9, tensile_strength=1e6, fracture_energy=1e3
            )
        },
        "at bond .* and of two materials, of which it has the lesser strength and energy",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_materials_are_refused_in_words(name):
    given, words = REFUSED[name]
    mesh = with_body_group(bar(1.0, 0.25, (4, 1, 1)), *HALF)
    mesh = with_body_group(mesh, "low", lambda x: x[:, 1] < 0.13)
    # Each is tough enough for itself: 1e12 / 2e9 = 500 J/m2, and 49 for the concrete.
    with pytest.raises(InputError, match=words):
        Scene(mesh, CONCRETE, materials=given)


def test_a_body_may_be_in_two_groups_of_one_material():
    mesh = with_body_group(bar(1.0, 0.25, (4, 1, 1)), *HALF)
    mesh = with_body_group(mesh, "low", lambda x: x[:, 1] < 0.13)
    assert not Scene(mesh, CONCRETE, materials={"half": ORE, "low": ORE}).body_materials.is_one


def test_too_many_materials_are_refused():
    mesh = bar(1.0, 0.25, (4, 1, 1))
    groups = {f"g{k}": [k] for k in range(MOST)}
    mesh = replace(mesh, body_groups=groups)
    given = {f"g{k}": replace(CONCRETE, density=1000.0 + k) for k in range(MOST)}
    with pytest.raises(InputError, match=f"^materials must be at most {MOST} different ones"):
        Scene(mesh, CONCRETE, materials=given)
    given.pop("g0")
    assert len(Scene(mesh, CONCRETE, materials=given).body_materials.materials) == MOST


class Heavy(effects.Gravity):
    """A load that takes a number of the material."""

    def numbers(self, material):
        return (material.density, 0.0, 0.0)


def test_a_load_that_takes_a_number_of_the_material_is_refused_with_several():
    with pytest.raises(
        InputError, match=r"^effect gravity takes one row of numbers for all bodies"
    ):
        halves(CONCRETE, ORE, [Heavy()])
    halves(CONCRETE, replace(ORE, density=CONCRETE.density), [Heavy()])


def test_effects_are_checked_with_every_bond():
    """Slip weakening asks for cohesion in each of the materials that a bond has."""
    with pytest.raises(InputError, match="cohesion of the material must be more than 0 Pa"):
        halves(CONCRETE, replace(ORE, cohesion=0.0), [effects.SlipWeakening(1e4)])


def test_a_pair_has_one_bond_between_two_materials():
    mesh = with_body_group(pair(0.05), "right", lambda x: x[:, 0] > 0.0)
    scene = Scene(mesh, CONCRETE, materials={"right": ORE})
    model = Model(mesh, scene.body_materials, [])
    assert model.bond_stiffness[0, 0] == 600e9
    assert model.of_bonds(lambda material: material.tensile_strength).tolist() == [3e6]
