"""The best damper: boxes that are tried, the winner, and input that has no answer."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ca_damper import Automaton, Oscillator, best_damper, excitation
from ca_damper.errors import InputError
from ca_damper.runs.best_damper import Value, _searched
from ca_damper.runs.grains import DENSITY, boxes_of, shifted

BOX = (60e-3, 96e-3)
JOB = {"mass": 6e-3, "box": BOX, "particles": 30, "seeds": 2, "heights": 2, "cycles": (10, 4)}


def test_boxes_hold_the_mass_in_whole_cells_with_a_layer_free():
    """30 grains of 6 g are those of 0.2 g and 6 mm, in rows of ten."""
    boxes = boxes_of(6e-3, (30, 10), BOX, DENSITY, 3)
    first = boxes[0]
    assert (first.mass, first.diameter, first.width) == pytest.approx((0.2e-3, 6e-3, 60e-3))
    assert [round(one.height / one.diameter) for one in boxes[:3]] == [4, 10, 16]
    assert first.clearance == pytest.approx(6e-3)
    for one in boxes:
        assert one.particles * one.mass == pytest.approx(6e-3)
        assert one.mass == pytest.approx(DENSITY * math.pi / 6.0 * one.diameter**3)
        made = one.put_into(Automaton())
        assert made.clearance(one.particles) == pytest.approx(one.clearance)
        assert one.clearance >= one.diameter * (1.0 - 1e-9)


def test_errors_of_manufacture_change_one_number_each():
    best = boxes_of(6e-3, (30,), BOX, DENSITY, 1)[0]
    changed = dict(shifted(best, 0.1))
    assert changed["clearance +10 %"].clearance == pytest.approx(1.1 * best.clearance)
    assert changed["number -10 %"].particles == 27
    larger = changed["size +10 %"]
    assert larger.mass / larger.diameter**3 == pytest.approx(best.mass / best.diameter**3)
    assert larger.height == best.height


def test_a_bar_is_that_of_students_t():
    """Of 1 and 3: mean 2, deviation sqrt(2), t of one degree of freedom tan(0.95 pi / 2)."""
    value = Value.of(np.array([1.0, 3.0]))
    assert (value.mean, value.error) == pytest.approx((2.0, math.tan(0.95 * math.pi / 2.0)))


def test_the_winner_has_the_lowest_upper_end_and_damps():
    made = best_damper(Oscillator(), 0.6e-3, confirm=Automaton(), tolerance=0.0, **JOB)
    assert made.confirmed == made.value and made.value.mean < 0.75 * made.fixed
    assert made.fixed == Oscillator().peak(6e-3)[1]
    ends = [value.mean + value.error for _, value in made.equals]
    assert all(made.value.mean + made.value.error <= end for end in ends)
    assert len(made.table()) == 2 and made.search_seconds > 0.0
    assert "30 grains of 6 mm" in str(made)


def test_a_box_whose_scenes_diverge_is_no_winner():
    boxes = boxes_of(6e-3, (10, 30), BOX, DENSITY, 3)
    height = {box: np.nan if k % 2 == 0 else 1.0 + k for k, box in enumerate(boxes)}
    case = SimpleNamespace(values=lambda _, box, seeds, brief=False: np.full(seeds, height[box]))
    assert _searched(case, None, boxes, 2)["grains"] == boxes[1]


def test_a_signal_is_judged_on_the_base():
    motion = excitation.random_vibration([4.0, 12.0], [2.0, 2.0], duration=2.0, seed=1)
    made = best_damper(Oscillator(), motion, goal="rms", confirm=Automaton(), tolerance=0.0, **JOB)
    assert 0.3 * made.fixed < made.value.mean < made.fixed


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"mass": 0.1}, "mass must be at most that of the structure, 0.086 kg, got 0.1"),
        ({"box": (2e-3, 96e-3)}, "box must hold 0.006 kg of grains with a layer free above them"),
        ({"box": (60e-3, 12e-3)}, "box must hold 0.006 kg of grains with a layer free above them"),
        ({"box": 60e-3}, "box must be an inner width and a greatest inner height"),
        ({"tolerance": 0.7}, "tolerance must"),
        ({"goal": "mean"}, "goal must be"),
    ],
)
def test_input_without_an_answer_is_refused_in_a_sentence(wrong, words):
    with pytest.raises(InputError, match="^" + words):
        best_damper(Oscillator(), 0.6e-3, **{**JOB, **wrong})
