"""Bars hold the mean of endless runs as often as they say: of seeds that differ and wander."""

import math

import numpy as np
import pytest

from ca_damper import Automaton, Oscillator, goals
from ca_damper.accuracy.steady_motions import SteadyMotions
from ca_damper.report.measures import MEASURE_UNITS
from taichi_dem.kit.bars.runs import Question
from taichi_dem.kit.bars.search import Search


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

    def longest(self):
        return max(map(len, self.records.values()))

    def seconds(self, cycles):
        return 0.0

    def steps_per_cycle(self, ratio, dt):
        return 100

    def go_on(self, cycles):
        for key, count in cycles.items():
            # As a scene at half the step goes on from where it is.
            coarser = self.draws.get(key.coarser)
            draw = self.draws.setdefault(key, coarser or self.make(self.rng))
            before = self.records.get(key, np.empty(0))
            more = np.array([draw() for _ in range(count)])
            self.records[key] = np.concatenate([before, more])

    def measures(self, key, begin):
        return dict.fromkeys(MEASURE_UNITS, self.records[key][begin:][None].mean(axis=1))

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
    runs = DrawnRuns(make, np.random.default_rng(seed))
    question = Question((goals.rms_at(1.0),), tolerance)
    (found,) = Search(question, SteadyMotions(question, runs)).answers()
    return found.value, found.error, bool(found.branches)


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
