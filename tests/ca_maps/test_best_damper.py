"""The best damper: boxes that are tried, the winner, and input that has no answer."""

import math
import re
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from ca_damper import Automaton, Oscillator, RigidMass, best_damper, excitation, shake
from ca_damper.errors import InputError
from ca_damper.runs.best_damper import BestDamper, Value, _searched
from ca_damper.runs.grains import DENSITY, boxes_of
from ca_damper.runs.settled import SteadyPeak, limit_of

BOX = (60e-3, 96e-3)
ONE = {"heights": 1}
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


@pytest.mark.parametrize("count", [1, 4, 5, 30])
@pytest.mark.parametrize("share", [0.1, 0.25])
def test_an_error_of_manufacture_changes_what_it_names_and_nothing_else(count, share):
    """Clearance, size of a grain and mass of all of them; number and width never."""
    best = boxes_of(6e-3, (count,), BOX, DENSITY, 1)[0]
    found = dict(best.with_errors(share))
    assert len(found) == 6
    for name, one in found.items():
        own, change = name.split()[:2]
        by = {
            "clearance": one.clearance / best.clearance,
            "size": one.diameter / best.diameter,
            "mass": one.particles * one.mass / (best.particles * best.mass),
        }
        assert by.pop(own) == pytest.approx(1.0 + 0.01 * float(change))
        assert [*by.values()] == pytest.approx([1.0, 1.0])
        assert (one.particles, one.width) == (best.particles, best.width)


def parabola(lowest, _, box, seeds, brief=False):
    """Values of a box over its rows."""
    return np.full(seeds, 1.0 + (box.height / box.diameter - lowest) ** 2), 0.0


def test_heights_are_refined_until_the_best_has_no_untried_neighbour():
    """Of 15 rows, 3 at first: the lowest of a parabola over the rows, wherever it lies."""
    boxes = boxes_of(6e-3, (30,), BOX, DENSITY, 3)
    rows = {round(one.height / one.diameter) for one in boxes}
    assert rows == {4, 10, 16}
    for lowest in range(4, 17):
        case = SimpleNamespace(values=partial(parabola, lowest))
        found = _searched(case, None, boxes, 2)
        best = found["grains"]
        assert best.height / best.diameter == pytest.approx(lowest)
        assert {lowest - 1, lowest + 1} & set(range(4, 17)) <= {
            round(one.height / one.diameter) for one, _ in found["tried"]
        }


def test_a_bar_is_that_of_students_t():
    """Of 1 and 3: mean 2, deviation sqrt(2), t of one degree of freedom tan(0.95 pi / 2)."""
    value = Value.of(np.array([1.0, 3.0]))
    assert (value.mean, value.error) == pytest.approx((2.0, math.tan(0.95 * math.pi / 2.0)))


def test_the_winner_has_the_lowest_upper_end_and_damps():
    made = best_damper(Oscillator(), 0.6e-3, confirm=Automaton(), tolerance=0.0, **JOB)
    assert made.confirmed == made.value and made.value.mean < 0.75 * made.fixed
    assert (made.without, made.fixed) == (Oscillator().peak()[1], Oscillator().peak(6e-3)[1])
    # Of w^2 x at the peak, but for a share of (2 zeta)^2 by which that of w^2 x lies beside it.
    omega = 2.0 * math.pi * Oscillator().natural_frequency * Oscillator().peak(6e-3)[0]
    ratio = math.sqrt(2.0) * omega**2 * made.fixed / Automaton().gravity
    assert made.acceleration_ratio == pytest.approx(
        ratio, rel=(2.0 * Oscillator().damping_ratio) ** 2
    )
    ends = [value.mean + value.error for _, value in made.equals]
    assert all(made.value.mean + made.value.error <= end for end in ends)
    assert len(made.table()) > 2 and made.search_seconds > 0.0
    assert "30 grains of 6 mm" in str(made)


@pytest.mark.parametrize(("place", "ends"), [(0, 2), (4, 0), (7, 1), (8, 2)])
def test_a_winner_at_an_end_of_what_was_tried_says_so(place, ends):
    """Of three numbers of grains with three heights each; of one box alone nothing is an end."""
    boxes = boxes_of(6e-3, (10, 20, 30), BOX, DENSITY, 3)
    value, none = Value(1e-3, 1e-4), (None, 2e-3, 2e-3, 2.0, (), {})
    tried = tuple((box, 1e-3) for box in boxes)
    made = BestDamper(boxes[place], value, *none, tried, 0.0)
    assert len(made.at_ends) == ends and ("may be better" in str(made)) == bool(ends)
    assert BestDamper(boxes[0], value, *none, tried[:1], 0.0).at_ends == ()


def test_a_box_whose_scenes_diverge_is_no_winner():
    boxes = boxes_of(6e-3, (10, 30), BOX, DENSITY, 3)
    height = {box: np.nan if k % 2 == 0 else 1.0 + k for k, box in enumerate(boxes)}
    case = SimpleNamespace(
        values=lambda _, box, seeds, brief=False: (np.full(seeds, height.get(box, np.nan)), 0.0)
    )
    assert _searched(case, None, boxes, 2)["grains"] == boxes[1]


