"""Sweeps up through the frequencies and down again, the state carried on, to show hysteresis.

The frequency changes at the end of a cycle, when the base passes its middle: it keeps its place and
takes up its new speed at once.
"""

from dataclasses import dataclass
from typing import Optional

import numpy as np

from ca_damper.checks import check_run
from ca_damper.progress import Stages
from ca_damper.report import Report
from ca_damper.response import UNITS, Grid, Response
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO


@dataclass(frozen=True, eq=False)
class Sweep:
    """Responses on the way up and on the way down, both with ascending ratios.

    report: what was done on both and what it cost.
    """

    up: Response
    down: Response
    report: Optional[Report] = None

    def __repr__(self):
        return in_brief(self, self.up.axes_in_words(), "up and down")

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
    progress=AUTO,
    checkpoint=None,
    resume=None,
):
    """Go up through the ratios and down again without a new start; returns a Sweep.

    transient_cycles: at each frequency, before the measured ones. The other arguments and errors
    are those of ``frequency_response``.
    """
    grid = Grid(filling, particles, ratios, seeds, oscillator, dt)
    check_run(transient_cycles, start, progress)
    way = _Way(grid)
    with reporting(progress, "sweep") as report_progress:
        batch = grid.batch(grid.ratios[:1], measured_cycles)
        batch.start(start)
        job = f"sweep, {grid.words()}, {transient_cycles} + {measured_cycles} cycles from {start}"
        with batch.checkpointed(
            checkpoint, resume, {"job": job}, way.checkpoint_owners()
        ) as writer:
            tell = Stages(report_progress, way.ends())
            for k in way.pending():
                if not batch.going_on:
                    batch.drive(grid.ratios[k] * grid.oscillator.natural_frequency)
                cycles = batch.run(transient_cycles, measured_cycles, tell)
                way.record(k, batch, cycles)
            writer.save()
    return Sweep(way.up.response(), way.down.response(), batch.report())


class _Way:
    """The ratios of a sweep, up and down, and how many of them are done."""

    def __init__(self, grid):
        self.up, self.down, self.done = _Collected(grid), _Collected(grid), 0
        self.count = len(grid.ratios)

    def checkpoint_owners(self):
        """What a checkpoint holds of it."""
        return ("way", self), ("up", self.up), ("down", self.down)

    def ends(self):
        """Shares of what was ahead at which each ratio that was not done ends."""
        ahead = 2 * self.count - self.done
        return (np.arange(ahead) + 1.0) / max(1, ahead)

    def pending(self):
        """Numbers of the ratios that are not done, in order."""
        return [*range(self.count), *reversed(range(self.count))][self.done :]

    def record(self, k, batch, cycles):
        """Take what was measured at ratio number k."""
        (self.up if self.done < self.count else self.down).record(k, batch, cycles)
        self.done += 1

    def saved(self):
        """What a checkpoint holds of it, arrays by name."""
        return {"done": np.array(self.done)}

    def resume(self, saved):
        """Take over what ``saved`` gave."""
        self.done = int(saved["done"])


class _Collected:
    """Measures of one way, frequency by frequency."""

    def __init__(self, grid):
        self.grid = grid
        self.steps = np.zeros(len(grid.ratios), dtype=np.int32)
        self.values = {name: np.empty(grid.shape) for name in UNITS}

    def record(self, k, batch, cycles):
        """Take what was measured at ratio number k."""
        particles, _, seeds = self.grid.shape
        self.steps[k] = batch.steps_per_cycle[0]
        for name, value in self.grid.measures(cycles).items():
            self.values[name][:, k] = value.reshape(particles, seeds)

    def saved(self):
        """What a checkpoint holds of it, arrays by name."""
        return {"steps": self.steps, **self.values}

    def resume(self, saved):
        """Take over what ``saved`` gave."""
        self.steps = saved["steps"]
        self.values = {name: saved[name] for name in UNITS}

    def response(self):
        """All of them."""
        return self.grid.response(self.steps, self.values)
