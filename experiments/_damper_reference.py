"""What answers to the damper should be: exact values, or those of finer and longer runs."""

import math

import numpy as np

from ca_damper import Empty, RigidMass, Spheres, frequency_response

# A reference: first seed, cycles; step of the answer by its own, and at a peak of spheres.
_FIRST_SEED, _TRANSIENT, _MEASURED, _FINER, _PEAK_OF_SPHERES = 1001, 120, 80, 4, 2
# Seeds of a round of it, as many as come to so many steps, between these; rounds at most, and
# standard error by half the bar at which they end.
_STEPS, _FEWEST, _MOST, _ROUNDS, _SHARP = 8_000_000, 3, 12, 3, 0.3


def reference_values(question, answer):
    """Independent values whose mean is the reference, one a seed; more where the bar is narrow."""
    if isinstance(question.filling, (Empty, RigidMass)):
        return np.array([_exact(question)])
    ratios, finer = _places(question, answer)
    steps = len(ratios) * (_TRANSIENT + _MEASURED) * finer
    steps *= float(answer.result.steps_per_cycle.max())
    count = min(_MOST, max(_FEWEST, round(_STEPS / steps)))
    values = np.empty(0)
    for first in range(_FIRST_SEED, _FIRST_SEED + _ROUNDS * count, count):
        found = _run(question, ratios, range(first, first + count), answer, finer)
        values = np.concatenate([values, _values_of(found, question.goal, answer)])
        if values.std() <= _SHARP * answer.error * math.sqrt(len(values)):
            break
    return values


def _places(question, answer):
    """Ratios of a reference, and how much finer its step is."""
    ratios = answer.result.ratios
    if question.goal.kind != "extreme":
        return ratios, _FINER
    if isinstance(question.filling, Spheres):
        return ratios, _PEAK_OF_SPHERES
    step = np.diff(ratios).min() / 2.0
    return np.arange(ratios[0], ratios[-1] + 0.5 * step, step), _FINER


def _values_of(found, goal, answer):
    """Values of a goal, one a seed; of several motions those of the answer's, if there are any."""
    branches = answer.branches
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
    fit = np.polynomial.Polynomial.fit(x, curve**-2.0, min(4, len(x) // 2 + 1))
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
