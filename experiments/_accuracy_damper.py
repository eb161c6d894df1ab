"""Questions to the damper with a tolerance, drawn at random, and what their answers should be.

    asked = damper_question(seed)
    answer = solve_response(**asked.arguments())
    truth = damper_reference(asked, answer)
    seconds = damper_fixed(asked)

Small scenes with short transients, so that a reference at a quarter of the step is affordable.
"""

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper import Automaton, Empty, Oscillator, RigidMass, Spheres, frequency_response, goals

#: Fillings by how often they are drawn, in tenths.
FILLINGS = (
    *((Empty(), 1), (RigidMass(), 1), (Spheres(), 2), (Automaton(), 3)),
    *((Automaton(accounting="landing"), 1.5), (Automaton(accounting="landing+ejection"), 1.5)),
)
#: CPU seconds that an answer may take.
BUDGET_S = 4.0
# A reference: first seed, cycles; step of the answer by its own, and at a peak of spheres.
_FIRST_SEED, _TRANSIENT, _MEASURED, _FINER, _PEAK_OF_SPHERES = 1001, 120, 80, 4, 2
# Its seeds, as many as come to so many steps, between these.
_STEPS, _FEWEST, _MOST = 12_000_000, 3, 16
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
        return {**given, "budget_s": BUDGET_S, "progress": None, **more}

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


def reference_values(question, answer):
    """Independent values whose mean is the reference, one a seed."""
    if isinstance(question.filling, (Empty, RigidMass)):
        return np.array([_exact(question)])
    goal, ratios, finer = question.goal, answer.result.ratios, _FINER
    if goal.kind == "extreme" and isinstance(question.filling, Spheres):
        finer = _PEAK_OF_SPHERES
    elif goal.kind == "extreme":
        step = np.diff(ratios).min() / 2.0
        ratios = np.arange(ratios[0], ratios[-1] + 0.5 * step, step)
    cycles = len(ratios) * (_TRANSIENT + _MEASURED)
    steps = cycles * finer * float(answer.result.steps_per_cycle.max())
    count = min(_MOST, max(_FEWEST, round(_STEPS / steps)))
    found = _run(question, ratios, range(_FIRST_SEED, _FIRST_SEED + count), answer, finer)
    branches = getattr(answer, "branches", ())
    if goal.kind == "extreme" and not branches:
        return _without_one(found, goal)
    values = goal.values(found)[:, 0]
    values = values[np.isfinite(values)]
    centres = [branch.value for branch in branches] or [answer.value]
    own = np.abs(values[:, None] - centres).argmin(axis=1) == 0
    return values[own] if own.any() else values


def _run(question, ratios, seeds, answer, finer):
    return frequency_response(
        question.filling,
        particles=question.particles,
        ratios=ratios,
        seeds=seeds,
        oscillator=question.oscillator,
        dt=float(answer.result.dt.max()) / finer,
        transient_cycles=_TRANSIENT,
        measured_cycles=_MEASURED,
        progress=None,
    )


def _without_one(found, goal):
    """Jackknife of the peak of the mean curve, smoothed by a polynomial of 1 / RMS^2, (seeds,)."""
    curves = found.rms[0].T
    count, whole = len(curves), _top(found.ratios, curves.mean(axis=0), goal)
    less = [
        _top(found.ratios, np.delete(curves, k, axis=0).mean(axis=0), goal) for k in range(count)
    ]
    return count * whole - (count - 1) * np.array(less)


def _top(ratios, curve, goal):
    square = ratios**2
    x = (square - square.mean()) / np.ptp(square)
    fit = np.polynomial.Polynomial.fit(x, curve**-2.0, min(4, len(x) - 1))
    place = np.linspace(x[0], x[-1], 4001)
    low = fit(place)
    k = int(low.argmin())
    at_peak = math.sqrt(square.mean() + np.ptp(square) * place[k]), low[k] ** -0.5
    return at_peak[goal.unit == "m"]


def _exact(question):
    """Exact value of a goal of a filling that is a mass and nothing else."""
    o, goal = question.oscillator, question.goal
    mass = question.particles * question.filling.particle_mass
    if goal.kind == "extreme":
        return o.peak(mass)[goal.unit == "m"]
    return float(o.rms(goal.ratios[0] * o.natural_frequency, mass))


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
