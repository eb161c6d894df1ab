"""The kind of the grains as a source of error of a damper's answer."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from ca_damper import Automaton, Empty, RigidMass, Spheres, goals, solve_response
from ca_damper.accuracy.sources import other_filling
from taichi_dem import InputError

ASKED = {"particles": 3, "goal": [goals.rms_at(1.0), goals.rms_at(0.9)], "tolerance": 0.3}


@pytest.mark.parametrize("columns", range(1, 30))
def test_the_other_filling_has_the_same_box_and_grains(columns):
    """Also of widths that a quotient would round down: 0.018 m are three grains of 0.006 m."""
    given = {"rows": 7, "particle_mass": 1e-4, "restitution": 0.6, "gravity": 5.0}
    cells = Automaton(columns=columns, **given)
    spheres = other_filling(cells)
    assert (spheres.width, spheres.height) == pytest.approx((columns * 6e-3, 7 * 6e-3))
    assert other_filling(spheres) == cells
    literal = replace(spheres, width=float(f"{columns * 6e-3:.3f}"), height=0.042)
    assert other_filling(literal) == cells


def test_the_filling_is_measured_by_the_same_question_to_the_other():
    filling = Automaton(particle_mass=4e-4)
    found = solve_response(filling, **ASKED, sources=["filling"], progress=None)
    others = solve_response(other_filling(filling), **ASKED, progress=None)
    plain = solve_response(filling, **ASKED, progress=None)
    for answer, other, alone in zip(found, others, plain):
        assert answer.value == alone.value
        apart = np.hypot(abs(answer.value - other.value), other.error)
        assert answer.parts == replace(alone.parts, filling=apart)
        assert answer.budget.error["filling"] == answer.parts.filling > 0.0
        assert not alone.budget.in_bar["filling"] and "not in the bar: filling" in str(alone)


@pytest.mark.parametrize("filling", [Empty(), RigidMass()], ids=lambda one: one.label)
def test_what_has_no_other_kind_is_refused_before_any_run(filling):
    with pytest.raises(InputError, match="sources must not have 'filling' unless there are grains"):
        solve_response(filling, particles=0, goal=goals.peak_rms(), sources=["filling"])


def test_grains_that_the_other_kind_has_not_are_told_as_not_measured():
    """Spheres of several sizes have no places, and spheres must bounce a little."""
    filling = Automaton(restitution=0.0)
    assert other_filling(filling) is other_filling(Spheres(sizes=[(2, 6e-3), (3, 4e-3)])) is None
    answer = solve_response(filling, **ASKED, progress=None)[0]
    assert "no other model of these grains" in answer.budget.how["filling"]
    with pytest.raises(InputError, match="sources must not have 'filling'"):
        solve_response(filling, **ASKED, sources=["filling"])


def test_what_ends_the_other_filling_is_told_and_the_answer_kept(monkeypatch):
    """An automaton with one place for three grains."""
    module = sys.modules["ca_damper.solve_response"]
    monkeypatch.setattr(module, "other_filling", lambda _: Automaton(columns=1, rows=1))
    asked = {"particles": 3, "goal": goals.rms_at(1.0), "tolerance": 0.3, "progress": None}
    answer = solve_response(Spheres(), **asked, sources=["filling"])
    assert answer.value == solve_response(Spheres(), **asked).value
    assert "Automaton() has no answer: particles" in answer.shortfall and not answer.reached
    assert "Automaton() has no answer" in answer.budget.how["filling"]
