"""Elements too large for strength and energy: refused with a size that fits, or made weaker.

A bond of bodies h apart holds f_t^2 h / (2 E_n) at its strength f_t, and may spend G. With the
margin that a lowered strength leaves, h may be 2 E_n G / (f_t^2 SPARE).
"""

import re

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, effects, step_report
from taichi_dem.materials.material import SPARE, bond_moduli
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.shapes import pair as pair_mesh
from taichi_dem.state.model import Model
from tests.material.blocks import NU, E, rock
from tests.probe import BondProbe

CELLS = (4, 2, 2)
#: Length of a bar [m] whose elements do not allow this fracture energy [J/m^2] with this strength.
LONG, TOUGH, STRONG = 8.0, 100.0, 1e7
MODULUS, _ = bond_moduli(E, NU)


def coarse(length=LONG, **changed):
    """A scene of a bar."""
    material = rock(fracture_energy=TOUGH, tensile_strength=STRONG, **changed)
    return Scene(bar(length, 0.5 * length, CELLS), material, "auto")


def widest(scene):
    """Largest distance of bonded bodies along the normal of their face [m]."""
    model = Model(scene.mesh, scene.body_materials, scene.effects)
    return MODULUS / model.bond_stiffness[:, 0].min()


def test_a_refusal_tells_the_size_of_elements_that_would_do_and_their_number():
    with pytest.raises(InputError, match="elements of at most") as refused:
        coarse()
    size, count = map(
        float, re.search(r"most (\S+) m would do, about (\S+) of", str(refused.value)).groups()
    )
    # A bar of that size of elements, to the two digits that are told, has this strength to spare.
    weak = coarse(coarse="weaken")
    strength = weak.body_materials.pairs[0][0].tensile_strength
    share = (strength / weak.material.tensile_strength) ** 2
    edge = np.cbrt(6.0 * np.sqrt(2.0) * 0.5 * 0.5 * LONG**3 / (6 * np.prod(CELLS)))
    assert size == pytest.approx(share * edge, rel=0.05)
    assert count == pytest.approx(6 * np.prod(CELLS) / share**3, rel=0.05)
    assert coarse(0.99 * share * LONG, coarse="weaken").body_materials.weakened == ()
    coarse(0.99 * share * LONG)


def test_a_lowered_strength_keeps_the_energy_of_the_softest_bond():
    """And is told before a run, and with what is known of its error; cohesion stays."""
    scene = coarse(coarse="weaken")
    (pair,) = scene.body_materials.checked_pairs()
    held = pair.tensile_strength**2 * widest(scene) / (2.0 * MODULUS)
    assert held * SPARE == pytest.approx(TOUGH, rel=1e-12)
    assert (pair.cohesion, pair.fracture_energy) == (scene.material.cohesion, TOUGH)
    (sentence,) = scene.body_materials.weakened
    assert sentence in step_report(scene).warnings


def test_a_bond_that_was_made_weaker_spends_its_fracture_energy():
    material = rock(fracture_energy=TOUGH, tensile_strength=STRONG, coarse="weaken")
    probe = BondProbe(pair_mesh(3.0), [effects.CohesiveCrack()], material)
    limit = probe.model.material.tensile_strength
    assert limit < 0.5 * material.tensile_strength
    onset = limit / probe.model.bond_stiffness[0, 0]
    assert probe.open([(1.0 - 1e-9) * onset, 0.0, 0.0])[0] == pytest.approx(limit, rel=1e-8)
    assert not probe.spent().any()
    probe.open([4.0 * onset, 0.0, 0.0])
    assert probe.broken and probe.spent() == pytest.approx(3 * [TOUGH], rel=1e-12)


@pytest.mark.parametrize(
    ("material", "loads", "names"),
    [
        (rock(), [], ["cohesive_crack"]),
        (rock(), [effects.SlipWeakening(500.0)], ["softening", "slip_weakening"]),
        (CONCRETE, [], ["softening", "shear_slip"]),
    ],
)
def test_laws_of_a_word_are_those_of_the_material_and_of_the_laws_given(material, loads, names):
    """Constants per area are the paper's, with its laws; a part of a law takes the other one."""
    for word in ("auto", "all"):
        scene = Scene(bar(0.4, 0.2, CELLS), material, word, loads=loads)
        laws = [one.name for one in scene.effects if one.role in ("bond", "tension", "shear")]
        assert laws == names
