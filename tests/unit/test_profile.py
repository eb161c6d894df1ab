"""Motion along bars over time: means of slices, joints, stress, and times of travel."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Collector, Every, Scene, Uniform, effects, simulate
from taichi_dem.kit.plot_style import styled
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.profile import Profile, travel_time
from taichi_dem.plot.bars import draw_breaks, draw_space_time, film_bar, picture_wave
from taichi_dem.plot.film_runs import FilmedRun, film_runs
from taichi_dem.simulate import result_of


def pulled(*observers, dt=1e-7):
    """Three cells of six bodies, pulled at the right end until they break."""
    drive = effects.PrescribedMotion("right", (10.0, 0.0, 0.0))
    listed = [effects.Softening(), effects.Fixed("left"), drive]
    scene = Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, listed)
    looks = {"samples": 1, "frames": 6, "progress": None, "observers": list(observers)}
    return result_of(simulate, scene, method=Uniform(dt), until=600 * dt, **looks)


@pytest.fixture(scope="module")
def seen(taichi_session):
    profile = Profile(Every(steps=100), np.arange(18).reshape(1, 3, 6))
    kept = Collector(profile.when, time=lambda view: view.time_s, motion=lambda view: view.motion())
    return profile, kept, pulled(profile, kept)


def test_a_slice_has_the_mean_motion_of_its_bodies(seen):
    profile, kept, result = seen
    assert profile.velocity.shape == profile.displacement.shape == (7, 1, 3)
    assert profile.time.tolist() == kept["time"].tolist() and kept["time"][-1] > 0.0
    for row, motion in enumerate(kept.rows["motion"]):
        moved = (motion["position"] - result.model.centre)[:, 0].reshape(3, 6)
        assert profile.displacement[row, 0] == pytest.approx(moved.mean(axis=1), rel=1e-12)


def test_a_joint_is_broken_once_all_of_its_bonds_are(seen):
    profile, _, result = seen
    assert not profile.joints[0].any() and result.report.broken_faces > 0
    topology = result.model.topology
    for k in range(2):
        ends = np.sort([topology.master // 6, topology.slave // 6], axis=0)
        bonds = (ends[0] == k) & (ends[1] == k + 1)
        gone = np.isfinite(result.broken_time[bonds]).all()
        assert profile.joints[-1, 0, k] == gone


def test_stress_is_that_of_the_strain_and_none_where_it_broke():
    profile = Profile(Every(steps=1), np.zeros((3, 1), dtype=int))
    profile._rows = [(0.0, np.array([0.0, 1e-3, 4e-3]), None, np.array([False, True]))]
    assert profile.stress(2e9, 0.1).tolist() == [[2e7, 0.0]]


def test_a_delayed_pulse_is_found_to_its_resolution():
    time = np.linspace(0.0, 1.0, 201)
    pulse = [np.exp(-(((time - middle) / 0.05) ** 2)) for middle in (0.3, 0.537)]
    assert travel_time(time, *pulse, 1e-3) == pytest.approx(0.237, abs=1e-3)


def test_a_diagram_and_a_film_are_drawn_of_it(seen, tmp_path):
    profile, _, _ = seen
    with styled() as (_, axes):
        drawn = draw_space_time(axes, [0.05, 0.15, 0.25], profile.time, profile.velocity[:, 0])
        assert drawn.get_clim() == (-np.abs(profile.velocity).max(), np.abs(profile.velocity).max())
    stress = profile.stress(1e10, 0.1)
    film_bar(tmp_path / "a.gif", profile, stress, length=0.3, strength_pa=6e6, bar=0, count=3)
    assert (tmp_path / "a.gif").stat().st_size > 1000


def test_a_wave_is_drawn_over_place_and_time_and_as_some_cells_see_it(seen, tmp_path):
    profile, *_ = seen
    options = {"cells": {"first": 0, "end": -1}, "label": "velocity [m/s]", "level": ("pull", 10.0)}
    place = np.array([0.05, 0.15, 0.25])
    picture_wave(tmp_path / "a.png", place, profile.time, profile.velocity[:, 0], **options)
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_breaks_are_marked_when_and_where_they_came():
    joints = np.array([[False, False], [False, True], [True, True]])
    with styled() as (_, axes):
        draw_breaks(axes, np.array([0.1, 0.2]), np.array([0.0, 1e-3, 2e-3]), joints)
        assert sorted(axes.lines[0].get_xydata().tolist()) == [[0.1, 2.0], [0.2, 1.0]]


def test_mean_displacements_of_a_result_are_those_of_its_frames(seen):
    *_, result = seen
    moved = result.mean_displacement(np.arange(6))
    assert moved.shape == (7, 3) and np.abs(moved[-1]).max() > 0.0
    for row, frame in zip(moved, result.frames):
        assert row == pytest.approx(frame.displacement[:6].mean(axis=0), rel=1e-12, abs=1e-20)
    mask = np.arange(18) < 6
    assert result.mean_displacement(mask).tobytes() == moved.tobytes()


def test_a_film_shows_each_run_at_or_before_the_time_of_the_picture(seen, tmp_path, monkeypatch):
    *_, result = seen
    shown = []
    monkeypatch.setattr(
        "taichi_dem.plot.film_runs.move_bodies",
        lambda drawn, model, frame, values, **look: shown.append(frame.time_s),
    )
    titles = [str(k) for k in range(len(result.frames))]
    values = np.zeros((len(titles), result.model.body_count))
    run = FilmedRun(result.model, result.frames, values, titles, np.arange(7.0), "run", "black")
    times = [0.0, 1.5e-5, 6e-5]
    film_runs(tmp_path / "b.gif", [run], times, words="value", curve={"ylabel": "y"})
    assert shown == pytest.approx([0.0, 1e-5, 6e-5])
    assert (tmp_path / "b.gif").is_file()


def test_the_outcome_of_a_run_that_diverged_is_its_result():
    kept = Collector(Every(steps=100), step=lambda view: view.step)
    result = pulled(kept, dt=1e-5)
    assert result.diverged.startswith("diverged at t = ")
    assert kept["step"].tolist() == [0] and kept.view.step > 0


def test_a_collector_keeps_what_it_was_asked_for():
    kept = Collector(Every(steps=1), twice=lambda view: 2 * view.step)
    for step in range(3):
        kept.observe(SimpleNamespace(step=step))
    assert kept["twice"].tolist() == [0, 2, 4] and kept.rows.keys() == {"twice"}
