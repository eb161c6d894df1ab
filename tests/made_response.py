"""A response made up without a run: that of a rigid mass, in closed form."""

import dataclasses

import numpy as np

from ca_damper import Oscillator, Response
from ca_damper.report.measures import MEASURE_UNITS

RATIOS = np.linspace(0.9, 1.1, 41)


def response(particles=(0, 10), ratios=RATIOS, seeds=(1, 2), rms=None, **others):
    """Of a rigid mass of 0.2 g a particle; the second seed swings by 1 % more."""
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
