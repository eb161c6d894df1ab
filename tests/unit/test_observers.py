"""An observer, a receiver and a callback see the run as its result tells it and change no bit."""

import numpy as np
import pytest

from _blast import run_costs
from taichi_dem import (
    CONCRETE,
    Checkpoint,
    Collector,
    Every,
    Receivers,
    Scene,
    Uniform,
    simulate,
)
from taichi_dem.mesh.shapes import bar

BAR = bar(0.2, 0.1, (2, 1, 1))
V, W, STEP = np.array([0.5, -0.2, 0.1]), np.array([0.0, 0.0, 400.0]), 1e-7
POINTS = {"corner": (0.2, 0.1, 0.1), "inside": (0.05, 0.03, 0.06)}


def run(*observers, steps=200, **options):
    """A bar that flies and turns as one rigid body; its bonds hardly stretch."""
    scene = Scene(BAR, CONCRETE, [], velocity=V, spin=W)
    options = {"method": Uniform(STEP), "until": steps * STEP, "samples": 4, **options}
    return simulate(scene, progress=None, observers=list(observers), **options)


def test_an_observer_sees_the_run_as_its_result_tells_it_and_changes_no_bit():
    alone = run(frames=4)
    seen = Collector(
        Every(steps=50),
        kinetic=lambda view: view.energy_balance()["kinetic"],
        rows=lambda view: len(view.history()["time_s"]),
        place=lambda view: view.motion()["position"],
    )
    costs = run_costs()
    watched = run(seen, costs, frames=4)
    assert seen["kinetic"].tolist() == alone.series["kinetic_J"].tolist()
    assert seen["rows"].tolist() == [1, 2, 3, 4, 5]
    assert seen["place"][-1].tobytes() == alone.frames[-1].position.tobytes()
    for name, column in alone.series.items():
        assert column.tobytes() == watched.series[name].tobytes(), name
    assert costs["evaluations"][-1] == alone.report.contact_evaluations


def test_a_resumed_run_calls_for_what_is_left(tmp_path):
    path = tmp_path / "run.checkpoint"
    run(steps=10, checkpoint=Checkpoint(path))
    left = Collector(Every(steps=5), step=lambda view: view.step)
    run(left, steps=20, resume=path)
    assert left["step"].tolist() == [15, 20]


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
        assert got.time_s.tobytes() == result.series["time_s"].tobytes()
        cos, sin = np.cos(W[2] * got.time_s), np.sin(W[2] * got.time_s)
        x, y = cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]
        turned = np.stack([x, y, np.full_like(x, arm[2])], axis=1)
        np.testing.assert_allclose(
            got.displacement, turned - arm + V * got.time_s[:, None], atol=8e-6
        )
        assert not got.displacement[0].any()
        np.testing.assert_allclose(got.velocity[0], V + np.cross(W, arm), rtol=1e-12)
