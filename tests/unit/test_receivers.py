"""Receivers: motion of points of the solid over time."""

import csv

import numpy as np
import pytest

from taichi_dem import CONCRETE, Every, Receivers, Scene, Uniform, simulate
from taichi_dem.mesh.locate import body_at
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import assert_refused

BAR = bar(0.2, 0.1, (2, 1, 1))
POINTS = {"corner": (0.2, 0.1, 0.1), "inside": (0.05, 0.03, 0.06)}
V, W, STEP = np.array([0.5, -0.2, 0.1]), np.array([0.0, 0.0, 400.0]), 1e-7


def run(*receivers, until=2e-5, samples=4):
    """A bar that flies and turns as one rigid body; its bonds hardly stretch."""
    scene = Scene(BAR, CONCRETE, [], velocity=V, spin=W)
    options = {"method": Uniform(STEP), "progress": None, "samples": samples}
    return simulate(scene, until=until, observers=list(receivers), **options)


@pytest.fixture(scope="module")
def result(taichi_session):
    often = Receivers({"often": (0.1, 0.05, 0.05)}, when=Every(steps=10))
    return run(Receivers(POINTS), often)


def test_points_of_a_turning_bar_move_on_their_circles(result):
    """x = m + R(wt)(X - m) + V t. Bonds that carry the turn stretch by (w L)^2 rho / k of length.

    That is 400^2 0.1^2 2390 / 450e9 = 8e-6 m of 45e9 Pa/m; of a way of 8e-4 m it is below 2 %.
    """
    middle = np.array([0.1, 0.05, 0.05])
    for name, at in POINTS.items():
        got, arm = result.receivers[name], np.array(at) - middle
        assert got.time_s.tobytes() == result.history["time_s"].tobytes()
        cos, sin = np.cos(W[2] * got.time_s), np.sin(W[2] * got.time_s)
        x, y = cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]
        turned = np.stack([x, y, np.full_like(x, arm[2])], axis=1)
        np.testing.assert_allclose(
            got.displacement, turned - arm + V * got.time_s[:, None], atol=8e-6
        )
        assert not got.displacement[0].any()
        np.testing.assert_allclose(got.velocity[0], V + np.cross(W, arm), rtol=1e-12)


def test_receivers_have_times_of_their_own_and_one_table(result, tmp_path):
    assert len(result.receivers["often"].time_s) == 21
    result.write(tmp_path)
    with open(tmp_path / "receivers.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 5 + 21
    last = [row for row in rows if row["receiver"] == "inside"][-1]
    inside = result.receivers["inside"]
    assert float(last["time_s"]) == inside.time_s[-1]
    assert [float(last[f"v{a}_m_s"]) for a in "xyz"] == inside.velocity[-1].tolist()
    assert [float(last[f"u{a}_m"]) for a in "xyz"] == inside.displacement[-1].tolist()
    simulate(Scene(BAR, CONCRETE, []), method=Uniform(STEP), until=STEP, output=tmp_path)
    assert not (tmp_path / "receivers.csv").exists()


def test_a_second_run_begins_anew():
    receivers = Receivers(POINTS)
    for _ in range(2):
        made = run(receivers, until=2 * STEP, samples=2)
        assert len(receivers["inside"].time_s) == len(made.receivers["inside"].time_s) == 3


@pytest.mark.parametrize("seed", range(3))
def test_a_point_belongs_to_the_body_it_was_drawn_from(seed):
    draw = np.random.default_rng(seed)
    mesh = bar(0.3, 0.1, (3, 2, 2))
    for body in draw.integers(mesh.body_count, size=10):
        shares = draw.dirichlet(np.ones(4))
        point = (shares[:, None] * mesh.points[mesh.tetrahedra[body]]).sum(axis=0)
        assert body_at(mesh, "drawn", point) == body


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0.1, 0.15, 0.05), 0.05), ((0.24, 0.13, 0.05), 0.05), ((0.3, 0.2, 0.2), np.sqrt(0.03))],
    ids=("face", "edge", "corner"),
)
def test_a_point_in_no_body_is_refused_with_its_distance(point, distance):
    assert_refused(
        lambda: run(Receivers({"far": point})),
        "receiver far must lie in a body",
        f"which is {distance:.3g} m from the nearest, body ",
    )


REFUSED = {
    "list": (lambda: Receivers([(0, 0, 0)]), "points must be a dict of name", "[(0, 0, 0)]"),
    "none": (lambda: Receivers({}), "points must be a dict of name", "{}"),
    "place": (lambda: Receivers({"a": (1, 2)}), "receiver a must be three", "(1, 2)"),
    "name": (lambda: Receivers({3: (1, 2, 3)}), "name of a receiver must be text", "3"),
    "when": (lambda: Receivers(POINTS, when=3), "when must be an Every or At", "3"),
    "twice": (lambda: run(Receivers(POINTS), Receivers(POINTS)), "different names, got corner"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_receivers_that_are_none_are_refused(case):
    call, *words = REFUSED[case]
    assert_refused(call, *words)
