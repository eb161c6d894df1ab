"""What experiments read from runs and answers, on made-up ones whose result is known."""

import numpy as np
import pytest

from _meshes import group_area, mirrored_copies
from _trust.blast import laws
from _trust.cracks import forked, speed
from blast_ensemble import moved, over_time, stronger
from ca_damper.demo_pictures import Decay
from ca_damper.report.measures import first_harmonic
from ca_damper.theory.bouncing import Fall, RecordedFall
from cost_of_accuracy_blast import (
    SPLIT,
    displacement_error,
    energy_error,
    faces_error,
    outcome_of,
    points_of,
)
from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, Uniform, read_mesh
from taichi_dem.kit.study import Timing
from taichi_dem.kit.study.work_precision import Point, answers, cheapest
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of
from taichi_dem.output.hole_monitor import Attenuation, attenuation_of
from taichi_dem.state.model import Model
from tests.hard_cases.blast_piles import CARD, SPAN, TALL, house, least_friction

EDGE, BAR = 2e-3, bar(0.2, 0.1, (2, 1, 1))


def outcome(moved=((3.0, 0.0, 0.0), (0.0, 4.0, 0.0)), broken=(1, 2), failure="", **energy):
    terms = {**dict.fromkeys(SPLIT, 0.0), "load_work": 10.0, **energy}
    figures = {"evaluations": 1, "cpu_s": 1.0, "reached_s": 1.0, "residual": 0.0}
    return {"moved": moved, "broken": broken, "energy": terms, "failure": failure, **figures}


def test_errors_of_a_blast_are_those_of_its_displacement_faces_and_energy():
    """Difference (0, 0, 1) of one body over sqrt(9 + 16); 1 J of 10 J is booked elsewhere."""
    run = outcome(moved=((3.0, 0.0, 1.0), (0.0, 4.0, 0.0)))
    assert displacement_error(run, outcome()) == pytest.approx(0.2, rel=1e-15)
    # A face too many and one too few do not cancel.
    assert faces_error(outcome(broken=(1, 3)), outcome()) == 1.0
    run = outcome(kinetic=3.0, bond_strain=1.0)
    assert energy_error(run, outcome(kinetic=2.0, bond_strain=2.0)) == pytest.approx(0.1)


def test_a_diverged_run_stands_where_it_would_have_taken_its_work():
    runs = {2.0: outcome(failure="diverged"), 1.0: outcome()}
    failed, fine = points_of("implicit", runs, {}, outcome())
    assert failed.failure and failed.evaluations == 0.5 and fine.error == 0.0


def test_a_disturbed_twin_moves_as_the_scene_does():
    rows = np.random.default_rng(3).uniform(-1.0, 1.0, (2, BAR.body_count, 3))
    job = Scene(BAR, CONCRETE, [], velocity=rows[0], spin=rows[1]), Uniform(1e-7), 2e-6
    alone, disturbed = (outcome_of(*job, size)["moved"] for size in (0.0, 1e-12))
    np.testing.assert_allclose(disturbed, alone, rtol=1e-4, atol=1e-11)


def point(method, step, error, failure=""):
    """A run that takes 1 / step seconds."""
    timing = None if failure else Timing.of([1.0 / step])
    return Point(method, step, f"{step:g} s", 100.0 / step, error, timing, failure=failure)


# A first-order method with an error of 8 % at a step of one, and one that diverges above a step
# of 0.5 and is all but exact below.
ROWS = [
    *(point("slow", step, 0.08 * step) for step in (1.0, 0.1, 0.01)),
    *(point("sharp", 1.0, np.nan, "diverged"), point("sharp", 0.5, 0.02)),
    point("sharp", 0.25, 1e-5),
]


def steps(rows, tolerance, floors=None):
    """Step of each method that is accurate enough, None without one."""
    found = answers(rows, tolerance, floors or {})
    return {one.method: one.point and one.point.step for one in found}


def test_the_cheapest_of_what_is_accurate_enough_is_the_answer():
    assert cheapest(ROWS, 0.01, {}) == (4.0, "sharp")
    assert cheapest(ROWS, 1e-9, {}) == (None, None)
    assert steps(ROWS, 0.01) == {"sharp": 0.25, "slow": 0.1}
    assert steps(ROWS, 0.1) == {"slow": 1.0, "sharp": 0.5}


