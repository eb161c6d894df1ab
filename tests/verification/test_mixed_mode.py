"""A bonded pair with the law of mixed modes, against its closed form along straight ways.

Along a way of fixed direction the force is that of a triangle: stiffness K up to x_0, a straight
line down to zero at x_1, with K x_0^2 = e_0, K x_0 x_1 = 2 G, and by Benzeggagh and Kenane

    B = k_s s^2 / K,  G = G_I + (G_II - G_I) B^n,
    e_0 = f_t^2 / k_n + (c^2 / k_s - f_t^2 / k_n) B^n.

Openings are known to OPENING_ERROR (test_bond_law), tractions to the stiffness times that; the
line falls no steeper than K where x_1 is at least 2 x_0.
"""

import numpy as np
import pytest

from taichi_dem import CONCRETE, effects
from taichi_dem.mesh import shapes as mesh_shapes
from tests.probe import BondProbe
from tests.verification.test_bond_law import EDGE, OPENING_ERROR

K_N, K_S = CONCRETE.normal_stiffness, CONCRETE.shear_stiffness
FIRST = CONCRETE.tensile_strength**2 / K_N, CONCRETE.cohesion**2 / K_S
G_I, EXPONENT = CONCRETE.fracture_energy, 1.75
G_II = max(2.0 * G_I, 2.0 * FIRST[1])
ERROR = max(K_N, K_S) * OPENING_ERROR
#: Directions of the way: pure opening, pure sliding, 45 degrees, and one without a symmetry.
WAYS = {"I": (1, 0, 0), "II": (0, 0.6, -0.8), "45": (1, 1, 0), "other": (0.3, -0.5, 0.7)}


@pytest.fixture(scope="module")
def built():
    return BondProbe(mesh_shapes.pair(EDGE), [effects.MixedMode(G_II, EXPONENT)])


@pytest.fixture
def pair(built):
    """The pair without history."""
    built.reset()
    return built


class Way:
    """Closed form along a direction; x: length of the way [m]."""

    def __init__(self, name):
        self.along = np.array(WAYS[name]) / np.linalg.norm(WAYS[name])
        stiffness = np.array([K_N, K_S, K_S])
        self.pull = stiffness * self.along
        self.stiffness = self.pull @ self.along
        mixity = K_S * (self.along[1:] @ self.along[1:]) / self.stiffness
        share = mixity**EXPONENT
        self.energy = G_I + (G_II - G_I) * share
        begin = FIRST[0] + (FIRST[1] - FIRST[0]) * share
        self.onset = np.sqrt(begin / self.stiffness)
        self.end = 2.0 * self.energy / (self.stiffness * self.onset)

    def secant(self, x):
        """Share of the first stiffness that is left once the way has reached x."""
        beyond = np.maximum(x, self.onset)
        return self.onset * (self.end - beyond) / (beyond * (self.end - self.onset))

    def traction(self, x):
        return self.secant(x)[..., None] * x[..., None] * self.pull


@pytest.mark.parametrize("name", WAYS)
def test_the_way_to_failure_is_the_triangle_of_its_mode(pair, name):
    """Its area, by the trapezoidal rule on its own corners, is G of the mode; it is spent."""
    way = Way(name)
    assert way.end > 2.0 * way.onset
    x = np.append(np.linspace(0, way.onset, 20), np.linspace(way.onset, way.end, 30)[1:-1])
    found = np.array([pair.open(each * way.along) for each in x])
    assert np.abs(found - way.traction(x)).max() < 2.0 * ERROR
    assert not pair.broken
    share = (x[-1] - way.onset) / (way.end - way.onset)
    assert np.abs(pair.spent() - share * way.energy).max() < 2.0 * ERROR * way.end
    pair.open((way.end + 4.0 * OPENING_ERROR) * way.along)
    assert pair.broken
    force = np.append(found @ way.along, 0.0)
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(np.append(x, way.end)))
    assert work == pytest.approx(way.energy, abs=2.0 * ERROR * way.end)


def test_damage_never_heals_in_whatever_direction_the_unit_is_moved(pair):
    """After 45 degrees half way down, opening alone meets the same share of its stiffness."""
    way = Way("45")
    reached = 0.5 * (way.onset + way.end)
    left = way.secant(np.array(reached))
    pair.open(reached * way.along)
    for jump in ([3e-6, 0, 0], [0, 2e-6, -1e-6], 0.5 * reached * way.along):
        expected = left * np.array([K_N, K_S, K_S]) * jump
        assert np.abs(pair.open(jump) - expected).max() < 2.0 * ERROR
    assert pair.open([-5e-6, 0, 0])[0] == pytest.approx(-K_N * 5e-6, abs=ERROR)
