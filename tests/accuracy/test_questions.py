"""Batteries of questions: a number draws them, and what is known of their truth is used again."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bar_coverage import KINDS
from cases import questions as questions
from cases.accuracy import ASKED, References, content_of, judged

NAMES = [*KINDS]


def drawn(question):
    """What a question is made of, to compare."""
    scene = getattr(question, "scene", None)
    mesh = [] if scene is None else [scene.mesh.points.tobytes(), scene.mesh.tetrahedra.tobytes()]
    return [str(question), *mesh]


@pytest.mark.parametrize("kind", NAMES)
def test_a_number_draws_the_same_question_and_another_one_another(kind):
    make = KINDS[kind][0]
    assert drawn(make(0, 3)) == drawn(make(0, 3))
    assert len({str(make(battery, 3)) for battery in range(4)}) == 4


ANSWER = SimpleNamespace(value=1.0, error=0.1, parts="step 0.1", reached=True, branches=())
WHAT, OTHER = (questions.damper_question(0, number) for number in (3, 5))


@pytest.fixture
def asked(monkeypatch):
    """Judges a question whose answer is 1 +- 0.1; the truth is what is told, by steps of 1."""

    def judge(reference, true, step=1.0, question=WHAT):
        answered = (ANSWER, 0.0, step, lambda: (true, 0.01, step))
        monkeypatch.setitem(ASKED, questions.DamperQuestion, lambda _: answered)
        return judged(question, reference)

    return judge


def test_a_truth_is_kept_for_the_same_question_and_no_finer_answers(asked, tmp_path):
    path = tmp_path / "kept.csv"
    made = References(path)
    assert asked(made.of(0, 5, WHAT), 1.05).holds
    made.write(path)
    kept = References(path)
    assert asked(kept.of(0, 5, WHAT), 9.0).true == 1.05
    assert asked(kept.of(0, 6, WHAT), 9.0).true == 9.0
    assert asked(kept.of(0, 5, OTHER), 9.0, question=OTHER).true == 9.0
    assert asked(kept.of(0, 5, WHAT), 9.0, step=0.5).true == 9.0
    # It is known to 0.01, which is no truth for a narrower bar.
    assert kept.of(0, 5, WHAT)(1.0, 0.009, lambda: (9.0, 0.0, 1.0)) == (9.0, 0.0)
    kept.write(path)
    assert sorted(References(path).kept.index) == [(0, 5), (0, 6)]


def test_a_scene_that_differs_in_its_mesh_alone_is_another_question():
    one = questions.bar_question(0, 0)
    moved = replace(one.scene, mesh=one.scene.mesh.moved(by=(1.0, 0.0, 0.0)))
    other = replace(one, scene=moved)
    assert str(one) == str(other) and content_of(one) != content_of(other)
    assert content_of(one) == content_of(questions.bar_question(0, 0))


@pytest.mark.parametrize(("true", "holds"), [(1.1, True), (0.89, False), (1.2, False)])
def test_a_bar_holds_what_lies_within_it_and_the_doubt_of_the_truth(asked, tmp_path, true, holds):
    found = asked(References(tmp_path / "none.csv").of(0, 0, WHAT), true)
    assert bool(found.holds) == holds == (abs(found.deviation) <= 1.0)
    assert abs(found.deviation) == pytest.approx(abs(1.0 - true) / np.hypot(0.1, 0.01))
