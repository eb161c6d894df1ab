"""What the lessons compute: bits of a run made for the choice, accounts that close, true words.

And the notebooks themselves, without a browser.
"""

import importlib.util
import io
import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import _answers
import _grains
import _needs
import _time_step
from ca_damper import Batch, Empty, Oscillator, SceneTable
from taichi_dem import ImplicitDashpots, InputError, Simulation, Uniform, effects, needed_effects
from taichi_dem.materials import CONCRETE
from taichi_dem.scene import Scene
from tests.scenes import ROOT

FOLDER = Path(ROOT) / "experiments" / "lessons"
NOTEBOOKS = sorted(path.stem for path in FOLDER.glob("*.py") if not path.stem.startswith("_"))
SLOW_NAMES = pytest.param(("shear_slip", "sphere_contact"), marks=pytest.mark.slow)


def fresh_far_end(method, rise, macro_steps):
    """Motion of the bar after some steps of a simulation that is made for the choice."""
    bar = _time_step.scene()
    blow = effects.GasPressure("left", peak=_time_step.PEAK, rise=rise, decay_ratio=1.0)
    scene = Scene(bar.mesh, CONCRETE, [blow, effects.BondDamping()])
    simulation = Simulation(scene, method)
    simulation.advance_to(macro_steps)
    return simulation.state.motion(), simulation.energy_balance.account()


@pytest.mark.parametrize("name", ["explicit", pytest.param("solved", marks=pytest.mark.slow)])
def test_another_step_and_blow_give_the_bits_of_a_simulation_made_for_them(engine, name):
    """After a run with other numbers, one that diverges included, nothing of it is left.

    The simulation made for them comes first, on an engine that nothing has used. Blocks of bonds
    are updated six times on the way: after a time, however many steps that takes.
    """
    step, rise, count = 6.4e-7 if name == "solved" else 8e-8, 5e-5, 300
    solved = ImplicitDashpots(step, tolerance=1e-3)
    method = solved if name == "solved" else Uniform(step)
    assert name != "solved" or count * step > 6.0 * solved.refresh

    def again():
        _time_step.strike(name, 2.56e-6, 1e-5)
        made = _time_step.ready(name, step, rise)
        made.advance_to(count)
        return made.state.motion(), made.energy_balance.account()

    engine.close()
    motion_there, account_there = engine.ask(fresh_far_end, method, rise, count)
    motion, account = engine.ask(again)
    for key, values in motion.items():
        assert values.tobytes() == motion_there[key].tobytes(), key
    assert account == account_there
    assert account["load_work"] > 0.0


@pytest.mark.slow
def test_solved_dashpots_are_of_second_order_and_explicit_ones_of_first(engine):
    """Halved steps: errors by 2^order. A quarter of an order for what higher orders add."""

    def errors(name, steps):
        strikes = [_time_step.strike(name, step, 1e-5) for step in steps]
        return [made.error(_time_step.truth(1e-5)) for made in strikes]

    for name, steps, order in (("explicit", (8e-8, 4e-8), 1), ("solved", (1.6e-7, 8e-8), 2)):
        coarse, fine = engine.ask(errors, name, steps)
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.25), name


def test_an_explicit_step_beyond_the_limit_is_told_in_words(engine):
    """The limit is that of a pair of the worst bodies: at twice it the run must end."""
    dashpots, _ = _time_step.limits()
    step = _time_step.nearest(_time_step.STEPS, 2.0 * dashpots)
    found = engine.ask(_time_step.timed, "explicit", step, 1e-5)
    assert step > dashpots and found.sentence.startswith("diverged at t = ")
    assert found.motion is None and math.isnan(found.seconds)


def test_what_the_base_gives_is_what_dashpot_and_grains_take(engine):
    """In the steady state; first harmonics. 2 % is left of the transient after 60 cycles.

    A box that is as well damped as the empty one (0.012) forgets by exp(-2 pi 0.012 60) = 1 %, in
    amplitude, which counts twice in an energy.
    """
    answer = engine.ask(_grains.Answer, 30, 0.07, 0.6e-3, 0.97)
    given = answer.energy["base"]
    assert answer.energy["dashpot"] + answer.energy["filling"] == pytest.approx(given, rel=0.02)
    assert answer.energy["filling"] > 0.2 * given
    assert answer.throw > 1.0 and len(answer.frames) == _grains.PICTURES


