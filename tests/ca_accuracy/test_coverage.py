"""Bars hold the mean of endless runs as often as they say: of seeds that differ and wander."""

import math

import numpy as np
import pytest

from ca_damper import Automaton, Goal, Oscillator, goals
from ca_damper.accuracy.estimate import SeedValues, estimate
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.search import Search
from ca_damper.report.measures import MEASURE_UNITS


class DrawnRuns:
    """Stands for SceneRuns: draw(random numbers, cycles gone, cycles) gives values a cycle."""

    filling, particles, oscillator, cpu_s = Automaton(), 10, Oscillator(), 0.0

    def __init__(self, make, rng):
        self.make, self.rng, self.draws, self.records = make, rng, {}, {}

    @property
    def runs(self):
        return len(self.records)

    @property
    def steps(self):
        return sum(map(len, self.records.values()))

    def cycles(self, key):
        return len(self.records.get(key, ()))

    def steps_per_cycle(self, ratio, dt):
        return 100

    def go_on(self, cycles):
        for key, count in cycles.items():
            draw = self.draws.setdefault(key, self.make(self.rng))
            before = self.records.get(key, np.empty(0))
            more = np.array([draw() for _ in range(count)])
            self.records[key] = np.concatenate([before, more])

    def measures(self, key, begin, leave_out=0):
        kept = self.records[key][begin:]
        if not leave_out:
            return dict.fromkeys(MEASURE_UNITS, kept[None].mean(axis=1))
        parts = kept[len(kept) % leave_out :].reshape(leave_out, -1)
        others = (parts.sum() - parts.sum(axis=1)) / (parts.size - parts.shape[1])
        return dict.fromkeys(MEASURE_UNITS, others)

    def by_cycle(self, key):
        return dict.fromkeys(MEASURE_UNITS, self.records[key])


def own_places(apart, noise):
    """Each seed about a place of its own, for ever; the mean is 1."""

    def make(rng):
        place = 1.0 + apart * rng.normal()
        return lambda: place + noise * rng.normal()

    return make


def two_motions(fall, rise, low=0.7, noise=0.02):
    """Seeds that begin at 1 and go to and fro between 1 and low, by probabilities a cycle."""

    def make(rng):
        state = [True]

        def draw():
            state[0] = rng.random() >= fall if state[0] else rng.random() < rise
            return (1.0 if state[0] else low) + noise * rng.normal()

        return draw

    return make


def asked(make, seed, tolerance):
    """(value, half-width, whether branched) of rms at f0, of drawn runs."""
    job = Job(Automaton(), 10, Oscillator(), (goals.rms_at(1.0),), tolerance)
    (found,) = Search(job, DrawnRuns(make, np.random.default_rng(seed)), 2e-4).run()
    is_branched = len(found.clusters(tolerance)) > 1
    return float(found.value[0]), float(found.parts.total[0]), is_branched


def share_held(make, mean, count, tolerance):
    """Number of bars that hold the mean, and of all; a branched answer states none."""
    found = [asked(make, seed, tolerance) for seed in range(count)]
    told = [(value, half) for value, half, branched in found if not branched]
    return sum(math.fabs(value - mean) <= half for value, half in told), len(told)


COUNT = 30
CASES = {
    "own places": (own_places(0.1, 0.02), 1.0, 0.06),
    "all leave a motion": (two_motions(1 / 150, 0.0), 0.7, 0.05),
}


@pytest.mark.parametrize("case", CASES)
def test_nearly_all_bars_hold(case):
    """95 % of 30 are 28.5, and three standard deviations fewer 24.9; none falls out of its level.

    Answers that say that there are several motions state no number; half of all are numbers.
    """
    make, mean, tolerance = CASES[case]
    held, told = share_held(make, mean, COUNT, tolerance)
    assert told >= COUNT // 2
    assert held >= 0.95 * told - 3.0 * math.sqrt(0.95 * 0.05 * told)


GOAL = Goal("any", "m", lambda found: found.rms[0, 0], "extreme")
NOTHING = np.zeros(1)


def values_of(rng, seeds, between, within, mean=1.0):
    """A value of each seed; its variance by sampling known from 7 degrees of freedom a seed."""
    made = mean + between * rng.normal(size=(seeds, 1)) + within * rng.normal(size=(seeds, 1))
    freedom = 7 * seeds
    variance = np.array([within**2 * rng.chisquare(freedom) / freedom])
    return SeedValues(made, variance, freedom, NOTHING)


@pytest.mark.parametrize(
    ("between", "within", "seeds"), [(0.0, 0.01, 3), (0.02, 0.001, 3), (0.0, 0.0, 3)]
)
def test_a_bar_of_seeds_and_sampling_holds_the_mean(between, within, seeds):
    """400 cases: 95 % is 380 with a standard deviation of 4.4."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(400):
        found = values_of(rng, seeds, between, within)
        sampling, chance = found.bars(0.95)
        held += bool(abs(found.mean[0] - 1.0) <= np.hypot(sampling, chance)[0] + 1e-12)
    assert 366 <= held <= 400


def test_a_bar_holds_the_limit_where_the_step_s_error_is_like_that_of_chance():
    """1200 cases, standard deviation 0.6 %; squares of both parts alone would hold it in 89 %."""
    rng, sigma, steps = np.random.default_rng(4), 0.01, (1.0, 2.0, 4.0)
    held = []
    for shift in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0):
        for _ in range(200):
            means = 1.0 + sigma * (shift * np.array(steps) + rng.normal(size=3))
            one = np.array([sigma**2])
            levels = [SeedValues(np.array([[mean]]), one, 200, NOTHING) for mean in means]
            found = estimate(GOAL, steps, levels, NOTHING, 0.95)
            held.append(bool(abs(found.value[0] - 1.0) <= found.parts.total[0]))
    assert 0.93 <= np.mean(held) <= 0.97


@pytest.mark.parametrize("steps", [(1.0, 2.0), (1.0, 2.0, 4.0)])
def test_two_steps_support_no_bar_below_a_third_of_the_tolerance(steps):
    """Three that agree do: their error is that of their changes, of first order."""
    levels = [SeedValues(np.array([[2.0 + 1e-6 * k]]), np.zeros(1), 200, NOTHING) for k in steps]
    found = estimate(GOAL, steps, levels, NOTHING, 0.95, tolerance=0.03)
    third = 0.03 * found.value[0] / 3.0
    assert found.parts.step[0] == pytest.approx(third if len(steps) == 2 else 1.25e-6)
    assert found.parts.total[0] <= found.allowed(0.03)
