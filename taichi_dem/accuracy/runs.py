"""Runs of one question: by level of the step, and twins that differ by one rounding."""

import math
from typing import Any

import numpy as np

from taichi_dem.accuracy.job import Job
from taichi_dem.kit.display import counted
from taichi_dem.kit.progress.progress import Listener, Progress
from taichi_dem.kit.study.timing import clock
from taichi_dem.output.record import Frame
from taichi_dem.result import Result
from taichi_dem.simulate import result_of, run_simulation
from taichi_dem.simulation import Simulation

_EPSILON = np.finfo(np.float64).eps
#: How far a twin's bodies are displaced at the start, as a share of the size of the solid.
_ROUNDING = 1e-12
#: Share of the whole that the first run is taken for.
_GROWTH = 0.3
#: Frames of a run, at which twins are compared.
_FRAMES = 32


class Runs:
    """Runs that were made, each once.

    seconds: CPU time of all so far, without compiling [s]. count: their number. results, cost: by
    level of the step, Result of the undisturbed run and CPU time [s] of the first. failure: the
    sentence of the last run that diverged.
    """

    def __init__(self, job: Job, listen: Listener | None):
        self.job, self._listen = job, listen
        self.seconds, self.count, self.failure = 0.0, 0, ""
        self.results: dict[int, Result] = {}
        self.cost: dict[int, float] = {}
        self._simulation: Simulation | None = None
        self._known: dict[tuple[int, int, bool], float | None] = {}

    def value(self, level: int, twin: int = 0, tight: bool = False) -> Any:
        """Goal of a run at a level; None for one that diverged.

        twin: 0 for the scene as it is, else the seed of its disturbance. tight: see
        ``Job.method``.
        """
        key = level, twin, tight
        if key not in self._known:
            result = self._timed(*key)
            self.failure = result.diverged or self.failure
            if not (twin or tight or result.diverged):
                self.results[level] = result
            self._known[key] = None if result.diverged else self.job.goal.value(result)
        return self._known[key]

    def parting(self, level: int) -> float:
        """Time at which a twin has left the run at a level by the tolerance [s]; infinite if never.

        By the way of a usual body, to a fraction of the run. Makes two runs.
        """
        one, two = (self.frames(level, twin) for twin in (0, 1))
        for frame, other in zip(one[1:], two[1:]):
            if _apart(other, frame) > self.job.tolerance:
                return float(frame.time_s)
        return math.inf

    def frames(self, level: int, twin: int) -> tuple[Frame, ...]:
        """Frames of a run at a level, made for them."""
        return self._timed(level, twin, False, _FRAMES).frames

    def change(self, coarse: int, fine: int) -> float:
        """Difference of the displacements of all bodies at two levels, as a share of the finer."""
        return _apart(self.results[coarse].frames[-1], self.results[fine].frames[-1])

    def peak_change(self, coarse: int, fine: int) -> float:
        """Difference of a usual body's largest speed at two levels, as a share of the finer."""
        slower, faster = (self.results[level].peak_speed for level in (coarse, fine))
        return _share(np.abs(slower - faster), faster, _EPSILON * faster.max())

    def leap(self, coarse: int, fine: int) -> float:
        """Change of a number of broken faces between two levels that may go unseen, as a share.

        Faces that broke in one of the runs only, taken to add up like steps to either side.
        """
        first, second = (np.isnan(self.results[level].broken_time) for level in (coarse, fine))
        return math.sqrt((first != second).sum()) / max(1, int((~second).sum()))

    def same_breaks(self, coarse: int, fine: int) -> bool:
        """Whether the same faces broke at two levels."""
        broken = (~np.isnan(self.results[level].broken_time) for level in (coarse, fine))
        return np.array_equal(*broken)

    def _timed(self, level, twin, tight, frames=1):
        """Result of a run, whose CPU time is added to the sum."""
        started = clock()
        brief = bool(twin or tight or not self.count or frames > 1)
        result = self._simulated(level, twin, tight, frames, brief)
        spent = clock() - started
        if not self.count:
            # Kernels are compiled, or loaded, before the first run's first step.
            spent = max(spent - result.report.compile_seconds, result.report.run_cpu_seconds)
        self.seconds, self.count = self.seconds + spent, self.count + 1
        self.cost.setdefault(level, spent)
        if self._listen is not None:
            share = 1.0 - 1.0 / (1.0 + _GROWTH * self.count)
            self._listen(Progress(share, self.seconds, "stepping", counted(self.count, "run")))
        return result

    def _simulated(self, level, twin, tight, frames, brief):
        """Result of a run; the simulation of the first is used again, which is not set up anew."""
        method = self.job.method(level, tight)
        if self._simulation is None:
            self._simulation = Simulation(self.job.scene, method)
        else:
            self._simulation.reset(method=method)
        simulation = self._simulation
        if twin:
            simulation.state.set_motion(**_displaced(simulation, twin))
        looks: Any = {"samples": self.job.rows(level), "frames": frames, "progress": None}
        until = self.job.until
        return result_of(run_simulation, simulation, until=until, brief=brief, **looks)


def _apart(frame, finer):
    """Difference of the displacements of a usual body, as a share of a usual one."""
    ways = finer.displacement, frame.displacement - finer.displacement
    moved, apart = (np.linalg.norm(way, axis=1) for way in ways)
    return _share(apart, moved, _EPSILON * np.abs(finer.position).max())


def _share(apart, whole, rounding):
    """Difference of a usual body as a share of a usual value.

    Usual: in the middle of all, so that a few fragments that fly elsewhere do not count. rounding:
    of a value; a difference within it is none.
    """
    usual = float(np.median(apart))
    return 0.0 if usual <= rounding else usual / max(float(np.median(whole)), rounding)


def _displaced(simulation, seed):
    """Motion at the start of a twin: arguments of ``State.set_motion``."""
    model = simulation.model
    size = _ROUNDING * np.ptp(model.mesh.points, axis=0).max()
    noise = np.random.default_rng(seed).uniform(-size, size, model.centre.shape)
    return {"position": model.centre + noise, **simulation.scene.initial_motion}
