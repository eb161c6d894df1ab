"""Response of a filling over its step: error, cost, and the share of chance."""

from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from ca_damper.errors import SimulationDiverged
from ca_damper.filling import Filling
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import curve_distance, seed_variance
from ca_damper.runs.force_check import checked_response
from ca_damper.runs.response import Response, frequency_response
from ca_damper.scenes.gravity import gravity_along
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.plot_style import seconds
from taichi_dem.kit.study.work_precision import Point
from taichi_dem.kit.timing import Timing

#: Seeds of a reference are counted from here: a run that shares them would look too good.
FIRST_SEED = 1001
_run_seconds = attrgetter("report.run_seconds")


class StepStudy:
    """Responses of a filling with one number of particles at several steps, and a reference.

    name: of the method. job: arguments of ``frequency_response``; ratios and both numbers of cycles
    are needed. seeds: of the runs at each step.

    runs: Responses by step, one a repeat; failures: "refused" or "diverged" by step. reference: the
    result of ``make_reference`` or one that was kept, a dict: rms [m], (ratios, seeds), step,
    compile_s, force_check. roundoff: spread of the runs of ``measure_roundoff`` as a share of the
    peak. compile_s: of all runs but the reference.
    """

    def __init__(self, name: str, filling: Filling, particles: int, seeds: range, **job: Any):
        self.name, self.filling, self.particles, self.seeds = name, filling, particles, seeds
        self.job = {**job, "particles": particles}
        self.runs: dict[float, list[Response]] = {}
        self.failures: dict[float, str] = {}
        self.reference: dict[str, Any] = {}
        self.roundoff: float | None = None
        self.compile_s = 0.0

    def make_reference(self, dt: float, count: int) -> dict[str, Any]:
        """The reference at a step [s] by a number of seeds of its own, as JSON has it."""
        seeds = range(FIRST_SEED, FIRST_SEED + count)
        found, mismatch = checked_response(self.filling, dt=dt, seeds=seeds, **self.job)
        report: Any = found.report
        made = {"rms": found.rms[0].tolist(), "step": dt, "compile_s": report.compile_seconds}
        return {**made, "force_check": mismatch}

    def run(self, dt: float, repeats: int = 1, enough: float = np.inf) -> None:
        """Run a step [s] again and again for its timing, or note why it failed.

        enough: repeats end when they took so long together [s].
        """
        made: list[Response] = []
        try:
            self.filling.check(self.particles, dt)
            while len(made) < repeats and sum(map(_run_seconds, made)) < enough:
                made.append(self._response(dt=dt, seeds=self.seeds))
            if any(one.report and one.report.diverged for one in made):
                self.failures[dt] = "diverged"
            else:
                self.runs[dt] = made
        except (InputError, SimulationDiverged) as error:
            self.failures[dt] = "refused" if isinstance(error, InputError) else "diverged"

    def measure_roundoff(self, dt: float, count: int = 3) -> None:
        """Make runs at a step [s] whose bases' amplitudes differ by their last bits."""
        paper, rms = Oscillator(), []
        for k in range(count):
            amplitude = paper.base_amplitude + k * np.spacing(paper.base_amplitude)
            base = replace(paper, base_amplitude=amplitude)
            rms.append(self._response(dt=dt, seeds=1, oscillator=base).rms[0])
        self.roundoff = seed_variance(np.hstack(rms)) ** 0.5

    def _response(self, **job: Any) -> Response:
        found = frequency_response(self.filling, **job, **self.job)
        report: Any = found.report
        self.compile_s += report.compile_seconds
        return found

    @property
    def rms(self) -> np.ndarray:
        """Curve of the reference [m], (ratios, seeds)."""
        return np.array(self.reference["rms"])

    @property
    def mean(self) -> np.ndarray:
        """Curve of the reference, mean over its seeds [m], (ratios,)."""
        return self.rms.mean(axis=1)

    def curve(self, dt: float | None = None) -> np.ndarray:
        """Mean over the seeds at a step, the finest by default [m], (ratios,)."""
        return self.runs[dt or min(self.runs)][0].rms[0].mean(axis=1)

    def points(self, truth: np.ndarray) -> list[Point]:
        """Points with errors against a curve [m], coarse to fine.

        residual: share of the particles' weight that the mean force on the container misses.
        """
        weight = self.particles * self.filling.particle_mass * gravity_along(self.filling)
        cycles = self.job["transient_cycles"] + self.job["measured_cycles"]
        frequency = np.array(self.job["ratios"]) * Oscillator().natural_frequency
        scenes, found = self.particles * len(self.seeds) * cycles, []
        for dt in sorted([*self.runs, *self.failures], reverse=True):
            work = scenes * int(np.ceil(1.0 / (frequency * dt) * (1.0 - 1e-12)).sum())
            point = Point(self.name, dt, seconds(dt), work, failure=self.failures.get(dt, ""))
            if dt in self.runs:
                timing = Timing.of(map(_run_seconds, self.runs[dt]))
                missing = abs(float(self.runs[dt][0].mean_force.mean()) + weight) / weight
                error = curve_distance(self.curve(dt), truth)
                point = replace(point, error=error, seconds=timing, residual=missing)
            found.append(point)
        return found

    @property
    def floor(self) -> float:
        """Error expected from seeds alone, of a run against a reference of the same method.

        The variance from seed to seed is the mean over all runs of the method, as a single run may
        see one of several steady motions only.
        """
        return self.seed_spread * (1.0 / len(self.seeds) + 1.0 / self.rms.shape[1]) ** 0.5

    @property
    def seed_spread(self) -> float:
        """Standard deviation from seed to seed of a response, as a share of the peak."""
        runs = [self.rms, *(repeats[0].rms[0] for repeats in self.runs.values())]
        return float(np.mean([seed_variance(rms) for rms in runs]) ** 0.5)
