"""Observers of a run: when they are called, their view of it, and what is refused."""

import os
import re
import sys

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    At,
    Checkpoint,
    Every,
    InputError,
    ProgressBar,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.mesh.shapes import bar
from taichi_dem.output.progress_lines import ProgressLines
from taichi_dem.output.run_costs import RunCosts, level_columns, level_shares
from taichi_dem.simulate import run_simulation

STEP, UNTIL = 4e-7, 8e-6
LINE = r"t = (\S+) ms, \S+ ms a step, \d+ (?:s|min) left, \d+ MB of fields, \d+ MB in all"


class Notes:
    """Notes what a function makes of the view."""

    def __init__(self, when, look=lambda view: view.step):
        self.when, self.look, self.seen = when, look, []

    def observe(self, view):
        self.seen.append(self.look(view))


def scene():
    blow = effects.GasPressure("left", peak=1e6, rise=2e-6)
    return Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [blow])


def run(*observers, **options):
    options = {"method": Uniform(STEP), "until": UNTIL, "samples": 4, **options}
    return simulate(scene(), progress=None, observers=list(observers), **options)


@pytest.mark.parametrize(
    ("when", "steps"),
    [
        (Every(steps=6), [0, 6, 12, 18, 20]),
        (Every(steps=100), [0, 20]),
        (Every(time_s=5 * STEP), [0, 5, 10, 15, 20]),
        # 2.5 steps: the nearest of two equally near ones is the even one, as Python rounds.
        (Every(time_s=2.5 * STEP), [0, 2, 5, 8, 10, 12, 15, 18, 20]),
        (Every(time_s=0.3 * STEP), list(range(21))),
        (Every(samples=1), [0, 7, 13, 20]),
        (Every(samples=2), [0, 13, 20]),
        (Every(wall_s=1e6), [20]),
        (At((0.0, 7.4 * STEP, UNTIL)), [0, 7, 20]),
        (At([]), []),
    ],
)
def test_steps_of_calls(when, steps):
    assert sorted(when.marks(20, STEP, 3)) == steps


def test_an_observer_sees_the_run_as_its_result_tells_it_and_changes_no_bit():
    alone = run(frames=4)
    account = Notes(Every(steps=5), lambda view: view.energy_balance()["kinetic"])
    places = Notes(At((UNTIL,)), lambda view: view.motion()["position"])
    rows = Notes(Every(steps=5), lambda view: len(view.history()["time_s"]))
    count = Notes(At((UNTIL,)), lambda view: (view.evaluations, view.report().broken_faces))
    often = Notes(Every(wall_s=1e-9), lambda view: view.time_s)
    views = Notes(At((0.0,)), lambda view: view)
    watched = run(account, places, rows, count, often, views, frames=4)
    assert account.seen == alone.history["kinetic_J"].tolist()
    assert rows.seen == [1, 2, 3, 4, 5]
    assert places.seen[0].tobytes() == alone.frames[-1].position.tobytes()
    assert count.seen == [(alone.report.contact_evaluations, 0)]
    for name, column in alone.history.items():
        assert column.tobytes() == watched.history[name].tobytes(), name
    # By the clock: between steps, and at the end.
    assert often.seen == sorted(often.seen) and len(often.seen) >= 4
    assert often.seen[-1] == pytest.approx(UNTIL, rel=1e-12)
    assert_read_only(*views.seen)


def assert_read_only(view):
    with pytest.raises(InputError, match="must not be written to, got time_s = 1"):
        view.time_s = 1
    for arrays in (view.motion(), view.history(), {"broken": view.broken}):
        for array in arrays.values():
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


def test_progress_lines_tell_of_each_tenth_of_the_way(capsys):
    run(ProgressLines(UNTIL))
    lines = capsys.readouterr().out.splitlines()
    times = [float(re.fullmatch(LINE, line)[1]) for line in lines]
    # 20 steps: two a tenth. Lines have three decimals.
    assert times == pytest.approx(1e3 * 2 * STEP * np.arange(1, 11), abs=0.5e-3)
    assert re.search(", 0 s left, ", lines[-1])


def test_a_run_has_a_title_of_its_own(monkeypatch):
    titles = []

    class Bar(ProgressBar):
        def __init__(self, title):
            titles.append(title)
            super().__init__(title)

    monkeypatch.setattr("taichi_dem.kit.progress.progress_bar.ProgressBar", Bar)
    options = {"method": Uniform(STEP), "until": UNTIL, "samples": 1}
    simulate(scene(), title="blasting", **options)
    simulate(scene(), **options)
    assert titles == ["blasting", "simulating"]


