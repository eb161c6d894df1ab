"""What experiments read from runs and answers, on made-up ones whose result is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from blast_scaling import even_cuts, share_costs
from ca_damper.theory.bouncing import Fall, RecordedFall
from cases.meshes import group_area, mirrored_copies
from cases.trust.blast import laws
from price_of_accuracy import Price, cheapest
from taichi_dem import CONCRETE, PAPER_BLOCK, read_mesh
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.topology import topology_of
from taichi_dem.output.hole_monitor import Attenuation, attenuation_of
from taichi_dem.state.model import Model


def point(step, error):
    """A run that takes 1 / step seconds."""
    return Price("", f"{step:g} s", "", 1.0 / step, error, True)


# A first-order method with an error of 8 % at a step of one, and one that diverges above a step
# of 0.5 and is all but exact below.
SLOW = [point(step, 0.08 * step) for step in (1.0, 0.1, 0.01)]
SHARP = [point(1.0, np.nan), point(0.5, 0.02), point(0.25, 1e-5)]


def test_the_cheapest_of_what_is_accurate_enough_is_the_answer():
    assert cheapest(SHARP, 0.01).seconds == 4.0 and cheapest(SHARP, 0.1).seconds == 2.0
    assert cheapest(SLOW, 0.01).seconds == 10.0 and cheapest(SLOW, 0.1).seconds == 1.0
    assert cheapest(SHARP, 1e-9) is None


def test_luck_is_no_answer():
    """A lucky coarse step, and coarse steps above one that fails."""
    assert cheapest([point(2.0, 1e-6), *SLOW], 0.001).seconds == 100.0
    assert cheapest([*SLOW, point(0.001, np.nan)], 0.1) is None


def test_mirrored_copies_are_one_block():
    """All bonds of each copy and one for every face of a seam; nothing stands alone between."""
    flat = read_mesh(PAPER_BLOCK)
    deep = mirrored_copies(flat, 3)
    bonds = [topology_of(mesh).bond_count for mesh in (flat, deep)]
    assert bonds[1] == 3 * bonds[0] + len(flat.groups["front"]) + len(flat.groups["back"])
    # Points are rounded to 1e-12 m: an area of 2 m by 3 m then moves by some 1e-11 m2.
    assert volumes(deep).sum() == pytest.approx(3 * volumes(flat).sum(), abs=1e-10)
    assert group_area(deep, "hole") == pytest.approx(3 * group_area(flat, "hole"), abs=1e-10)


def test_peaks_fall_by_the_power_of_the_distance_from_the_axis_of_the_hole():
    """Speeds of 3 r^-1.5, those of outer bodies ten times as large: least squares to round-off.

    The paper's hole lies at (1.6, 1.0) in a block of 2 m by 2 m by 0.2 m.
    """
    model = Model(read_mesh(PAPER_BLOCK), CONCRETE, [])
    x, y, z = model.centre.T
    away = np.hypot(x - 1.6, y - 1.0)
    inner = away < np.min([x, 2.0 - x, y, 2.0 - y, z, 0.2 - z], axis=0)
    made = attenuation_of(model, np.ones(model.body_count), "hole", 0.025)
    assert made.distance == pytest.approx(away / 0.025, rel=1e-9)
    assert np.array_equal(made.inner, inner)
    distance = np.linspace(2.0, 60.0, 200)
    speed = 3.0 * distance**-1.5 * np.where(distance < 32.0, 1.0, 10.0)
    law = Attenuation(distance, speed, distance < 32.0).power_law(4.0)
    assert law == pytest.approx((-1.5, 3.0), rel=1e-10)


def test_laws_of_sizes_are_found_in_curves_that_follow_them():
    x = np.geomspace(0.01, 2.0, 48)
    rosin = np.append(-np.expm1(-((x[:-1] / 0.7) ** 1.5)), 1.0)
    swebrec = 1.0 / (1.0 + (np.log(x[-1] / x) / np.log(2.0 / 0.4)) ** 2.5)
    assert laws(x, rosin, 0.1)[0][0] == pytest.approx(1.5, rel=1e-9)
    assert laws(x, swebrec, 0.1)[1][0] == pytest.approx(2.5, rel=1e-9)


def test_impacts_are_found_between_samples():
    """Two parabolas cross where they do; the highest sample misses by g (half a sample)^2 / 2."""
    fall = Fall(height=0.09, restitution=0.75, gravity=10.0)
    time = np.arange(0.0, 0.7, 1.7e-3)
    starts = np.array([-fall.first_s, *(fall.impact_s(k) for k in range(1, 8))])
    flight = np.searchsorted(starts, time, side="right") - 1
    speed = 10.0 * (fall.first_s * 0.75**flight - (time - starts[flight]))
    mass, height = 2e-4, fall.heights(time)
    energy = mass * (0.5 * speed**2 + 10.0 * height)
    history = {"time_s": time, "force": 0.0 * time, "momentum": mass * speed, "energy": energy}
    late, high = RecordedFall.of(history, fall, mass).errors(4)
    assert np.abs(late).max() < 1e-12
    assert np.abs(high).max() <= 0.5 * 10.0 * (0.5 * 1.7e-3) ** 2


# Whole numbers: their sums have no rounding, so bounds hold to the last bit.
COSTS = arrays(float, st.integers(1, 60), elements=st.integers(0, 1000).map(float))


@given(COSTS, st.integers(1, 70))
def test_shares_hold_everything_once_and_no_more_than_the_mean_and_one_item(cost, workers):
    """A cut lies less than an item before its place on the curve, the next at most on its own.

    Rounding: the places on the curve are products and quotients of the total, exact to 2 eps.
    """
    cuts = even_cuts(cost, workers)
    assert len(cuts) == workers + 1 and cuts[0] == 0 and cuts[-1] == len(cost)
    assert (np.diff(cuts) >= 0).all()
    slack = 4.0 * np.finfo(float).eps * cost.sum()
    assert share_costs(cost, cuts).max() <= cost.sum() / workers + cost.max() + slack


def test_the_papers_static_shares():
    """Element i meets at most n - i others: with n = 5, half of 4 + 3 + 2 + 1 + 0 is 5."""
    cost = np.arange(4, -1, -1)
    cuts = even_cuts(cost, 2)
    assert cuts.tolist() == [0, 1, 5] and share_costs(cost, cuts).tolist() == [4.0, 6.0]
