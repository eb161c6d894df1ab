"""By the paper's rules grains fall, rest, are pushed, stay in their box and give up momentum."""

import numpy as np
import pytest

from ca_damper import Automaton, Paper
from ca_damper.automaton import ACCOUNTINGS
from ca_damper.automaton.accounting import QUANTUM
from ca_damper.automaton.lattice import DOWN, DOWN_LEFT, DOWN_RIGHT, EMPTY, HELD, UP, WALL
from tests.ca_automaton.shaken import Shaken
from tests.damper import ejecting, paper

WIDTH, MASS, GRAVITY, DT, RESTITUTION = 6e-3, 0.2e-3, 10.0, 1e-4, 0.75
FREQUENCY = 6.0
OMEGA = 2 * np.pi * FREQUENCY
#: Container that is shaken by four cells, and by three [m].
AMPLITUDE, HARD = 24e-3, 18e-3
EPS = np.finfo(float).eps
#: A fall from the top row of cells.
TOP = 15
HEIGHT = TOP * WIDTH
#: Numbers of grains that exchange momentum in so many steps, that are kept, and that come to rest.
EXCHANGED, STEPS = np.array([1, 10, 50, 100, 160]), 3000
KEPT, RESTING = [0, 1, 2, 10, 50, 120, 159, 160], [1, 10, 50, 100, 159]


def impacts(count):
    """Times of impact [s]: t_1 = sqrt(2 h / g), then flights of 2 e^k t_1 each."""
    first = np.sqrt(2 * HEIGHT / GRAVITY)
    return first + np.concatenate([[0], np.cumsum(2 * first * RESTITUTION ** np.arange(1, count))])


def found_impacts(dt, column):
    """Times at which the container takes a blow of one particle let go in the top row [s]."""
    steps = round(0.9 / dt)
    automaton = ejecting(start=((column, TOP),))
    trace = Shaken(automaton, 1, dt=dt, traced=steps).run(steps).traces()[:, 0]
    return np.flatnonzero(trace[:, 0] != 0.0)[:5] * dt


@pytest.mark.parametrize(("dt", "column"), [(1e-4, 4), (1e-4, 5), (3e-4, 4), (1e-3, 4)])
def test_impacts_err_by_a_few_steps_a_rebound(dt, column):
    """Over even and odd columns alike; with the paper's step to 2 ms at the fourth rebound.

    A contact is seen up to dt late. Each rebound cuts off a way up to v dt, which the particle
    makes up at e v, and starts from a speed known to g dt, which shifts the fall by 2 dt.
    """
    errors = abs(found_impacts(dt, column) - impacts(5))
    assert np.all(errors <= dt * (1 + (1 + 1 / RESTITUTION + 2) * np.arange(5)))


def rise(step):
    """V(t + dt) - V(t) of the container [m/s]."""
    speed = OMEGA * HARD * np.cos(OMEGA * DT * np.array([step, step + 1]))
    return speed[1] - speed[0]


def missing(rules):
    """Momentum that no force explains after 3000 steps of hard shaking [kg m/s], (scenes,).

    p = -N m g t - (given to the container): blows, and what the carried mass takes,
    K' = -(carried) (V' + g) dt.
    """
    box = Shaken(Automaton(rules), EXCHANGED, 3, DT, HARD, FREQUENCY, traced=STEPS)
    trace = box.run(STEPS).traces()
    rises = np.array([rise(step) for step in range(len(trace))])[:, None]
    given = (trace[:, :, 0] - trace[:, :, 1] * (rises + GRAVITY * DT)).sum(axis=0)
    momentum = trace[-1, :, 2] + trace[-1, :, 1] * rise(STEPS - 1)
    return momentum + EXCHANGED * MASS * GRAVITY * DT * STEPS + given


@pytest.mark.parametrize("rules", [Paper(), Paper(pair_rule="one_sided", accumulator="kept")])
def test_all_momentum_goes_into_the_container(rules):
    """Blows are rounded to half a quantum, at most three for a particle and step; gravity's
    additions to a speed below 4 m/s round by 4 EPS each.
    """
    tolerance = EXCHANGED * MASS * STEPS * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(abs(missing(rules)) < tolerance)


def test_landings_leave_out_what_others_count():
    """Pushes and the heap's rest; fewer where pushes count. A single particle meets only walls."""
    left = {name: abs(missing(Paper(name))) for name in ACCOUNTINGS if name != "all"}
    tolerance = EXCHANGED * MASS * STEPS * (1.5 * QUANTUM + 4 * EPS)
    assert np.all(left["landing"][1:] > 1e6 * tolerance[1:])
    assert np.all(left["landing+ejection"][1:] != left["landing"][1:])


def test_particles_stay():
    """Shaken by four cells at 6 Hz for a cycle and a half: walls as they were, each listed once."""
    box = Shaken(paper(), KEPT, dt=2e-4, amplitude=24e-3).run(1250)
    kind, geometry = box.state()[0], box.geometry
    inside = geometry.inside(*geometry.column_and_row(np.arange(geometry.cells)))
    assert np.array_equal(kind[:, :-1] == WALL, np.broadcast_to(~inside, kind[:, :-1].shape))
    present = (kind != EMPTY) & (kind != WALL)
    assert list(present.sum(axis=1)) == KEPT
    cells = box.in_use(box.device.cells.traversal.cells)
    for s, count in enumerate(KEPT):
        assert sorted(cells[s, :count]) == list(np.flatnonzero(present[s]))


