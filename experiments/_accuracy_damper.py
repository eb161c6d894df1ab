"""Questions to the damper with a tolerance, drawn at random, and what their answers should be.

    asked = damper_question(seed)
    answer = solve_response(**asked.arguments())
    truth = damper_reference(asked, answer)
    seconds = damper_fixed(asked)

Small scenes with short transients, so that a reference at a quarter of the step is affordable.
"""

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from _damper_reference import reference_values
from ca_damper import Automaton, Empty, Oscillator, RigidMass, Spheres, frequency_response, goals

PAPER = Automaton(rules="paper")
#: Fillings by how often they are drawn, in tenths.
FILLINGS = (
    *((Empty(), 1), (RigidMass(), 1), (Spheres(), 2), (PAPER, 3)),
    *((replace(PAPER, accounting=word), 1.5) for word in ("landing", "landing+ejection")),
)
#: CPU seconds that an answer may take, and a peak of spheres, which are dearer.
BUDGET_S, PEAK_OF_SPHERES_S = 4.0, 12.0
# The fixed job: cycles, ratios at a peak, seeds of an automaton and of other fillings.
_CYCLES, _RATIOS, _SEEDS = (150, 20), 33, (5, 1)


@dataclass(frozen=True)
class Question:
    """A question to ``solve_response``: goal at a tolerance, of a filling on an oscillator."""

    seed: int
    filling: Any
    particles: int
    oscillator: Oscillator
    goal: goals.Goal
    tolerance: float

    def arguments(self, **more):
        """Arguments of ``solve_response``; more: further ones."""
        names = "filling particles oscillator goal tolerance".split()
        given = {name: getattr(self, name) for name in names}
        dear = isinstance(self.filling, Spheres) and self.goal.kind == "extreme"
        budget_s = PEAK_OF_SPHERES_S if dear else BUDGET_S
        return {**given, "budget_s": budget_s, "progress": None, **more}

    def __str__(self):
        o, share = self.oscillator, 100.0 * self.tolerance
        places = f"{o.natural_frequency:.1f} Hz, damping {o.damping_ratio:.3f}"
        return (
            f"{self.seed}: {self.filling.label} x {self.particles}, {self.goal.name} to "
            f"{share:.2g} %, {places}, mass {o.mass:.3f} kg, y0 {1e3 * o.base_amplitude:.2f} mm"
        )


def damper_question(seed):
    """Question of a seed, always the same."""
    rng = np.random.default_rng([2604, seed])
    weights = np.array([weight for _, weight in FILLINGS], dtype=float)
    filling = FILLINGS[rng.choice(len(FILLINGS), p=weights / weights.sum())][0]
    most = 20 if isinstance(filling, Spheres) else 40
    particles = 0 if isinstance(filling, Empty) else int(rng.integers(3, most + 1))
    mass = 0.086 * 2.0 ** rng.uniform(-1.0, 1.0)
    omega = 2.0 * math.pi * rng.uniform(7.0, 12.0)
    damping = 2.0 * rng.uniform(0.02, 0.06) * mass * omega
    # Of the paper's acceleration of the base, 0.7 to 6 times, as there is more damping.
    base = 0.6e-3 * (37.9 / omega) ** 2 * 2.0 ** rng.uniform(-0.5, 2.5)
    oscillator = Oscillator(mass, mass * omega**2, damping, base)
    tolerance = float(10.0 ** rng.uniform(math.log10(0.003), -1.0))
    return Question(seed, filling, particles, oscillator, _goal(rng, filling), tolerance)


def _goal(rng, filling):
    """Goal at random; damping and mass of a filling that has any of its own."""
    ratio = round(float(rng.uniform(0.88, 1.06)), 3)
    extremes = [goals.peak_rms(), goals.peak_ratio()]
    if isinstance(filling, (Empty, RigidMass)):
        made = [*extremes, goals.rms_at(ratio)]
    else:
        values = goals.rms_at(ratio), goals.loss_factor_at(ratio), goals.apparent_mass_at(ratio)
        made = [*extremes, *values]
    return made[int(rng.integers(len(made)))]


def damper_reference(question, answer):
    """Value that the bar of an answer should hold: exact, or by seeds and steps of its own.

    A quarter of the answer's step and other seeds; an automaton's peak at half the spacing. Of
    several steady motions that nearest to the answer.
    """
    return float(np.mean(reference_values(question, answer)))


def damper_fixed(question):
    """CPU seconds of the usual job in place of an answer: fixed cycles, ratios, seeds and step.

    Measured over a few of its scenes, which cost the same each.
    """
    peak = question.goal.kind == "extreme"
    ratios = np.array([0.9, 1.0, 1.1]) if peak else np.array(question.goal.ratios)
    seeds = _SEEDS[not isinstance(question.filling, Automaton)]
    given = {"particles": question.particles, "oscillator": question.oscillator, "progress": None}
    job = {**given, "ratios": ratios, "seeds": 1, "transient_cycles": _CYCLES[0]}
    # Compiles.
    frequency_response(question.filling, **{**job, "transient_cycles": 0}, measured_cycles=1)
    began = time.process_time()
    frequency_response(question.filling, **job, measured_cycles=_CYCLES[1])
    return (time.process_time() - began) * seeds * (_RATIOS if peak else 1) / len(ratios)
