"""One particle, or a column, falls in a container at rest (Fig. 8)."""

import numpy as np
import pytest

from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

GRAVITY, RESTITUTION, WIDTH, MASS = 10.0, 0.75, 6e-3, 0.2e-3
TOP = 15
HEIGHT = TOP * WIDTH


def impacts(count):
    """Times of impact [s]: t_1 = sqrt(2 h / g), then flights of 2 e^k t_1 each."""
    first = np.sqrt(2 * HEIGHT / GRAVITY)
    return first + np.concatenate([[0], np.cumsum(2 * first * RESTITUTION ** np.arange(1, count))])


def fall(dt=1e-4, column=4, seconds=0.9, **options):
    """Trace of one particle let go in the top row."""
    steps = round(seconds / dt)
    automaton = paper(accounting="landing+ejection", start=((column, TOP),), **options)
    return Shaken(automaton, 1, dt=dt, traced=steps).run(steps).traces()[:, 0]


def found_impacts(trace, dt):
    """Times at which the container takes a blow [s]."""
    return np.flatnonzero(trace[:, 0] != 0.0) * dt


@pytest.mark.parametrize("column", [4, 5])
def test_impacts_follow_theory_to_the_fourth_rebound_within_2_ms(column):
    """With the paper's step, over even and odd columns alike."""
    times = found_impacts(fall(column=column), 1e-4)[:5]
    assert times == pytest.approx(impacts(5), abs=2e-3)


@pytest.mark.parametrize("dt", [1e-3, 3e-4, 2e-5])
def test_impacts_err_by_a_few_steps_a_rebound(dt):
    """A contact is seen up to dt late. Each rebound cuts off a way up to v dt, which the particle
    makes up at e v, and starts from a speed known to g dt, which shifts the fall by 2 dt.
    """
    errors = abs(found_impacts(fall(dt=dt), dt)[:5] - impacts(5))
    assert np.all(errors <= dt * (1 + (1 + 1 / RESTITUTION + 2) * np.arange(5)))


def test_apexes_follow_theory():
    """h e^(2k), each within what the speed e v + 2 g dt and a way v dt make of it."""
    dt = 1e-4
    trace = fall(dt=dt)
    cuts = np.round(impacts(5) / dt).astype(int)
    # Energy m g (h + half a cell: centre of the lowest cell, and half more in an odd column).
    floor = trace[:, 3].min()
    for k in range(1, 4):
        apex = (trace[cuts[k - 1] + 20 : cuts[k] - 20, 3].mean() - floor) / (MASS * GRAVITY)
        speed = np.sqrt(2 * GRAVITY * HEIGHT) * RESTITUTION**k
        slack = speed * (2 * GRAVITY * dt) / GRAVITY + speed * dt
        assert apex == pytest.approx(HEIGHT * RESTITUTION ** (2 * k), abs=k * slack)


def test_blows_are_the_momentum_of_the_fall():
    """(1 + e) m v down on the floor; v is known to one step of gravity for each bounce."""
    trace = fall()
    blows = trace[trace[:, 0] != 0.0, 0][:4]
    speed = np.sqrt(2 * GRAVITY * HEIGHT) * RESTITUTION ** np.arange(4)
    slack = MASS * (1 + RESTITUTION) * GRAVITY * 1e-4 * np.arange(2, 6)
    assert np.all(abs(blows + MASS * (1 + RESTITUTION) * speed) < slack)


@pytest.mark.parametrize("reading", ["reset", "kept"])
def test_other_readings_of_the_accumulator_are_off_by_tens_of_ms(reading):
    """The trap: what a turn does to the way travelled decides where the next flight begins."""
    times = found_impacts(fall(accumulator=reading), 1e-4)[:4]
    assert abs(times - impacts(4)).max() > 20e-3


def test_zero_at_the_wall_keeps_the_place():
    """Without it the particle rests short of its cell's centre, or creeps."""
    trace = fall(seconds=2.0)
    lowest = trace[:, 3].min()
    centre = MASS * GRAVITY * 1.0 * WIDTH
    assert lowest == pytest.approx(centre, abs=MASS * GRAVITY * GRAVITY * 1e-4 * 1e-4)


@pytest.mark.parametrize("accounting", ["landing", "landing+ejection", "all"])
def test_a_column_falls_to_the_floor_and_stays_a_column(accounting):
    """Ten in a column end in its ten lowest cells, whatever counts."""
    automaton = paper(accounting=accounting, start=tuple((4, 6 + k) for k in range(10)))
    box = Shaken(automaton, 10).run(30000)
    height = box.device.snapshot(0)["position"][:, 1] / WIDTH
    assert height.min() == pytest.approx(1.0, abs=0.2)
    assert height.max() < 10.5