def test_grains_that_are_not_thrown_are_a_fixed_mass(engine):
    """Below g the response is the transfer function with their mass, to the rest of the transient.

    The batch begins in that very state, so that nothing but the automaton's blows of the first
    cycles has to be forgotten; they bring a grain at most to rest.
    """
    answer = engine.ask(_grains.Answer, 30, 0.07, 0.05e-3, 0.97)
    assert answer.throw < 0.5
    o = answer.oscillator
    glued = [o.transfer(r * o.natural_frequency, 0.07 * o.mass) for r in _grains.RATIOS]
    expected = o.base_amplitude * np.abs(glued) / math.sqrt(2.0)
    assert answer.cycles.rms == pytest.approx(expected, rel=0.03)
    assert abs(answer.energy["filling"]) < 0.01 * answer.energy["base"]


def test_sliders_of_the_grains_begin_at_one_of_their_steps():
    assert all(first in steps for steps, first, _ in _grains.CHOICES.values())


def test_a_heavier_box_keeps_frequency_and_damping():
    o, paper = _grains.structure(40, 0.05, 1e-3), Oscillator()
    assert o.mass == pytest.approx(40 * 0.2e-3 / 0.05)
    assert o.natural_frequency == pytest.approx(paper.natural_frequency, rel=1e-14)
    assert o.damping_ratio == pytest.approx(paper.damping_ratio, rel=1e-14)


def test_a_changed_batch_has_the_bits_of_a_new_one(engine):
    """Other particles, structure, frequency, step: as made with them; bad ones are refused."""
    first = {"particles": 0, "seed": 1, "dt": 1e-4, "frequency": [5, 6]}
    numbers = {"frequency": [5.5, 6.5], "base_amplitude": 1e-3, "mass": 0.1, "dt": 2e-4}

    def both():
        changed = Batch(Empty(), SceneTable(**first), measured_cycles=2)
        changed.start("rest")
        changed.run(1, 1)
        changed.change(**numbers)
        made = Batch(Empty(), SceneTable(**{**first, **numbers}), measured_cycles=2)
        for one in (changed, made):
            one.start("empty")
        return changed.run(1, 2).record, made.run(1, 2).record, changed

    record, expected, batch = engine.ask(both)
    assert record.tobytes() == expected.tobytes()
    for bad, word in (
        ({"wheels": 3}, "wheels"),
        ({"particles": 3}, "particles"),
        ({"mass": -1}, "mass"),
    ):
        with pytest.raises(InputError, match=word):
            engine.ask(lambda bad=bad: batch.change(**bad))


@pytest.mark.parametrize(
    "names",
    [("bond_damping",), pytest.param(("shear_slip", "sphere_contact"), marks=pytest.mark.slow)],
)
@pytest.mark.slow
def test_effects_that_are_silenced_give_the_bits_of_a_program_without_them(engine, names):
    """Under a pull that breaks the bar where it can break; all that the program says included."""
    silent, own = (engine.ask(work, names, 2.0) for work in (_needs.outcome, _needs.measured))
    assert len(silent.frames) == len(own.frames) == _needs.LOOKS + 1
    for number in _needs.SHOWN.values():
        for key, values in vars(own.frames[number]).items():
            there = vars(silent.frames[number])[key]
            assert np.asarray(values).tobytes() == np.asarray(there).tobytes(), (number, key)
    advice, other = needed_effects(silent), needed_effects(own)
    assert [str(use) for use in advice.uses] == [str(use) for use in other.uses]
    assert advice.missing == other.missing != ()
    assert silent.report.effects == own.report.effects
    assert silent.report.energy_balance == own.report.energy_balance


def test_answers_hold_the_truth_and_narrower_ones_cost_more_runs(engine):
    """A bar that is asked for to a share is no wider; the truth's own error is below 1e-6.

    It falls by four from step to step: from 1.5e-6 s, where it is 3 %, to 1e-8 s.
    """
    asked = [engine.ask(_answers.answer, tolerance) for tolerance in (10.0, 0.29, 0.01)]
    last = asked[-1]
    assert list(last.answers) == [10.0, 0.3, 0.01]
    for tolerance, found in last.answers.items():
        assert found.reached and 0.0 < last.bar(tolerance) <= 0.01 * tolerance
        assert last.error(tolerance) <= last.bar(tolerance) + 3e-6
    runs = [found.plan.runs for found in last.answers.values()]
    assert runs == sorted(runs) and runs[0] < runs[-1]
    # The same answers are given again.
    assert engine.ask(_answers.answer, 10.0).chosen is asked[0].chosen
    said = _answers.words(asked[1])
    assert said.startswith("You allow 0.3 %.") and said.count("**") == 8 and " ± " in said
    with Image.open(io.BytesIO(engine.ask(_answers.picture, last))) as image:
        assert 900 <= image.width <= 1300 and 500 <= image.height <= 800
        assert len(np.unique(np.asarray(image.convert("L")))) > 20


