"""Runs of a scene, each made once, and twins that differ by chance."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_dem.accuracy.extremes import BEFORE, Earlier, change, extreme_doubts
from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.sources import Beside, awake_price
from taichi_dem.goals import Goal
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.runs import BaseRuns, Question
from taichi_dem.kit.display import counted
from taichi_dem.kit.progress import Listener, Progress
from taichi_dem.kit.timing import clock
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.output.record import Frame
from taichi_dem.report.energy_balance import OPEN, open_account, unexplained_share
from taichi_dem.result import Result
from taichi_dem.scene import Scene
from taichi_dem.simulate import result_of, run_simulation
from taichi_dem.simulation import Simulation

Affords = Callable[[float, float], bool]
_EPSILON = np.finfo(np.float64).eps
#: How far a twin's bodies are displaced at the start, as a share of the size of the solid.
_ROUNDING = 1e-12
#: Values that are rounding, as a share of the size of their unit.
_ZERO = 64.0 * _EPSILON
#: Share of the whole that the first run is taken for.
_GROWTH = 0.3
#: Frames of a run, at which twins are compared.
_FRAMES = 32


class Runs(BaseRuns):
    """Runs at levels of the step, each once; seconds without compiling.

    meshes: others of the same body, for the error of the mesh.
    """

    def __init__(
        self,
        levels: Levels,
        listen: Listener | None = None,
        question: Question | None = None,
        meshes: Sequence[Mesh] = (),
    ):
        super().__init__()
        self.levels, self.listen, self.meshes = levels, listen, meshes
        self.question = question or Question((levels.goal,))
        self.order, self.averaged = levels.declared, levels.goal.averaged
        self.divides = not self.averaged
        self.results: dict[float, Result] = {}
        self._simulation: Simulation | None = None
        self._earlier: dict[float, Earlier] = {}
        self._known: dict[tuple[float, int, bool], float | None] = {}

    def eventful(self, level: float) -> bool:
        """Whether anything broke, touched or slipped in the undisturbed run at a level."""
        report = self.results[level].report
        return report.broken_faces > 0 or report.pair_evaluations > 0 or bool(report.bond_slip)

    def value(self, level: float, twin: int = 0, tight: bool = False) -> Any:
        """Goal of a run at a level; None for one that diverged."""
        # A twin differs by chance: it starts displaced by one rounding and makes up to 30 % more
        # steps where the run is eventful.
        key = level, twin, tight
        if key not in self._known:
            result = self._timed(*key)
            self.failure = result.diverged or self.failure
            if not (twin or tight or result.diverged):
                self.results[level] = result
            self._known[key] = None if result.diverged else self.levels.goal.value(result)
        return self._known[key]

    def sample(self, goal: Goal, level: float, count: int) -> np.ndarray:
        """Values of a run and its twins that did not diverge, (runs, 1)."""
        values = (self.value(level, twin) for twin in range(count))
        return np.array([value for value in values if value is not None]).reshape(-1, 1)

    def step(self, level: float) -> float:
        """Step at a level [s]."""
        return self.levels.method(level).dt0

    def nearby(self, level: float) -> float:
        """Level at which a smooth run is made again, with little more steps than at a level."""
        return self.levels.nearby(level)

    def in_words(self, level: float, count: int) -> str:
        """Method and step."""
        return self.levels.in_words(level)

    def of(self, scene: Scene) -> "Runs":
        """Runs of another scene at the same levels."""
        return type(self)(replace(self.levels, scene=scene), self.listen)

    def result(self, goal: Goal, level: float, count: int) -> Result:
        """Result of the run at a level."""
        return self.results[level]

    def least(self, goal: Goal, coarse: float, fine: float) -> float:
        """Change of what bodies usually do between two levels, as a share."""
        usual = {"count": self.leap, "extreme": self.peak_change}
        return usual.get(goal.kind, self.change)(coarse, fine)

    def is_whole(self, goal: Goal, level: float) -> bool:
        """Whether faces that broke are counted: a finer run may break one more."""
        return goal.kind == "count" and self.results[level].report.broken_faces > 0

    def rounding(self, goal: Goal) -> float:
        """Value of a goal that is zero but for rounding, by the size that its unit has here."""
        result = next(iter(self.results.values()))
        sizes = {
            "1": lambda: 1.0,
            "mm": lambda: 1e3 * np.ptp(self.levels.scene.mesh.points, axis=0).max(),
            "m/s": lambda: result.peak_speed.max(),
            "J": lambda: np.abs(list(result.report.energy_balance.values())).max(),
        }
        return _ZERO * float(sizes.get(goal.unit, lambda: 0.0)())

    def is_calm(self, coarse: float, fine: float, tolerance: float) -> bool:
        """Whether half the step moves a usual body by little, and breaks the same faces."""
        return self.change(coarse, fine) <= tolerance and self.same_breaks(coarse, fine)

    def solver(self, goal: Goal, level: float) -> float | None:
        """Difference from a run with stricter sweeps; None without sweeps."""
        if not self.levels.solves:
            return None
        tight = self.value(level, 0, True)
        return math.inf if tight is None else abs(tight - self.value(level))

    def beside(self, level: float, last: float, affords: Affords) -> Iterable[Source]:
        """The contact law, the mesh, and what is left out."""
        report = self.results[last].report
        return Beside(self, level, report, lambda runs: affords(runs, level)).sources(last)

    def doubts(
        self, goal: Goal, levels: Sequence[float], bar: float, affords: Affords
    ) -> Iterable[str]:
        """Reasons to doubt the finest run: its extreme, its energy, its certificate."""
        report = self.results[levels[-1]].report
        if goal.kind == "extreme":
            yield from extreme_doubts(self, levels[0], levels[-1], bar, affords)
        account, round_off = report.energy_balance, report.round_off_J
        if unexplained_share(account, round_off) > OPEN:
            yield from open_account(account, round_off)
        certificate = report.certificate
        if certificate is not None and not certificate.holds:
            why = f"the certificate of its run does not hold, as {certificate.failure}"
            yield f"{why}, about {awake_price(self, certificate):.2g} s"

    def release(self) -> None:
        """Give the engine back, which another scene can use; a later run sets up another."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation = None

    def parting(self, level: float, tolerance: float) -> float:
        """Time at which one rounding has grown to a tolerance, at a level [s]; or infinite."""
        first, second = (self.frames(level, twin) for twin in (0, 1))
        for frame, other in zip(first[1:], second[1:]):
            if _apart(other, frame) > tolerance:
                return float(frame.time_s)
        return math.inf

    def frames(self, level: float, twin: int) -> tuple[Frame, ...]:
        """Frames of a run at a level, made for them; of a twin that makes no more steps."""
        return self._timed(level, twin, False, _FRAMES).frames

    def change(self, coarse: float, fine: float) -> float:
        """Difference of the displacements of all bodies at two levels, as a share of the finer."""
        return _apart(self.results[coarse].frames[-1], self.results[fine].frames[-1])

    def peak_change(self, coarse: float, fine: float) -> float:
        """Difference of a typical body's largest speed at two levels, as a share of the finer."""
        slower, faster = (self.results[level].peak_speed for level in (coarse, fine))
        return _share(np.abs(slower - faster), faster, _EPSILON * faster.max())

    def late_change(self, level: float) -> float:
        """How much an extreme changes in the last tenth of the run at a level."""
        at = self._earlier[level]
        return change(self.levels.goal, self.results[level], at.time_s, at.peak_speed)

    def longer_change(self, level: float) -> float:
        """How much an extreme changes after the end of the run at a level, in a longer one."""
        self.release()
        longer = Runs(replace(self.levels, until=self.levels.until / BEFORE), self.listen)
        value = longer.value(level)
        longer.release()
        self.seconds, self.count = self.seconds + longer.seconds, self.count + 1
        return math.inf if value is None else longer.late_change(level)

    def leap(self, coarse: float, fine: float) -> float:
        """Change of a number of broken faces between two levels that may go unseen, as a share."""
        # Faces that broke in one of the runs only, taken to add up like steps to either side.
        first, second = (np.isnan(self.results[level].broken_time) for level in (coarse, fine))
        return math.sqrt((first != second).sum()) / max(1, int((~second).sum()))

    def same_breaks(self, coarse: float, fine: float) -> bool:
        """Whether the same faces broke at two levels."""
        broken = (~np.isnan(self.results[level].broken_time) for level in (coarse, fine))
        return np.array_equal(*broken)

    def _timed(self, level, twin, tight, frames=1):
        started = clock()
        brief = bool(twin or tight or not self.count or frames > 1)
        result = self._simulated(level, twin, tight, frames, brief)
        spent = clock() - started
        if not self.count:
            # Kernels are compiled, or loaded, before the first run's first step.
            spent = max(spent - result.report.compile_seconds, result.report.run_cpu_seconds)
        self.seconds, self.count = self.seconds + spent, self.count + 1
        self.cost.setdefault(level, spent)
        if self.listen is not None:
            share = 1.0 - 1.0 / (1.0 + _GROWTH * self.count)
            self.listen(Progress(share, self.seconds, "stepping", counted(self.count, "run")))
        return result

    def _simulated(self, level, twin, tight, frames, brief):
        """Result of a run; the simulation of the first is used again, which is not set up anew."""
        moved = twin > 0 and frames == 1 and level in self.results and self.eventful(level)
        method = self.levels.method(level, tight, twin if moved else 0)
        if self._simulation is None:
            self._simulation = Simulation(self.levels.scene, method)
        else:
            self._simulation.reset(method=method)
        simulation = self._simulation
        if twin:
            simulation.state.set_motion(**_displaced(simulation, twin))
        looks: Any = {"samples": self.levels.rows(level, brief), "frames": frames, "progress": None}
        until = self.levels.until
        if self.levels.goal.kind == "extreme" and not (twin or tight):
            self._earlier[level] = Earlier(until)
            looks["observers"] = [self._earlier[level]]
        return result_of(run_simulation, simulation, until=until, brief=brief, **looks)


def _apart(frame, finer):
    """Difference of the displacements of a usual body, as a share of a usual one."""
    differences = finer.displacement, frame.displacement - finer.displacement
    moved, apart = (np.linalg.norm(difference, axis=1) for difference in differences)
    return _share(apart, moved, _EPSILON * np.abs(finer.position).max())


def _share(apart, whole, rounding):
    """Difference of a usual body as a share of a usual value."""
    # The median, so that a few fragments that fly elsewhere do not count.
    usual = float(np.median(apart))
    return 0.0 if usual <= rounding else usual / max(float(np.median(whole)), rounding)


def _displaced(simulation, seed):
    model = simulation.model
    size = _ROUNDING * np.ptp(model.mesh.points, axis=0).max()
    noise = np.random.default_rng(seed).uniform(-size, size, model.centre.shape)
    return {"position": model.centre + noise, **simulation.scene.initial_motion}