def test_an_observer_that_raises_ends_the_run_and_nothing_is_written(tmp_path):
    def fail(view):
        raise ZeroDivisionError

    folder, saved = tmp_path / "out", tmp_path / "run.npz"
    with pytest.raises(ZeroDivisionError):
        run(Notes(At((5 * STEP,)), fail), output=folder, checkpoint=Checkpoint(saved))
    assert sum(len(files) for _, _, files in os.walk(tmp_path)) == 0


def test_a_resumed_run_calls_for_what_is_left(tmp_path):
    path = tmp_path / "run.npz"
    run(until=10 * STEP, checkpoint=Checkpoint(path))
    left = Notes(Every(steps=5))
    run(left, resume=path)
    assert left.seen == [15, 20]


def test_a_simulation_with_a_motion_of_its_own_is_run_as_a_scene_is():
    made = Simulation(scene(), Uniform(STEP))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (made.model.body_count, 1))
    made.state.set_motion(made.model.centre, still, np.full((len(still), 3), 2.0))
    first = Notes(At((0.0,)), lambda view: view.motion()["velocity"])
    result = run_simulation(made, until=UNTIL, samples=4, progress=None, observers=[first])
    # Half a step back and forth again, by forces of last digits.
    assert first.seen[0] == pytest.approx(2.0, rel=1e-15) and len(result.history["time_s"]) == 5
    with pytest.raises(InputError, match="simulation must be a Simulation"):
        run_simulation(scene(), until=UNTIL)


def test_a_diverged_run_has_been_observed_until_then():
    times = Notes(Every(samples=1), lambda view: view.time_s)
    too_long = pytest.warns(UserWarning, match="less than the largest step")
    with too_long, pytest.raises(SimulationDiverged) as caught:
        run(times, method=Uniform(2e-5), until=1e-2, samples=500)
    assert times.seen == caught.value.result.history["time_s"].tolist() != []


class NoWhen:
    def observe(self, view):
        pass


class BareClass(NoWhen):
    when = Every(steps=1)


class NoObserve:
    when = Every(steps=1)


@pytest.mark.parametrize(
    ("observers", "words"),
    [
        (3, "observers must be a list of observers, got 3"),
        ([NoWhen()], r"observers\[0\] must have a member when, an Every or an At, got None"),
        ([Notes("often")], r"must have a member when, an Every or an At, got 'often'"),
        ([Notes(Every(steps=1)), NoObserve()], r"observers\[1\] must have a method observe"),
        ([BareClass], r"observers\[0\] must have a method observe\(view\), got <function"),
        ([Notes(At((1.0,)))], r"times_s must lie in \[0, 8e-06\] s, got 1"),
        ([Notes(Every(time_s=1e-20))], "time_s must be at least 8e-12 for 1000000 calls"),
    ],
)
def test_what_is_no_observer_is_refused_before_anything_is_built(observers, words, monkeypatch):
    monkeypatch.delattr(sys.modules["taichi_dem.simulate"], "Simulation")
    with pytest.raises(InputError, match=words):
        simulate(scene(), method=Uniform(STEP), until=UNTIL, observers=observers)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Every(), "one of time_s, steps, samples, wall_s, got none"),
        (lambda: Every(steps=2, wall_s=1.0), "got steps and wall_s"),
        (lambda: Every(steps=0), "steps must be a whole number from 1"),
        (lambda: Every(time_s=-1.0), "time_s must be a positive finite number"),
        (lambda: Every(wall_s=float("nan")), "wall_s must be a positive finite number"),
        (lambda: At(1.0), "times_s must be a sequence of times in s, got 1.0"),
        (lambda: At((-1.0,)), "times_s must be zero or a positive finite number, got -1"),
    ],
)
def test_a_time_of_calls_that_is_none_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_costs_of_a_run_grow_from_sample_to_sample():
    costs = RunCosts()
    report = run(costs).report
    assert len(costs.levels) == len(costs.columns["cpu_s"]) == 5
    assert (np.diff(costs.columns["cpu_s"]) >= 0.0).all()
    assert costs.columns["evaluations"][-1] == report.contact_evaluations
    assert costs.view.step == UNTIL / STEP


def test_level_shares_count_the_bodies_of_each_level():
    shares = level_shares([np.array([0, 0, 1, 1]), np.array([2, 0, 0, 0])])
    assert shares.tolist() == [[0.5, 0.5, 0.0], [0.75, 0.0, 0.25]]
    assert {k: v.tolist() for k, v in level_columns(shares).items()} == {
        "level_0": [0.5, 0.75],
        "level_1": [0.5, 0.0],
        "level_2": [0.0, 0.25],
    }
