"""Sweeps up through the frequencies and down again, the state carried on, to show hysteresis.

The frequency changes at the end of a cycle, when the base passes its middle: it keeps its place and
takes up its new speed at once.
"""

from dataclasses import dataclass

import numpy as np

from ca_damper.progress import Stages
from ca_damper.response import UNITS, Grid, Response


@dataclass(frozen=True, eq=False)
class Sweep:
    """Responses on the way up and on the way down, both with ascending ratios."""

    up: Response
    down: Response

    @property
    def hysteresis(self):
        """By how much the RMS differs, (down - up) / larger of both; (particles, ratios, seeds)."""
        return (self.down.rms - self.up.rms) / np.maximum(self.down.rms, self.up.rms)


def sweep_up_and_down(
    filling,
    *,
    particles,
    ratios,
    seeds=5,
    oscillator=None,
    dt=None,
    transient_cycles=60,
    measured_cycles=20,
    start="rest",
    progress=None,
):
    """Go up through the ratios and down again without a new start; returns a Sweep.

    transient_cycles: at each frequency, before the measured ones. The other arguments and errors
    are those of ``frequency_response``.
    """
    grid = Grid(filling, particles, ratios, seeds, oscillator, dt)
    batch = grid.batch(grid.ratios[:1], measured_cycles)
    batch.start(start)
    way = [*range(len(grid.ratios)), *reversed(range(len(grid.ratios)))]
    up, down = _Collected(grid), _Collected(grid)
    tell = Stages(progress, (np.arange(len(way)) + 1.0) / len(way))
    for stage, k in enumerate(way):
        batch.drive(grid.ratios[k] * grid.oscillator.natural_frequency)
        cycles = batch.run(transient_cycles, measured_cycles, tell)
        (up if stage < len(grid.ratios) else down).keep(k, batch, cycles)
    return Sweep(up.response(), down.response())


class _Collected:
    """Measures of one way, frequency by frequency."""

    def __init__(self, grid):
        self.grid = grid
        self.steps = np.zeros(len(grid.ratios), dtype=np.int32)
        self.values = {name: np.empty(grid.shape) for name in UNITS}

    def keep(self, k, batch, cycles):
        """Take what was measured at ratio number k."""
        particles, _, seeds = self.grid.shape
        self.steps[k] = batch.steps_per_cycle[0]
        for name, value in self.grid.measures(cycles).items():
            self.values[name][:, k] = value.reshape(particles, seeds)

    def response(self):
        """All of them."""
        return self.grid.response(self.steps, self.values)