def test_luck_and_noise_are_no_answers():
    """A lucky coarse step, a coarse step above one that fails, an error below the floor."""
    assert steps([*ROWS, point("slow", 2.0, 1e-6)], 0.001)["slow"] == 0.01
    assert steps([*ROWS, point("slow", 0.001, np.nan, "diverged")], 0.1)["slow"] is None
    assert steps(ROWS, 0.001, {"sharp": 0.005})["sharp"] is None


def test_a_perturbed_block_keeps_its_flat_sides_and_moves_by_shares_of_an_edge():
    """0.1 m; the deviation of n normal numbers is known to 1 / sqrt(2 n)."""
    mesh, draw = bar(1.0, 0.4, (10, 4, 4)), np.random.default_rng(1)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    shifts = np.array([moved(mesh, 1e-3, draw).points - mesh.points for _ in range(50)])
    inner = ((mesh.points > low) & (mesh.points < high)).all(axis=1)
    sides = (mesh.points == low) | (mesh.points == high)
    assert not shifts[:, sides].any()
    found = shifts[:, inner]
    assert found.std() == pytest.approx(0.1 * 1e-3, rel=4.0 / np.sqrt(2.0 * found.size))
    strong = stronger(CONCRETE, 1.1)
    assert strong.tensile_strength == 1.1 * CONCRETE.tensile_strength
    assert strong.failure_opening == pytest.approx(CONCRETE.failure_opening, rel=1e-14)


def test_mean_and_spread_of_the_hole():
    columns = over_time(np.array([[0.0] * 3, [1.0, 2.0, 3.0]]), until=8e-5, samples=1)
    assert columns["mean_mm"].tolist() == [0.0, 2.0] and columns["sd_mm"].tolist() == [0.0, 1.0]


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


def branches(angle, speed):
    """Faces of a crack that runs along x and divides at 70 mm into two at an angle to it."""
    x = np.arange(0.05, 0.1, 0.5 * EDGE)
    away = np.maximum(0.0, x - 0.07) * np.tan(angle)
    place = np.concatenate([np.column_stack([x, away]), np.column_stack([x, -away])])
    when = np.tile((x - x[0]) / speed, 2)
    order = np.argsort(when, kind="stable")
    return place[order], when[order]


def test_a_crack_has_branched_once_its_branches_are_apart():
    """2 a tan(angle) > 3 edges, within the slice of two edges in which that becomes so."""
    true = (0.02 + 1.5 * EDGE / np.tan(0.5)) / 1000.0
    found = forked(*branches(0.5, 1000.0), EDGE)
    assert abs(found - true) <= 2.5 * EDGE / 1000.0
    assert np.isnan(forked(*branches(0.0, 1000.0), EDGE))


def test_the_speed_of_a_tip_is_right_to_a_face_in_its_window():
    place, when = branches(0.5, 500.0)
    found = speed(place[:, 0], when, 10.0 * EDGE / 500.0)
    assert found == pytest.approx(500.0, rel=0.05 + 1e-9)


def test_laws_of_sizes_are_found_in_curves_that_follow_them():
    x = np.geomspace(0.01, 2.0, 48)
    rosin = np.append(-np.expm1(-((x[:-1] / 0.7) ** 1.5)), 1.0)
    swebrec = 1.0 / (1.0 + (np.log(x[-1] / x) / np.log(2.0 / 0.4)) ** 2.5)
    assert laws(x, rosin, 0.1)[0][0] == pytest.approx(1.5, rel=1e-9)
    assert laws(x, swebrec, 0.1)[1][0] == pytest.approx(2.5, rel=1e-9)


def test_the_least_friction_of_a_house_of_cards_is_that_of_moments():
    """Weight of a card about the inner edge of its foot against the push at its top."""
    x, y = CARD.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    middle = ((y + np.roll(y, -1)) * cross).sum() / (3.0 * cross.sum())
    assert least_friction(house()) == pytest.approx((SPAN - middle) / TALL, abs=2e-4)


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


def test_harmonic_gives_amplitude_and_lag():
    phase = np.arange(32) * 52 / 1667
    values = 3.0 + 2.0 * np.sin(2.0 * np.pi * phase - np.radians(47.0))
    assert first_harmonic(phase, values) == pytest.approx((2.0, 47.0), rel=1e-12)


def test_cycles_of_a_decay_are_whole_and_none_where_it_stays_above():
    """Medians over three starts of two numbers of particles; 10 mm is the level."""
    ends = [[12e-3] * k + [9e-3] * (6 - k) for k in (2, 3, 5, 6, 6, 1)]
    decay = Decay([10, 30], np.array(ends), np.zeros((6, 9)))
    assert decay.cycles(10) == 3 and decay.cycles(30) is None
