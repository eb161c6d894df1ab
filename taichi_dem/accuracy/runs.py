"""Runs of one question: by level of the step, and twins that differ by one rounding."""

import math
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from taichi_dem.accuracy.job import Job, Methods
from taichi_dem.kit.display import counted
from taichi_dem.kit.progress.progress import Listener, Progress
from taichi_dem.kit.study.timing import clock
from taichi_dem.result import Result
from taichi_dem.simulate import result_of, run_simulation
from taichi_dem.simulation import Simulation

#: How far a twin's bodies are displaced at the start, as a share of the size of the solid.
_ROUNDING = 1e-12
#: Share of the whole that the first run is taken for.
_GROWTH = 0.3
#: Frames of a run, at which twins are compared.
_FRAMES = 8


@dataclass(frozen=True)
class Sought(Progress):
    """Progress of a search, whose number of runs is not known: the share grows ever slower."""

    runs: int

    @property
    def speed(self) -> str:
        """How many runs were made."""
        return counted(self.runs, "run")


class Runs:
    """Runs that were made, each once.

    seconds: CPU time of all so far, without compiling [s]. count: their number. results, cost: by
    level of the step, Result and CPU time [s] of the last undisturbed run. failure: the sentence of
    the last run that diverged.
    """

    def __init__(self, job: Job, methods: Methods, listen: Optional[Listener]):
        self.job, self.methods, self._listen = job, methods, listen
        self.seconds, self.count, self.failure = 0.0, 0, ""
        self.results: dict[int, Result] = {}
        self.cost: dict[int, float] = {}
        self._simulation: Optional[Simulation] = None
        self._known: dict[tuple[int, int, bool], tuple[float, float]] = {}

    def value(self, level: int, twin: int = 0, tight: bool = False) -> Optional[float]:
        """Goal of a run at a level; None for one that diverged.

        twin: 0 for the scene as it is, else the seed of its disturbance. tight: see
        ``Methods.at``.
        """
        return self._found(level, twin, tight)[0]

    def parting(self, level: int, twin: int) -> float:
        """Time at which a twin has left the run at a level by the tolerance [s]; infinite if never.

        By the displacements of all bodies, to an eighth of the run.
        """
        return self._found(level, twin, False)[1]

    def change(self, coarse: int, fine: int) -> float:
        """Difference of the displacements of all bodies at two levels, as a share of the finer."""
        return _apart(self.results[coarse].frames[-1], self.results[fine].frames[-1])

    def _found(self, *key):
        if key not in self._known:
            self._known[key] = self._run(*key)
        return self._known[key]

    def _run(self, level, twin, tight):
        started = clock()
        result = self._simulated(level, twin, tight, brief=bool(twin or tight or not self.count))
        spent = clock() - started
        if not self.count:
            # Kernels are compiled, or loaded, before the first run's first step.
            spent = max(spent - result.report.compile_seconds, result.report.run_cpu_seconds)
        self.seconds, self.count = self.seconds + spent, self.count + 1
        if self._listen is not None:
            share = 1.0 - 1.0 / (1.0 + _GROWTH * self.count)
            self._listen(Sought(share, self.seconds, self.count))
        if result.diverged:
            self.failure = result.diverged
            return None, 0.0
        if not (twin or tight):
            self.results[level], self.cost[level] = result, spent
        return self.job.goal.value(result), self._parted(self.results[level], result)

    def _simulated(self, level, twin, tight, brief):
        """Result of a run; the simulation of the first is used again, which loads no engine."""
        method = self.methods.at(level, tight)
        if self._simulation is None:
            self._simulation = Simulation(self.job.scene, method)
        else:
            self._simulation.reset(method=method)
        simulation = self._simulation
        if twin:
            simulation.state.set_motion(**_displaced(simulation.model, twin))
        looks: Any = {"samples": self.job.rows(level), "frames": _FRAMES, "progress": None}
        until = self.job.until
        return result_of(run_simulation, simulation, until=until, brief=brief, **looks)

    def _parted(self, result, other):
        for frame, twin in zip(result.frames, other.frames):
            if frame.time_s > 0.0 and _apart(twin, frame) > self.job.tolerance:
                return frame.time_s
        return math.inf


def _apart(frame, finer):
    """Difference of the displacements of a usual body, as a share of what a usual one moves.

    Usual: in the middle of all, so that a few fragments that fly elsewhere do not count.
    """
    moved = np.median(np.linalg.norm(finer.displacement, axis=1))
    apart = np.median(np.linalg.norm(frame.displacement - finer.displacement, axis=1))
    return float(apart) / max(float(moved), 1e-300)


def _displaced(model, seed):
    """Motion at the start of a twin: arguments of ``State.set_motion``."""
    size = _ROUNDING * np.ptp(model.mesh.points, axis=0).max()
    noise = np.random.default_rng(seed).uniform(-size, size, model.centre.shape)
    return {"position": model.centre + noise}
