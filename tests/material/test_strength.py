"""Strength that varies from bond to bond: its law, and what one bond makes of it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, effects
from taichi_dem.elasticity.rates import wave_moduli
from taichi_dem.materials.strength import drawn, factors, weibull_modulus
from taichi_dem.mesh.shapes import bar
from tests.boundaries.test_notches import AREA, run_pair
from tests.structures import filled

MANY = 100_000
BLOCK = bar(0.2, 0.1, (4, 2, 2))


@pytest.mark.parametrize("spread", [0.05, 0.3, 1.0])
def test_factors_have_mean_one_the_spread_and_the_law_of_weibull(spread):
    """Five standard errors; ln(-ln(share that is stronger)) is straight with the slope m.

    At the quantiles x of 0.1 and 0.9: m = ln(ln 0.1 / ln 0.9) / ln(x_0.9 / x_0.1). The standard
    error of a quantile q is sqrt(q (1 - q) / n) over the density, below 4 / (m sqrt n) of it.
    """
    whole = np.full(MANY, spread)
    found = factors(whole, 0.0 * whole, whole, seed=3)
    error = 5.0 / math.sqrt(MANY)
    assert found.mean() == pytest.approx(1.0, abs=error * spread)
    # Excess kurtosis of up to 6, that of m = 1.
    assert found.std() == pytest.approx(spread, rel=error * 1.5)
    modulus = weibull_modulus(spread)
    low, high = np.quantile(found, [0.1, 0.9])
    slope = math.log(math.log(0.1) / math.log(0.9)) / math.log(high / low)
    assert slope == pytest.approx(modulus, rel=2.0 * 5.0 * 4.0 / math.sqrt(MANY))
    sized = factors(whole, 0.0 * whole + 8.0, whole / whole, seed=3)
    assert sized == pytest.approx(8.0 ** (1.0 / modulus) * found, rel=1e-7, abs=1e-7)


def test_draws_depend_on_the_seed_and_the_place_alone():
    """Not on how many are drawn; other seeds and neighbours are not alike: five over sqrt n."""
    one, other = drawn(7, MANY), drawn(8, MANY)
    assert np.array_equal(one[:100], drawn(7, 100)) and (0.0 < one).all() and (one < 1.0).all()
    for first, second in ((one, other), (one[1:], one[:-1]), (drawn(0, MANY), drawn(1, MANY))):
        assert abs(np.corrcoef(first, second)[0, 1]) < 5.0 / math.sqrt(MANY)


def test_a_bond_of_another_strength_spends_that_share_and_is_as_stiff():
    """Energy A k u^2 / 2 before it softens, whatever its strength; G_f times the share at the end.

    To (2e-8 / 3e-5)^2: see the test of a weaker bond.
    """
    share = 1.3
    drive = effects.PrescribedMotion("left", (-0.1, 0.0, 0.0)), effects.Fixed("right")
    laws = filled("supports", effects.Softening(), *drive, group="post_base")
    simulation, account = run_pair(laws, 200, 0.1, 2e-7, strength=[share])
    stiffness = AREA * CONCRETE.normal_stiffness
    assert account["bond_strain"] == pytest.approx(0.5 * stiffness * 4e-6**2, rel=1e-6)
    simulation.advance_to(1600)
    account = simulation.energy_balance.account()
    spent = account["softening"] + account["release"]
    assert spent == pytest.approx(share * AREA * CONCRETE.fracture_energy, rel=1e-5)


def test_a_scene_draws_by_its_seed_and_by_place_and_changes_no_stiffness():
    spread = replace(CONCRETE, strength_spread=0.2)
    one, same, other = (Scene(BLOCK, spread, seed=seed).model() for seed in (1, 1, 2))
    assert np.array_equal(one.strength, same.strength)
    assert not np.array_equal(one.strength, other.strength)
    even = Scene(BLOCK, CONCRETE).model()
    assert even.strength is None
    whole = Scene(BLOCK, CONCRETE, strength=np.ones(even.bond_count)).model()
    for name, rows in even.bonds.items():
        assert np.array_equal(rows, whole.bonds[name])
    assert np.array_equal(even.bond_stiffness, whole.bond_stiffness)
    high = Scene(BLOCK, spread, strength=lambda x: 1.0 - 0.5 * (x[:, 0] > 0.1), seed=1).model()
    ratio = high.strength / one.strength
    assert {*np.round(ratio, 12)} == {0.5, 1.0}
    faces = BLOCK.groups["left"]
    for first, second in zip(wave_moduli(even, faces), wave_moduli(high, faces)):
        assert second == pytest.approx(first, rel=1e-12)


def test_what_is_no_strength_is_refused():
    for wrong in ([1.0], np.zeros(BLOCK.body_count), lambda x: x, "x"):
        with pytest.raises(InputError, match="strength must be"):
            Scene(BLOCK, CONCRETE, strength=wrong)
    with pytest.raises(InputError, match="strength_spread must"):
        replace(CONCRETE, strength_spread=1.5)
    brittle = replace(CONCRETE, fracture_energy=60.0, strength_spread=0.5)
    with pytest.raises(InputError, match="of the strongest bond"):
        Scene(BLOCK, brittle, strength=lambda x: 0.0 * x[:, 0] + 10.0)
    with pytest.raises(InputError, match="seed must"):
        Scene(BLOCK, CONCRETE, seed=-1)