@pytest.mark.parametrize("damping", [0.002, 0.0005])
def test_grains_at_rest_leave_the_peak_of_a_fixed_mass_however_light_the_damping(damping):
    """At 0.9 g. The parabola of the peak is exact to (2 zeta)^2, the motion to RK45's 1e-9."""
    size = 2e-3 * damping
    made = best_damper(
        Oscillator(damping=damping), size, confirm=Automaton(), tolerance=0.0, **{**JOB, **ONE}
    )
    assert made.value.mean == pytest.approx(made.fixed, rel=1e-4)
    assert made.acceleration_ratio == pytest.approx(0.9, rel=0.01)
    assert made.value.error < 1e-3 * made.fixed and made.tried[0][1] == pytest.approx(made.fixed)


def test_structures_without_damping_are_refused_where_the_base_is_a_sine():
    with pytest.raises(InputError, match=r"^damping of the oscillator must be positive"):
        best_damper(Oscillator(damping=0.0), 0.6e-3, **JOB)
    still = excitation.random_vibration([4.0, 12.0], [2.0, 2.0], duration=0.5, seed=1)
    job = {**JOB, **ONE, "confirm": Automaton(), "tolerance": 0.0}
    assert best_damper(Oscillator(damping=0.0), still, **job).value.mean > 0.0


def test_an_approach_shows_its_limit_and_numbers_that_go_away_none():
    """X = 3 + i + 2 q^n: three of them tell the limit, as the factor is one."""
    n, near, away = np.arange(6), 0.999 * np.exp(0.05j), 1.01 * np.exp(0.05j)
    rows = np.array([3.0 + 1j + 2.0 * q**n for q in (near, away)] + [np.full(6, 2.0 + 0j)])
    limit, error = limit_of(rows)
    assert limit[[0, 2]] == pytest.approx(np.array([3.0 + 1j, 2.0]), rel=1e-10)
    assert np.isinf(limit[1]) and np.isinf(error[1]) and error[0] < 1e-10


def test_a_signal_is_judged_on_the_base():
    motion = excitation.random_vibration([4.0, 12.0], [2.0, 2.0], duration=2.0, seed=1)
    made = best_damper(Oscillator(), motion, goal="rms", confirm=Automaton(), tolerance=0.0, **JOB)
    assert 0.3 * made.fixed < made.value.mean < made.fixed
    for filling, count, value in ((RigidMass(), 0, made.without), (RigidMass(6e-3), 1, made.fixed)):
        alone = shake(filling, motion, particles=count, seeds=1, progress=None)
        assert value == pytest.approx(alone.relative_rms[0, 0])
    assert made.acceleration_ratio > 1.0


@pytest.mark.parametrize("box", [(60e-3, 12e-3), (2e-3, 96e-3), (2e-3, 1e-3)])
def test_a_box_that_would_do_is_named_where_one_is_too_small(box):
    with pytest.raises(InputError, match="one sheet") as refused:
        boxes_of(6e-3, (10, 30), box, DENSITY, 2)
    enough = tuple(
        map(float, re.search(r"at least \((.*?), (.*?)\) m", str(refused.value)).groups())
    )
    assert boxes_of(6e-3, (10, 30), enough, DENSITY, 2)
    # To the tenth of a millimetre by which it is rounded up, no lower one does.
    with pytest.raises(InputError):
        boxes_of(6e-3, (10, 30), (enough[0], enough[1] - 1e-4), DENSITY, 2)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"mass": 0.1}, "mass must be at most that of the oscillator, 0.086 kg, got 0.1"),
        ({"mass": 0.08600001}, "mass must be at most .* 0.086 kg, got 0.08600001"),
        ({"box": (2e-3, 96e-3)}, "box must hold 0.006 kg of grains with a layer free above them"),
        ({"box": (60e-3, 12e-3)}, "box must hold 0.006 kg of grains with a layer free above them"),
        ({"box": 60e-3}, "box must be an inner width and a greatest inner height"),
    ],
)
def test_input_without_an_answer_is_refused_in_a_sentence(wrong, words):
    with pytest.raises(InputError, match="^" + words):
        best_damper(Oscillator(), 0.6e-3, **{**JOB, **wrong})


def test_only_a_peak_outside_ends_a_search_in_silence():
    """Whatever else is refused in a look is refused by the search."""

    def refused(ratios, doublings):
        raise InputError("the device no longer answers")

    scenes = {"oscillator": Oscillator(), "particles": [1], "seeds": [1], "base_amplitude": 1e-3}
    search = SteadyPeak(RigidMass(), (10, 4), None, **scenes)
    search._rms = refused
    with pytest.raises(InputError, match="no longer answers"):
        search.run(0.9, 1.02, 0)
