"""What the lessons compute and tell: bits of runs made for the choice, accounts that close."""

import importlib.util
from pathlib import Path

import pytest

import _answers
import _grains
import _time_step
from taichi_dem import Simulation, Uniform, effects, runtime
from taichi_dem.kit.session_thread import session
from taichi_dem.materials import CONCRETE
from taichi_dem.scene import Scene
from tests.scenes import ROOT

pytestmark = pytest.mark.experiment

NOTEBOOKS = sorted(Path(ROOT, "experiments", "lessons").glob("wh*.py"))


@pytest.fixture(scope="module")
def engine(taichi_session):
    """The thread that the lessons share, with two of the CPU; it wants Taichi for itself."""
    runtime.stop()
    session.threads = 2
    yield session
    session.close()
    session.threads = None


def test_another_step_and_blow_give_the_bits_of_a_simulation_made_for_them(engine):
    """After a run with other numbers that has diverged, nothing of it is left."""
    step, rise, count = 8e-8, 5e-5, 300

    def fresh():
        blow = effects.GasPressure("left", peak=_time_step.PEAK, rise=rise, decay_ratio=1.0)
        scene = Scene(_time_step.scene().mesh, CONCRETE, [blow, effects.BondDamping()])
        simulation = Simulation(scene, Uniform(step))
        simulation.advance_to(count)
        return simulation.state.motion(), simulation.energy_balance.account()

    def again():
        _time_step.strike("explicit", 2.56e-6, 1e-5)
        made = _time_step.ready("explicit", step, rise)
        made.advance_to(count)
        return made.state.motion(), made.energy_balance.account()

    (expected, account), (motion, other) = engine.ask(fresh), engine.ask(again)
    assert all(motion[key].tobytes() == expected[key].tobytes() for key in expected)
    assert account == other and account["load_work"] > 0.0


def test_what_the_base_gives_is_what_dashpot_and_grains_take(engine):
    """In the steady state; first harmonics. 2 % is left of the transient after 60 cycles.

    A box that is as well damped as the empty one (0.012) forgets by exp(-2 pi 0.012 60) = 1 %, in
    amplitude, which counts twice in an energy.
    """
    answer = engine.ask(_grains.Answer, 30, 0.07, 0.6e-3, 0.97)
    given = answer.energy["base"]
    assert answer.energy["dashpot"] + answer.energy["filling"] == pytest.approx(given, rel=0.02)
    assert answer.energy["filling"] > 0.2 * given and answer.throw > 1.0


def test_answers_hold_the_truth_and_narrower_ones_cost_more_runs(engine):
    """A bar that is asked for to a share is no wider; the truth's own error is below 1e-6.

    It falls by four from step to step: from 1.5e-6 s, where it is 3 %, to 1e-8 s.
    """
    last = [engine.ask(_answers.answer, tolerance) for tolerance in (10.0, 0.29, 0.01)][-1]
    assert list(last.answers) == [10.0, 0.3, 0.01]
    for tolerance, found in last.answers.items():
        assert found.reached and 0.0 < last.bar(tolerance) <= 0.01 * tolerance
        assert last.error(tolerance) <= last.bar(tolerance) + 3e-6
    runs = [found.plan.runs for found in last.answers.values()]
    assert runs == sorted(runs) and runs[0] < runs[-1]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_without_a_browser(path, engine, capfd):
    pytest.importorskip("marimo", reason="marimo is not installed: make lessons installs it")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.app.run()
    assert capfd.readouterr().err == ""