@pytest.mark.slow
def test_what_a_choice_costs_is_known_once_it_was_measured(engine):
    unknown, known = (engine.ask(work, _needs.ALL, 0.2) for work in (_needs.answer, _needs.price))
    assert unknown.step_s is None and min(known.step_s) > 0.0


@pytest.mark.slow
def test_effects_that_never_act_change_no_bit(engine):
    """A gentle pull breaks nothing: dashpots alone give the bits of all effects."""
    answer = engine.ask(_needs.answer, ("bond_damping",), 0.2)
    assert answer.change == 0.0
    for number in _needs.SHOWN.values():
        ends = [made.frames[number].position for made in (answer.chosen, answer.complete)]
        assert ends[0].tobytes() == ends[1].tobytes()
    rows = {words: says for words, _, _, says in _needs.verdicts(answer)}
    assert rows == {
        words: "keep it" if name == "bond_damping" else "not missed"
        for name, (_, words) in _needs.EFFECTS.items()
    }


def test_a_hard_pull_misses_what_is_left_out(engine):
    """The end is pulled out by v / (2 pi f); what would break says so, and what it did counts."""
    answer = engine.ask(_needs.answer, ("bond_damping",), 2.0)
    moved = answer.chosen.frames[_needs.SHOWN["pulled open"]].displacement
    when = _needs.UNTIL * _needs.SHOWN["pulled open"] / _needs.LOOKS
    place = 2.0 * math.pi * _needs.FREQUENCY * when
    # The sum of velocities at the ends of steps is off by a step of the cycle at most.
    late = 2.0 * math.pi * _needs.FREQUENCY * _needs.METHOD.dt0
    assert moved[:, 0].max() == pytest.approx(answer.stroke * math.sin(place), rel=late)
    assert answer.change > 0.1 and answer.complete.report.broken_faces > 0
    assert answer.chosen.report.broken_faces == 0
    said = {words: says for words, _, _, says in _needs.verdicts(answer)}
    assert said["fracture"] == "list it" and said["slip in shear"] == "list it"


def test_a_page_that_tells_an_answer_runs_nothing(engine, monkeypatch):
    """Pages have threads of their own, and only that of the session may use Taichi."""
    answer = engine.ask(_needs.answer, _needs.ALL, 0.2)
    monkeypatch.setattr(Simulation, "__init__", lambda *_: pytest.fail("a page ran a scene"))
    assert "drop it" in {says for _, _, _, says in _needs.verdicts(answer)}
    assert "**" in _needs.words(answer)


def test_friction_is_listed_with_contact_only():
    assert _needs.allowed(("friction", "softening")) == ("softening",)
    assert _needs.allowed(reversed(_needs.ALL)) == _needs.ALL


def test_there_are_four_notebooks_and_make_serves_them():
    assert len(NOTEBOOKS) == 4
    makefile = (Path(ROOT) / "Makefile").read_text(encoding="utf-8")
    assert all(name in makefile for name in NOTEBOOKS)


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_compiles(name):
    path = FOLDER / f"{name}.py"
    compile(path.read_text(encoding="utf-8"), str(path), "exec")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_without_a_browser(name, engine, capfd):
    """Every cell, as ``python NAME.py`` does; the answer is a sentence with figures."""
    pytest.importorskip("marimo", reason="marimo is not installed: make lessons installs it")
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    shown, made = module.app.run()
    said, warned = capfd.readouterr()
    assert said.count("**") >= 4 and warned == ""
    # The same with a guess at each question: each has its verdict now.
    asked = made["asked"]
    right = [question.right for question in asked]
    guessed = SimpleNamespace(elements=made["guessed"].elements, value=right)
    told, _ = module.app.run(defs={"asked": asked, "guessed": guessed})
    verdicts = [str(outputs[-1].text).count("Right.") for outputs in (shown, told)]
    assert verdicts == [0, len(asked)] and len(asked) >= 5


@pytest.mark.parametrize("sentence", ["", "diverged"])
def test_pictures_are_drawn_of_runs_that_end_and_of_those_that_do_not(engine, sentence):
    """A blank canvas has one colour; the picture of the other choice is another one."""
    step = 1.6e-7 if sentence else 8e-8
    answer = engine.ask(_time_step.answer, "explicit", step, 1e-5)
    assert answer.chosen.sentence.startswith(sentence)
    with Image.open(io.BytesIO(engine.ask(_time_step.picture, answer))) as image:
        assert 900 <= image.width <= 1300 and 500 <= image.height <= 800
        assert len(np.unique(np.asarray(image.convert("L")))) > 20
