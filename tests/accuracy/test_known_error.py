"""What a run says of its error for nothing: orders as measured, and words that are true."""

import inspect
import json
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    methods,
    simulate,
)
from taichi_dem.diagnostics.known_error import known_error
from taichi_dem.kit import listing, runtime, study
from taichi_dem.kit.accuracy import plans
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.methods import order_of
from taichi_dem.scene import kind_of
from tests.accuracy.small_bar import UNTIL, struck_bar
from tests.bar_blast import METHODS as BAR_METHODS
from tests.bar_blast import bar_scene
from tests.slow import slow_but

#: Half of an order would be another scheme; what the next order adds is a few hundredths here.
SEEN = 0.1
NAMES = [name for name in listing.own(methods, inspect.isclass) if name != "Method"]
#: Sweeps to the end: what is left of them must not blur the order.
AGREED = {"sweeps": (2, 400), "tolerance": 1e-12}
#: How each method is made of a step [s], its step and l in proportion, by whether steps vary.
MADE = {
    ("Uniform", False): Uniform,
    ("Uniform", True): lambda step: Uniform(step, 5e-2 * step),
    ("Multirate", False): lambda step: Multirate(step, 1.0),
    ("Multirate", True): lambda step: Multirate(step, 5e-2 * step),
    ("ImplicitDashpots", False): partial(ImplicitDashpots, **AGREED),
    ("ImplicitDashpots theta 1", False): partial(ImplicitDashpots, theta=1.0, **AGREED),
}


def run(method, damping, until=UNTIL):
    """Result of the struck bar."""
    looks = {"until": until, "samples": 1, "frames": 1, "progress": None}
    return simulate(struck_bar(damping=damping), method=method, **looks)


def measured_order(make, step, damping):
    """Orders by the energies and the way of the far end, of steps h, h/2 and h/4; and a report."""
    found = []
    for k in range(3):
        result = run(make(step / 2**k), damping)
        report, frame = result.report, result.frames[-1]
        energies = [report.energy_balance[name] for name in ("kinetic", "bond_strain", "load_work")]
        found.append([*energies, frame.displacement[:, 0].max(), report])
    values = np.array([row[:-1] for row in found])
    ratio = (values[0] - values[1]) / (values[1] - values[2])
    return np.log2(np.abs(ratio)), found[0][-1]


@pytest.mark.parametrize("damping", [False, True])
@pytest.mark.parametrize(("name", "varying"), MADE)
def test_a_method_has_the_order_that_it_declares(name, varying, damping):
    """Explicit dashpots bear 2e-8 s, springs ten times that; l asks for up to 16 times less.

    Half of what springs bear is taken: at all of it the third order shows beside the small second.
    """
    explicit = damping and not name.startswith("Implicit")
    step = 1.6e-8 if varying else 2e-8 if explicit else 1e-7
    orders, report = measured_order(MADE[name, varying], step, damping)
    made = MADE[name, varying](step)
    assert orders == pytest.approx(order_of(made, damping, varying), abs=SEEN)
    word = "steps up to" if varying else "step"
    assert report.known_error.startswith(f"{word} {step:.3g} s, order {round(orders.mean())};")


def test_every_method_of_the_package_is_measured_and_declares_an_order():
    assert {name.split()[0] for name, _ in MADE} == set(NAMES)
    for name in NAMES:
        assert "order" in vars(getattr(methods, name))


def test_limited_dashpots_have_no_order_at_a_step_that_does_not_bear_them():
    """They are other dashpots at each step: differences do not fall as those of an order would."""
    make = partial(Uniform, dashpot="limited")
    orders, report = measured_order(make, 4e-7, True)
    assert abs(orders - 1.0).max() > SEEN < abs(orders - 2.0).max()
    assert report.known_error.startswith("step 4e-07 s, order unknown;")
    assert order_of(make(), False, False) == 2


def test_a_method_of_one_s_own_declares_an_order_or_none_is_known():
    """What it inherits may be wrong of it: forward Euler on the leapfrog's class is of order 1."""

    @dataclass(frozen=True)
    class Own(Uniform):
        name = "own"

    class Declared(Own):
        def order(self, damped, varying):
            return 3

    assert order_of(Own(), False, False) is None and order_of(object(), True, True) is None
    assert order_of(Declared(), True, True) == 3
    assert run(Own(1e-7), False).report.known_error.startswith("step 1e-07 s, order unknown;")


#: Of a bar that breaks: what stands before the energy balance, by method.
WORDS = {
    "uniform": "steps up to 2e-08 s, order 1 between breaks and contacts",
    "implicit": "step 4e-07 s, order 2 between breaks and contacts",
}


