"""Sweeps up through the frequencies and down again with continued state, to show hysteresis.

The frequency changes at the end of a cycle, when the base passes its middle: it keeps its place and
takes up its new speed at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from ca_damper.checks import check_run
from ca_damper.filling import Filling
from ca_damper.measures import MEASURE_UNITS
from ca_damper.oscillator import Oscillator
from ca_damper.progress import Stages
from ca_damper.report import Report
from ca_damper.response import Grid, Response
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.optional import optional
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName

if TYPE_CHECKING:
    from ca_damper.plot.response_plots import SweepPlots


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
    """

    up: Response
    down: Response
    report: Optional[Report] = None

    def __repr__(self):
        return in_brief(self, self.up.axes_in_words(), "up and down")

    @property
    def hysteresis(self) -> np.ndarray:
        """Difference of the RMS, (down - up) / larger of both [-], (particles, ratios, seeds)."""
        return (self.down.rms - self.up.rms) / np.maximum(self.down.rms, self.up.rms)

    def to_xarray(self) -> Any:
        """As ``Response.to_xarray``, over direction ("up", "down") too.

        Returns
        -------
        xarray.Dataset
            Units in the attributes of each variable.

        Raises
        ------
        InputError
            Where xarray is not installed.
        """
        xarray = optional("xarray")
        axis = xarray.Variable("direction", ["up", "down"])
        return xarray.concat([self.up.to_xarray(), self.down.to_xarray()], axis)

    @property
    def plot(self) -> "SweepPlots":
        """Pictures of the sweep: ``sweep.plot.hysteresis(path="hysteresis.png")``."""
        # Imported here, so that matplotlib loads only where a picture is drawn.
        from ca_damper.plot.response_plots import SweepPlots

        return SweepPlots(self)


def sweep_up_and_down(
    filling: Filling,
    *,
    particles: Union[int, Sequence[int]],
    ratios: Union[float, Sequence[float], np.ndarray],
    seeds: Union[int, Sequence[int]] = 5,
    oscillator: Optional[Oscillator] = None,
    dt: Optional[float] = None,
    transient_cycles: int = 60,
    measured_cycles: int = 20,
    start: str = "rest",
    progress: Union[Listener, str, None] = AUTO,
    checkpoint: Optional[Checkpoint] = None,
    resume: Optional[FileName] = None,
) -> Sweep:
    """Go up through the ratios and down again without a new start.

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

    Returns
    -------
    Sweep
        Responses of both directions.

    Raises
    ------
    InputError
        An argument is out of its range.
    SimulationDiverged
        All scenes left the range in which their numbers mean anything. Where some did, a warning
        tells which, and their results are nan.
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
        """Data for a checkpoint, (name, owner) pairs."""
        return ("way", self), ("up", self.up), ("down", self.down)

    def ends(self):
        """Shares of the remaining run at which each of the remaining ratios ends."""
        ahead = 2 * self.count - self.done
        return (np.arange(ahead) + 1.0) / max(1, ahead)

    def pending(self):
        """Numbers of the ratios that are not done, in order."""
        return [*range(self.count), *reversed(range(self.count))][self.done :]

    def record(self, k, batch, cycles):
        """Record the measures at ratio number k."""
        (self.up if self.done < self.count else self.down).record(k, batch, cycles)
        self.done += 1

    def saved(self):
        """Data for a checkpoint, arrays by name."""
        return {"done": np.array(self.done)}

    def resume(self, saved):
        """Restore the data that ``saved`` returned."""
        self.done = int(saved["done"])


class _Collected:
    """Measures of one direction, frequency by frequency."""

    def __init__(self, grid):
        self.grid = grid
        self.steps = np.zeros(len(grid.ratios), dtype=np.int32)
        self.values = {name: np.empty(grid.shape) for name in MEASURE_UNITS}

    def record(self, k, batch, cycles):
        """Record the measures at ratio number k."""
        particles, _, seeds = self.grid.shape
        self.steps[k] = batch.steps_per_cycle[0]
        for name, value in self.grid.measures(cycles).items():
            self.values[name][:, k] = value.reshape(particles, seeds)

    def saved(self):
        """Data for a checkpoint, arrays by name."""
        return {"steps": self.steps, **self.values}

    def resume(self, saved):
        """Restore the data that ``saved`` returned."""
        self.steps = saved["steps"]
        self.values = {name: saved[name] for name in MEASURE_UNITS}

    def response(self):
        """All of them."""
        return self.grid.response(self.steps, self.values)
