"""Dampers of tests: rules of the paper, bounds of rounding, a response made up without a run."""

import contextlib
import dataclasses
from functools import partial

import numpy as np
import pytest

from ca_damper import Automaton, Oscillator, Paper, Response
from ca_damper.automaton.accounting import QUANTUM
from ca_damper.report.certificate import checked_range
from ca_damper.report.measures import MEASURE_UNITS

_EPS = np.finfo(float).eps
#: An Automaton with other options than the rules.
paper = partial(Automaton, Paper())
#: The same where landings and pushes alone act on the container.
ejecting = partial(Automaton, Paper("landing+ejection"))
#: Frequencies f/f0 of ``response``.
RATIOS = np.linspace(0.9, 1.1, 41)


def outside():
    """Expect the warning of a run of the paper's rules where they are known to fail."""
    return pytest.warns(UserWarning, match="rules 'paper' of the automaton are known to fail with")


def expected(batch):
    """Expect that warning where the range that a batch was checked in asks for it, or nothing."""
    found = checked_range(batch)
    return outside() if found is not None and found.warning else contextlib.nullcontext()


def momentum_rounding(batch):
    """Largest share of the momentum exchanged that rounding may leave open in a scene of a batch.

    The automaton rounds a particle's blow and its entries to half a quantum, at most three times a
    step; sums of n terms round by n eps of their magnitude, at most some m/s times the mass.
    """
    exchanged = batch.engine.table.in_use(batch.engine.account.exchanged)
    steps = batch.engine.table.in_use(batch.engine.coupling.step)
    mass = batch.table.column("particles") * batch.fillings.of_scenes(lambda one: one.particle_mass)
    rounding = mass * 1.5 * QUANTUM * steps + 4.0 * _EPS * steps * (exchanged + 10.0 * mass)
    return float((rounding / np.maximum(exchanged, 1e-300)).max())


def response(particles=(0, 10), ratios=RATIOS, seeds=(1, 2), rms=None, **others):
    """Response of a rigid mass of 0.2 g a particle; the second seed swings by 1 % more."""
    oscillator = Oscillator()
    if rms is None:
        frequency = np.asarray(ratios) * oscillator.natural_frequency
        gain = [np.abs(oscillator.transfer(frequency, 0.2e-3 * n)) for n in particles]
        rms = np.array(gain)[:, :, None] * oscillator.base_amplitude / np.sqrt(2.0)
        rms = rms * (1.0 + 0.01 * np.arange(len(seeds)))
    measures = {**dict.fromkeys(MEASURE_UNITS, np.zeros_like(rms)), "rms": rms}
    steps = np.full(len(ratios), 100)
    given = Response("rigid", oscillator, particles, ratios, seeds, steps, **measures)
    return dataclasses.replace(given, **others)