@pytest.mark.parametrize("name", slow_but(WORDS, "uniform"))
def test_a_bar_that_breaks_says_so(name):
    looks = {"until": 6e-5, "samples": 1, "progress": None}
    report = simulate(bar_scene(), method=BAR_METHODS[name], **looks).report
    closes = f"energy balance closes to {100.0 * report.energy_residual_fraction:.3g} %"
    assert report.known_error == f"{WORDS[name]}; {closes}"
    first, second = report.known_error.split("; ")
    assert f"known of the error {first}\n{' ' * 19}{second}\n" in str(report)
    assert json.loads(json.dumps(report.as_dict()))["known_error"] == report.known_error


def test_events_are_those_that_happened():
    """Breaks alone, contacts alone; a contact's dashpot counts once something has touched."""
    scene, method = bar_scene(), Uniform(1e-8)
    calm = run(Uniform(1e-7), False).report
    for changes, words in (
        ({"broken_faces": 3}, "order 2 between breaks;"),
        ({"pair_evaluations": 3}, "order 2 between contacts;"),
        ({}, "order 2;"),
    ):
        report = replace(calm, **changes)
        assert words in known_error(report, struck_bar(damping=False), Uniform(1e-7))
    touching = Scene(scene.mesh, CONCRETE, [e for e in scene.effects if e.role == "contact"])
    assert touching.damped() and not touching.damped(touching=False)
    assert scene.damped(touching=False) and not struck_bar(damping=False).damped()
    undamped = Scene(scene.mesh, replace(CONCRETE, normal_damping=0.0, shear_damping=0.0), [])
    assert not undamped.damped() and order_of(method, undamped.damped(), False) == 2


def test_energies_that_are_round_off_are_said_to_be():
    still = simulate(Scene(single(), CONCRETE), method=Uniform(1e-8), until=1e-7, progress=None)
    words = "step 1e-08 s, order 2; energy balance: 0 J, all energies are round-off"
    assert still.report.known_error == words
    assert known_error(replace(still.report, substeps=0), still.scene, still.method) == ""


@pytest.fixture
def nothing_known(monkeypatch):
    """Plans as in a new session."""
    monkeypatch.setattr(plans, "_known", {})


def test_a_plan_of_the_session_tells_when_twins_part(nothing_known):
    """To scenes of the same effects and the same number of bodies."""
    sentence = plans.parting(2.1e-4, 5e-4)
    assert sentence == "runs that differ by one rounding part from 0.00021 s"
    together = plans.parting(float("inf"), 5e-4)
    assert together == "runs that differ by one rounding stay together until 0.0005 s"
    plans.remember(kind_of(struck_bar()), sentence)
    assert run(Uniform(1e-8), True).report.known_error.endswith(f"; in such scenes {sentence}")
    for other in (struck_bar(damping=False), Scene(pair(), CONCRETE, struck_bar().effects)):
        assert plans.recall(kind_of(other)) == ""
    plans.remember(kind_of(struck_bar()), together)
    assert plans.recall(kind_of(struck_bar())) == together


def test_plans_end_with_their_session(nothing_known, monkeypatch):
    plans.remember("kind", "words")
    assert plans.recall("kind") == "words"
    monkeypatch.setattr(runtime, "_session", runtime.Session())
    assert plans.recall("kind") == ""


def test_what_is_known_is_the_same_after_a_restart_and_costs_nothing(tmp_path):
    """No evaluation more, and the words of a run that was never stopped."""
    simulation = Simulation(struck_bar(), Uniform(1e-8))
    simulation.start()
    simulation.advance_to(3)
    before = simulation.evaluations()
    words = simulation.report().known_error
    assert words.startswith("step 1e-08 s, order 1;") and simulation.evaluations() == before
    path, looks = tmp_path / "saved.npz", {"samples": 1, "progress": None}
    question = {"scene": struck_bar(), "method": Uniform(1e-8)}
    simulate(**question, until=5e-8, checkpoint=Checkpoint(path), **looks)
    resumed = simulate(**question, until=1e-7, resume=path, **looks).report
    assert resumed.known_error == simulate(**question, until=1e-7, **looks).report.known_error


def test_summary_of_a_study_keeps_what_its_runs_say(tmp_path, capsys):
    """Once for equal sentences; figures without a report of runs have none."""
    reports = [run(Uniform(step), False).report for step in (1e-7, 1e-7, 2e-7)]
    told = []
    for runs in (reports, (1.0, 2.0)):
        study.finish(SimpleNamespace(out=str(tmp_path)), "some", {}, runs)
        told.append(json.loads((tmp_path / "summary.json").read_text()))
    assert told[0]["known_errors"] == [reports[0].known_error, reports[2].known_error]
    assert told[1]["known_errors"] == [] and told[1]["seconds"] == {"compile": 1.0, "run": 2.0}
    assert told[0]["seconds"]["run"] == sum(report.run_seconds for report in reports)