def claimed(seeds):
    """Whether cells are taken, the left and the right and the one that both claim, (seeds, 3)."""
    automaton = ejecting(start=((3, 9), (5, 9)))
    box = Shaken(automaton, [2] * len(seeds), seed=seeds)
    geometry = box.geometry
    left, right = geometry.cell_of(3, 9), geometry.cell_of(5, 9)
    target = geometry.neighbours()[left, DOWN_RIGHT]
    assert target == geometry.neighbours()[right, DOWN_LEFT]
    kind, _, travelled = box.state()
    kind[:, left], kind[:, right] = DOWN_RIGHT, DOWN_LEFT
    travelled[:, [left, right]] = 6e-3
    box.put(box.device.cells.kind, kind)
    box.put(box.device.cells.travelled, travelled)
    return box.run(1).state()[0][:, [left, right, target]] != EMPTY


def test_one_of_two_claimants_moves_and_each_as_often():
    """Fig. 5(b): two particles due for one cell in 1024 seeds; 5 sigma of a fair coin."""
    stands = np.concatenate([claimed(seeds) for seeds in np.arange(1024).reshape(16, 64)])
    assert np.all(stands.sum(axis=1) == 2) and np.all(stands[:, 2])
    assert abs(stands[:, 0].sum() - 512) < 5 * np.sqrt(1024) / 2


def test_energy_never_rises_by_more_than_a_hundredth():
    """From one step to the next, in shares of the energy at the start."""
    seeds = np.repeat([1, 2, 3], len(RESTING))
    box = Shaken(paper(), RESTING * 3, seeds, traced=12000).run(12000)
    energy = box.traces()[:, :, 3]
    assert np.all(np.diff(energy, axis=0).max(axis=0) <= 0.01 * energy[0])
    assert np.all(energy[-1] < energy[0])


def test_with_static_contact_all_are_held_at_the_end():
    """Nothing moves, and every particle stands on the floor or on another."""
    box = Shaken(paper(), [*RESTING, 160], amplitude=0.0).run(30000)
    kind, speed, travelled = box.state()
    assert list((kind == HELD).sum(axis=1)) == [*RESTING, 160]
    assert not speed.any() and not travelled.any()
    for scene in kind:
        held = np.flatnonzero(scene == HELD)
        assert np.all(scene[held - 1] >= WALL)


def mean_columns(seeds):
    """Mean column of 40 particles after three cycles of shaking, in which pairs meet."""
    box = Shaken(paper(), [40] * len(seeds), seeds, amplitude=20e-3)
    kind = box.run(5000).state()[0][:, :-1]
    present = (kind != EMPTY) & (kind != WALL)
    columns = box.geometry.column_and_row(np.arange(kind.shape[1]))[0]
    return (present * columns).sum(axis=1) / present.sum(axis=1)


def test_left_and_right_are_alike_in_the_mean():
    """Mean horizontal position over 128 seeds is the middle, within 4 of its standard errors."""
    means = np.concatenate([mean_columns(seeds) for seeds in np.arange(128).reshape(2, 64)])
    error = means.std() / np.sqrt(len(means))
    assert error < 0.05
    assert abs(means.mean() - 4.5) < 4 * error


def displacement(step):
    """Of the container at the beginning of a step [m]."""
    return AMPLITUDE * np.sin(OMEGA * DT * step)


def test_a_particle_in_mid_air_stays_in_the_room():
    """Without gravity a particle at rest moves against the staircase round(x / 6 mm), +-4 cells."""
    automaton = ejecting(gravity=0.0, start=((4, 8),))
    box = Shaken(automaton, 1, amplitude=AMPLITUDE)
    start = box.device.snapshot(0)["position"][0]
    for _ in range(40):
        box.run(50)
        stair = np.floor(displacement(box.done - 1) / WIDTH + 0.5)
        moved = box.device.snapshot(0)["position"][0] - start
        assert moved == pytest.approx([0.0, -stair * WIDTH], abs=1e-12)


def test_the_floor_pushes_what_lies_on_it():
    """Without gravity the first step of the staircase gives the floor's velocity and feels it.

    A heap of two: the upper one touches the lower, and is pushed with it. They face upwards, away
    from the floor, so that no blow comes first.
    """
    step = int(np.ceil(np.arcsin(0.5 * WIDTH / AMPLITUDE) / OMEGA / DT))
    start = ((4, 0), (4, 1), (8, 5))
    automaton = ejecting(gravity=0.0, start=start)
    box = Shaken(automaton, 3, amplitude=AMPLITUDE, traced=step + 1)
    kind = box.state()[0]
    kind[kind == DOWN] = UP
    box.put(box.device.cells.kind, kind)
    box.run(step + 1)
    given = 2 * MASS * AMPLITUDE * OMEGA * np.cos(OMEGA * DT * step)
    impulse, _, momentum, _ = box.traces()[step, 0]
    assert not box.traces()[:step, 0, :3].any()
    assert momentum == pytest.approx(given, rel=1e-9)
    assert impulse == pytest.approx(-given, rel=1e-9)


def test_the_heap_lifts_off_where_the_container_falls_faster():
    """All mass is carried until x w^2 exceeds g, none while it does; pressed heaps stay carried."""
    steps, amplitude = 6 * 1667, 10e-3
    dead = paper(restitution=0.0, wall_restitution=0.0)
    box = Shaken(dead, 20, amplitude=amplitude, traced=steps).run(steps)
    carried = box.traces()[:, 0, 1]
    lifted = amplitude * np.sin(OMEGA * DT * np.arange(steps)) * OMEGA**2 > GRAVITY
    assert not carried[lifted].any()
    # Without rebound the heap is together again whenever it is let go.
    releases = np.flatnonzero(np.diff(lifted.astype(int)) == 1)[2:]
    assert len(releases) >= 3
    assert carried[releases] == pytest.approx(20 * MASS, rel=1e-9)
