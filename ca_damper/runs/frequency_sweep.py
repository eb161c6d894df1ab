"""Sweeps up and down through the frequencies with continued state, to show hysteresis."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.filling import Filling
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import MEASURE_UNITS
from ca_damper.report.progress import Stages
from ca_damper.report.report import Report
from ca_damper.report.steady_state import ROUNDING, half_width
from ca_damper.runs.response import Grid, Response, stacked
from ca_damper.scenes.checks import check_run
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName

# Half-width of the RMS by its cycles, beside the measures.
_ERROR = "rms_error"


@dataclass(frozen=True, eq=False)
class Sweep:
    """Responses of the upward and the downward sweep, both with ascending ratios.

    Parameters
    ----------
    up : Response
        Response of the upward sweep.
    down : Response
        Response of the downward sweep.
    report : Report, optional
        Figures and cost of both.
    up_error : ndarray, optional
        Half-width of the upward RMS by its cycles [m], of the shape of the RMS; infinite where the
        mean still changes or has too few cycles to tell, None where it was not measured.
    down_error : ndarray, optional
        The same of the downward sweep [m].
    """

    up: Response
    down: Response
    report: Report | None = None
    up_error: np.ndarray | None = None
    down_error: np.ndarray | None = None

    def __repr__(self):
        shows = self.shows_hysteresis
        words = f"hysteresis beyond chance at {shows.sum()} of {shows.size} points"
        return in_brief(self, self.up.axes_in_words(), "up and down", words)

    @property
    def hysteresis(self) -> np.ndarray:
        """Difference of the RMS, (down - up) / larger of both [-], (particles, ratios, seeds)."""
        return (self.down.rms - self.up.rms) / np.maximum(self.down.rms, self.up.rms)

    @property
    def hysteresis_error(self) -> np.ndarray:
        """Half-width of the mean of ``hysteresis`` over the seeds, (particles, ratios), at 95 %.

        It holds at all frequencies of a particle number together. Infinite where a mean still
        changes, or was measured in too few cycles (``LEAST_TESTED``) or seeds.
        """
        count, places = len(self.up.seeds), len(self.up.ratios)
        by_cycles = np.sqrt((self._share_by_cycles**2).sum(axis=2)) / count
        if count < 2:
            return by_cycles
        t = t_quantile(1.0 - 0.05 / places, count - 1)
        return np.maximum(by_cycles, t * self.hysteresis.std(axis=2, ddof=1) / math.sqrt(count))

    @property
    def shows_hysteresis(self) -> np.ndarray:
        """Whether the mean over the seeds is beyond chance and rounding, (particles, ratios)."""
        return np.abs(self.hysteresis.mean(axis=2)) > np.maximum(self.hysteresis_error, ROUNDING)

    @property
    def _share_by_cycles(self):
        """Half-width of the hysteresis of each seed by its cycles, (particles, ratios, seeds)."""
        if self.up_error is None or self.down_error is None:
            unknown = np.inf if len(self.up.seeds) < 2 else 0.0
            return np.full(self.up.rms.shape, unknown)
        size = np.maximum(self.down.rms, self.up.rms)
        return np.hypot(self.up_error, self.down_error) / size

    def to_xarray(self) -> Any:
        """As ``Response.to_xarray``, over direction ("up", "down") too."""
        return stacked((self.up, self.down), "direction", ["up", "down"])

    @property
    def plot(self) -> Any:
        """Pictures of the sweep: ``sweep.plot.hysteresis(path="hysteresis.png")``."""
        # Imported here, so that matplotlib loads only where a picture is drawn.
        from ca_damper.plot.curves import SweepPlots

        return SweepPlots(self)


def sweep_up_and_down(
    filling: Filling,
    *,
    particles: int | Sequence[int],
    ratios: float | Sequence[float] | np.ndarray,
    seeds: int | Sequence[int] = 5,
    oscillator: Oscillator | None = None,
    dt: float | None = None,
    transient_cycles: int = 60,
    measured_cycles: int = 20,
    start: str = "rest",
    progress: Listener | str | None = AUTO,
    checkpoint: Checkpoint | None = None,
    resume: FileName | None = None,
) -> Sweep:
    """Sweep up through the ratios and down again without a new start.

    Parameters
    ----------
    filling : Filling
        As in ``frequency_response``, likewise all that follow.
    particles : int or sequence of int
        Numbers of particles, one or several.
    ratios : float or sequence of float or ndarray
        Ascending frequency ratios f/f0 [-].
    seeds : int or sequence of int, default 5
        Number of seeds, counted from 1, or the seeds themselves.
    oscillator : Oscillator, optional
        Primary structure; that of the paper if None.
    dt : float, optional
        Largest step [s]; that of the filling if None.
    transient_cycles : int, default 60
        Cycles at each frequency before the measured ones.
    measured_cycles : int, default 20
        Cycles to measure at each frequency.
    start : str, default "rest"
        Motion of the container at the beginning.
    progress : callable or str or None, default "auto"
        ``"auto"``, None or a function.
    checkpoint : Checkpoint, optional
        Where and when the run saves itself.
    resume : path, optional
        Checkpoint to go on from.

    Raises
    ------
    SimulationDiverged
        All scenes diverged. If only some do, a warning names them, and their results are nan.
    """
    grid = Grid(filling, particles, ratios, seeds, oscillator, dt)
    check_run(transient_cycles, measured_cycles, start, progress)
    ways = _Ways(grid)
    with reporting(progress, "sweep") as report_progress:
        batch = grid.batch(grid.ratios[:1], measured_cycles)
        batch.start(start)
        job = f"sweep, {transient_cycles} + {measured_cycles} cycles from {start}"
        identity = {"job": f"{job}, {grid.identity()}"}
        with batch.checkpointed(checkpoint, resume, identity, {"ways": ways}) as writer:
            pending = ways.order[ways.done :]
            ends = [(k + 1.0) / len(pending) for k in range(len(pending))]
            tell = Stages(report_progress, ends)
            for _, k in pending:
                if not batch.going_on:
                    batch.drive(grid.ratios[k] * grid.oscillator.natural_frequency)
                ways.record(batch, batch.run(transient_cycles, measured_cycles, tell))
            responses = ways.response(0), ways.response(1)
            sweep = Sweep(*responses, batch.report(), *ways.values[_ERROR])
            writer.save(sweep)
    return sweep


class _Ways:
    """Measures of both directions, frequency by frequency; how many of them are done."""

    def __init__(self, grid):
        self.grid, self.done, count = grid, 0, len(grid.ratios)
        self.order = [(0, k) for k in range(count)] + [(1, k) for k in reversed(range(count))]
        self.steps = np.zeros((2, count), dtype=np.int32)
        self.values = {name: np.empty((2, *grid.shape)) for name in (*MEASURE_UNITS, _ERROR)}

    def record(self, batch, cycles):
        """Record the measures at the next frequency; half-widths hold at all of them together."""
        direction, k = self.order[self.done]
        confidence = 1.0 - 0.05 / len(self.grid.ratios)
        errors = np.array([half_width(row, confidence) for row in cycles.rms_by_cycle])
        for name, value in {**self.grid.measures(cycles), _ERROR: errors}.items():
            self.values[name][direction, :, k] = value.reshape(-1, len(self.grid.seeds))
        self.steps[direction, k] = batch.steps_per_cycle[0]
        self.done += 1

    def saved(self):
        return {"done": np.array(self.done), "steps": self.steps, **self.values}

    def resume(self, saved):
        self.done, self.steps = int(saved["done"]), saved["steps"]
        self.values = {name: saved[name] for name in self.values}

    def response(self, direction):
        measures = {name: self.values[name][direction] for name in MEASURE_UNITS}
        return self.grid.response(self.steps[direction], measures)
