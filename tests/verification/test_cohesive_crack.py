"""A bonded pair with the cohesive law of cracks, against its closed form.

A traction K jump of an undamaged unit has the size t and the direction r = t_n / t, w = 1 - r^2.
By docs/decisions/034 damage begins at t and spends an energy per area of

    t^2 = (f_t r)^2 + (c w^4)^2,    G (r + w^12 (k_n / k_s) (c / f_t)^2),

falls from the strength along two lines, and pressed units do so beyond Coulomb's friction.
Errors of an opening, and of a traction, are those of ``test_bond_law``.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from taichi_dem import CONCRETE, effects
from taichi_dem.mesh.shapes import pair as pair_mesh
from taichi_dem.report.resolution import MOST_OPENING, StepResolution
from tests.probe import STEP, BondProbe
from tests.verification.test_bond_law import EDGE, EPS, K_N, K_S, OPENING_ERROR, unit_openings

STRENGTH, FRICTION = CONCRETE.tensile_strength, CONCRETE.friction
COHESION, G = 3.0 * STRENGTH, 10.0 * CONCRETE.fracture_energy
ROCK = replace(CONCRETE, cohesion=COHESION, fracture_energy=G)
G_SLID = G * K_N / K_S * (COHESION / STRENGTH) ** 2
STIFFNESS = np.array([K_N, K_S, K_S])
#: Of a traction: an error of an opening, at the first stiffness.
ERROR = (K_N + FRICTION * K_N) * OPENING_ERROR
ANGLES = [0, 15, 30, 45, 70, 90]
#: Petersson: where two lines meet, and where they end, of the way to the end of one line.
KINK, END = 0.4, 1.8


@pytest.fixture(scope="module")
def built():
    return BondProbe(pair_mesh(EDGE), [effects.CohesiveCrack()], ROCK)


@pytest.fixture
def pair(built):
    """The pair without history."""
    built.reset()
    return built


class Way:
    """Closed form of jumps in proportion; x: over the onset."""

    def __init__(self, angle):
        turn = np.radians(angle)
        r, w = np.cos(turn), np.sin(turn) ** 2
        self.strength = np.hypot(STRENGTH * r, COHESION * w**4)
        self.energy = G * (r + w**12 * K_N / K_S * (COHESION / STRENGTH) ** 2)
        self.pull = self.strength * np.array([r, 0.6 * np.sin(turn), 0.8 * np.sin(turn)])
        self.onset = self.pull / STIFFNESS
        # Of one line: the area of a triangle of this height.
        self.steep = 2.0 * self.energy / (self.pull @ self.onset) - 1.0
        self.corners = 1.0 + self.steep * np.array([0.0, KINK, END])

    def traction(self, x):
        """Traction [Pa] by its corners, (n, 3)."""
        share = np.interp(x, [0.0, *self.corners], [0.0, 1.0, 1.0 / 3.0, 0.0])
        return np.outer(share, self.pull)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_way_to_failure_has_the_strength_and_energy_of_its_direction(pair, angle):
    """The area below the traction, by the trapezoidal rule on its corners, is that energy."""
    way = Way(angle)
    assert way.steep > 1.0
    first, kink, end = way.corners
    parts = (0.0, first), (first, kink), (kink, end)
    x = np.unique(np.concatenate([np.linspace(*part, 12) for part in parts]))
    found = np.array([pair.open(each * way.onset) for each in x])
    assert np.abs(found - way.traction(x)).max() < 4.0 * ERROR
    pair.open((1.0 + 1e-9) * end * way.onset)
    # At 90 degrees a rounding tells whether the unit is pressed.
    assert pair.broken or angle == 90
    work = np.sum(0.5 * (found[1:] + found[:-1]) @ way.onset * np.diff(x))
    size = 4.0 * ERROR * end * np.abs(way.onset).max()
    assert work == pytest.approx(way.energy, abs=2.0 * size)
    assert pair.spent() == pytest.approx(3 * [way.energy], abs=2.0 * size)


@pytest.mark.parametrize("angle", [0, 15, 30, 45])
def test_a_stress_opens_its_plane_at_the_strength_and_for_the_energy_of_its_area(angle):
    """A face at an angle q to it carries cos q of the stress, over 1 / cos q of the area."""
    way, r = Way(angle), np.cos(np.radians(angle))
    w = 1.0 - r**2
    assert way.strength / r == pytest.approx(STRENGTH, rel=0.5 * (3.0 * w**4 / r) ** 2 + EPS)
    assert way.strength / r < 1.04 * STRENGTH
    assert way.energy / (r * G) == pytest.approx(1.0, abs=45.0 * w**12 / r + EPS)
    assert way.energy < 1.02 * r * G


def slid(pair, pressure, way):
    """Shear tractions [Pa] along a way of slidings [m] under a pressure [Pa]."""
    along = np.array([0.6, 0.8])
    found = [pair.open([-pressure / K_N, *(each * along)])[1:] for each in way]
    return np.array(found) @ along


def test_a_pressed_unit_slides_beyond_cohesion_and_friction_and_goes_on_rubbing(pair):
    """c + mu p, down to mu p while the energy of pure sliding and the friction are spent."""
    pressure = 2.0 * STRENGTH
    rubs = FRICTION * pressure
    onset = COHESION / K_S
    corners = onset + (2.0 * G_SLID / COHESION - onset) * np.array([0.0, KINK, END])
    known = [0.0, *(corners + rubs / K_S), 2.0 * corners[-1]]
    tractions = [0.0, COHESION + rubs, COHESION / 3.0 + rubs, rubs, rubs]
    way = np.unique(np.concatenate([np.linspace(*ends, 12) for ends in pairwise(known)]))
    found = slid(pair, pressure, way)
    assert np.abs(found - np.interp(way, known, tractions)).max() < 4.0 * ERROR
    assert pair.spent() == pytest.approx(3 * [G_SLID], rel=1e-9)
    assert not pair.broken
    # Backwards it rubs as well, and it parts without a force once nothing presses it.
    back = way[-1] - np.array([1.0, 2.0, 3.0]) * rubs / K_S
    assert slid(pair, pressure, back) == pytest.approx([0.0, -rubs, -rubs], abs=8.0 * ERROR)
    assert np.array_equal(pair.open([1e-9, 0.0, 0.0]), np.zeros(3))
    assert pair.broken


def test_unloading_goes_to_the_origin_and_pressure_meets_the_whole_stiffness(pair):
    """On the secant, in whatever direction; a pressed unit rubs with its damaged share."""
    way = Way(30)
    reached = 0.5 * way.corners[:2].sum()
    left = way.traction(reached)[0, 0] / (reached * way.pull[0])
    pair.open(reached * way.onset)
    for jump in (0.5 * reached * way.onset, [3e-6, 0, 0], [1e-9, 2e-6, -1e-6], [0.0, 0.0, 0.0]):
        expected = left * STIFFNESS * jump
        assert np.abs(pair.open(jump) - expected).max() < 2.0 * ERROR
    # Also where it was not evaluated since: what a report asks for between two steps.
    jump = np.array([2e-6, 1e-6, -3e-6])
    pair.place(pair.centre + np.outer([0.0, 1.0], pair.frame.T @ jump))
    held = 0.5 * left * (STIFFNESS * jump) @ jump
    assert pair.stored() == pytest.approx(pair.area * held, rel=1e-9)
    far = np.array([-1e-6, 0.0, 20e-6])
    assert FRICTION * K_N * 1e-6 < K_S * far[2]
    rubbed = left * K_S * far[2] + (1.0 - left) * FRICTION * K_N * 1e-6
    assert pair.open(far) == pytest.approx([-K_N * 1e-6, 0.0, rubbed], abs=2.0 * ERROR)
    expected = way.traction(reached + 0.1)[0]
    assert pair.open((reached + 0.1) * way.onset) == pytest.approx(expected, abs=4.0 * ERROR)


def test_the_plane_of_a_crack_does_not_turn_while_it_opens(pair):
    """Begun at 30 degrees and opened along the normal, it spends what it would at 30 degrees."""
    way = Way(30)
    begun = (1.0 + 1e-6) * way.onset
    pair.open(begun)
    for x in np.linspace(1.0, 2.0 * way.corners[-1], 50):
        pair.open([x * way.onset[0], *begun[1:]])
    assert pair.spent() == pytest.approx(3 * [way.energy], rel=1e-9)


def test_a_unit_that_a_tension_has_touched_keeps_its_cohesion(pair):
    """Damage of a millionth, then sliding to 0.9 of its limit, pressed and all but pressed."""
    pair.open([(1.0 + 1e-6) * STRENGTH / K_N, 0.0, 0.0])
    sliding = 0.9 * COHESION / K_S
    for normal in (-1e-7, 1e-9):
        spent = pair.spent()
        assert pair.open([normal, sliding, 0.0])[1] == pytest.approx(K_S * sliding, rel=1e-5)
        assert np.array_equal(pair.spent(), spent)


def test_a_unit_that_sliding_has_touched_opens_at_its_strength(pair):
    """Damage of a millionth under pressure leaves the way of opening as it is."""
    way, x = Way(0), 1.5
    pair.open([0.0, (1.0 + 1e-6) * COHESION / K_S, 0.0])
    assert 0.0 < pair.spent().max() < 1e-5 * G_SLID
    assert pair.open(x * way.onset)[0] == pytest.approx(way.traction(x)[0, 0], rel=1e-5)


def test_work_on_a_pressed_unit_is_what_it_holds_and_what_was_spent(pair):
    """To rounding at any step: the way is taken at the mean of the tractions at its ends."""
    draw = np.random.default_rng(3)
    sliding = np.cumsum(draw.normal(scale=2.0 * COHESION / K_S, size=(60, 2)), axis=0)
    pressure = draw.uniform(0.0, 2.0 * STRENGTH, 60)
    jumps = np.column_stack([-pressure / K_N, sliding])
    work, last, pulled = 0.0, np.zeros(3), np.zeros(3)
    for jump in jumps:
        pull = pair.open(jump, velocity=(jump - last) / STEP)
        work += pair.area * (0.5 * (pull + pulled) @ (jump - last))
        last, pulled = jump, pull
    damage = pair.spent().mean()
    assert 0.2 * G_SLID < damage
    taken = pair.stored() + pair.heat[1] + pair.area * damage
    size = pair.area * 60 * 4.0 * ERROR * np.abs(jumps).max()
    assert taken == pytest.approx(work, abs=size)


@pytest.mark.parametrize("failed", [1, 2])
def test_a_face_is_released_once_two_of_its_units_have_failed(pair, failed):
    """Tilted so that one or two units are opened past the end of their softening."""
    end = Way(0).corners[-1] * STRENGTH / K_N
    opening, position, orientation = unit_openings(pair, 2e-3, end)
    rest = np.sort(end - opening)[failed - 1 : failed + 1].mean()
    opening, position, orientation = unit_openings(pair, 2e-3, end + rest)
    assert (opening > end).sum() == failed
    pair.move(position, orientation)
    assert pair.broken == (failed == 2)


def test_a_unit_spends_at_least_what_it_holds_at_its_onset():
    """Where the energy of its direction is less, it fails at once."""
    brittle = BondProbe(
        pair_mesh(EDGE), [effects.CohesiveCrack()], replace(ROCK, fracture_energy=60.0)
    )
    way = Way(45)
    least = 0.5 * way.pull @ way.onset
    assert 60.0 * way.energy / G < least
    brittle.open((1.0 + 1e-4) * way.onset)
    assert brittle.broken
    assert brittle.spent() == pytest.approx(3 * [least], rel=1e-5)


@pytest.mark.parametrize("late", [1.2, 1.3])
def test_a_bond_that_fails_beyond_a_quarter_more_than_its_last_opening_is_told(pair, late):
    """In one step from a tenth before that opening, as a step that is too long makes it."""
    way = Way(0)
    last = way.corners[-1] * way.onset
    pair.open(0.9 * last)
    pair.open(late * last)
    assert pair.broken
    assert pair.simulation.readings.reach() == pytest.approx([late], rel=1e-9)
    told = StepResolution(pair.simulation.parts).findings()
    assert len(told) == (late > MOST_OPENING)
