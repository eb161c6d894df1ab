"""Runs of one question by level of the step, twins that differ by chance, and late extremes."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from taichi_dem.elasticity.rates import largest_bond_rate, springs_of
from taichi_dem.goals import Goal
from taichi_dem.kit.bars.answer import share_in_words
from taichi_dem.kit.display import counted
from taichi_dem.kit.progress import Listener, Progress
from taichi_dem.kit.timing import clock
from taichi_dem.laws.contracts import BodyEffect
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.mesh.topology import topology_of
from taichi_dem.methods import ImplicitDashpots, Method, Uniform
from taichi_dem.observers import At, RunView
from taichi_dem.output.record import Frame
from taichi_dem.result import Result
from taichi_dem.scene import Scene
from taichi_dem.simulate import result_of, run_simulation
from taichi_dem.simulation import Simulation
from taichi_dem.stability.body_limits import spring_step
from taichi_dem.stability.step_report import step_report

#: Fewest steps of a run, and how many times shorter than springs bear they begin at most where the
#: history of a load or support is to be resolved.
_FEWEST, _MOST_TIMES = 8, 64
#: By how many more steps a smooth run is made again, as a share and at least: of few steps the
#: error has not its order yet.
_MORE, _LEAST_MORE = 0.1, 16
#: Less than a whole step more, by which last bits of the longest step make none.
_LESS = 1.0 - 1e-9
#: Sweeps of a step at most, and by how much better they agree to see their error.
_MOST_SWEEPS, _TIGHT = 1000, 8
#: Rows of the time series of the coarsest run in which an extreme is looked for, of any run, and of
#: one without an extreme whose report is read: it finds at them what is missing.
_ROWS, _MOST_ROWS, _LOOKS = 100, 6400, 2
_EPSILON = np.finfo(np.float64).eps
#: How far a twin's bodies are displaced at the start, as a share of the size of the solid.
_ROUNDING = 1e-12
#: How many more steps a twin makes at most, as a share, and which part of these each: what breaks
#: by the luck of when a step ends breaks otherwise, and shares of the golden ratio lie far apart.
_MORE_STEPS, _GOLDEN = 0.3, 0.5 * (math.sqrt(5.0) - 1.0)
#: Share of the whole that the first run is taken for.
_GROWTH = 0.3
#: Frames of a run, at which twins are compared.
_FRAMES = 32
#: Share of a run from which on an extreme should change no more. Where it does, a run that is
#: longer by the rest shows whether it goes on.
BEFORE = 0.9


@dataclass(frozen=True)
class Job:
    """A question. until: end of the run [s]. tolerance: error that is allowed, a share."""

    scene: Scene
    until: float
    goal: Goal
    tolerance: float
    confidence: float
    sources: tuple[str, ...] = ("step",)
    meshes: tuple[Mesh, ...] = ()

    @cached_property
    def solves(self) -> bool:
        """Whether dashpots are solved together, in sweeps."""
        return self.scene.damped()

    @cached_property
    def _coarsest(self):
        """Steps at level 0, the fewest that are stable, and order of the error from there on."""
        drives = (one for one in self.scene.effects if isinstance(one, BodyEffect))
        change = min((one.change_time() for one in drives), default=math.inf)
        longest = self._longest_step()
        step = max(min(longest, change), longest / _MOST_TIMES)
        # A pulse within a step is a kick, which lies between the steps of two levels by chance.
        return max(_FEWEST, math.ceil(_LESS * self.until / step)), 2.0 if step <= change else 1.0

    @property
    def declared(self) -> float:
        """Order of the error of a smooth run."""
        return self._coarsest[1]

    def nearby(self, level: float) -> float:
        """Level at which a smooth run is made again, with little more steps than at a level."""
        more = max(_MORE, _LEAST_MORE / (self._coarsest[0] * 2.0**level))
        return level + min(1.0, math.log2(1.0 + more))

    def _longest_step(self):
        """Longest step that all springs bear [s]: solved dashpots leave no other limit."""
        # Solved dashpots limit no step. Without bonds, springs of contacts do.
        mesh, material = self.scene.mesh, self.scene.body_materials
        given = mesh, topology_of(mesh), material.density, springs_of(material)
        step = float(spring_step(largest_bond_rate(*given)))
        if math.isinf(step):
            step = float(step_report(self.scene).borne("solved", "contact").min())
        return step

    def method(self, level: float, tight: bool = False, twin: int = 0) -> Method:
        """Method at a level, of the longest stable step over 2^level."""
        # Sweeps end at differences that fall with the step: one family converges to the exact
        # solution.
        more = 1.0 + _MORE_STEPS * math.fmod(twin * _GOLDEN, 1.0)
        step = self.until / round(self._coarsest[0] * 2.0**level * more)
        if not self.solves:
            return Uniform(step)
        finer, coarse = 2.0**level * (_TIGHT if tight else 1), ImplicitDashpots(step)
        fewest, most = coarse.sweeps
        sweeps = fewest, min(_MOST_SWEEPS, math.ceil(most * finer))
        return replace(coarse, tolerance=coarse.tolerance / finer, sweeps=sweeps)

    def in_words(self, level: float) -> str:
        """Method and step in words."""
        name = "solved dashpots" if self.solves else "one explicit step for all"
        return f"{name}, {self.method(level).dt0:.2g} s"

    def rows(self, level: float, brief: bool = False) -> int:
        """Rows of the time series of a run at a level, of which an extreme needs ever more."""
        if self.goal.kind != "extreme":
            return 1 if brief else _LOOKS
        return min(_MOST_ROWS, round(_ROWS * 2.0**level))


class Runs:
    """Runs that were made, each once; seconds: CPU time of all so far, without compiling."""

    def __init__(self, job: Job, listen: Listener | None):
        self.job, self.listen = job, listen
        self.seconds, self.count, self.failure = 0.0, 0, ""
        self.results: dict[float, Result] = {}
        self.cost: dict[float, float] = {}
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
            self._known[key] = None if result.diverged else self.job.goal.value(result)
        return self._known[key]

    def release(self) -> None:
        """Give the engine back, which another scene can use; a later run sets up another."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation = None

    def parting(self, level: float) -> float:
        """Time at which one rounding has grown to the tolerance, at a level [s]; or infinite."""
        one, two = (self.frames(level, twin) for twin in (0, 1))
        for frame, other in zip(one[1:], two[1:]):
            if _apart(other, frame) > self.job.tolerance:
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
        return change(self.job.goal, self.results[level], at.time_s, at.peak_speed)

    def longer_change(self, level: float) -> float:
        """How much an extreme changes after the end of the run at a level, in a longer one."""
        self.release()
        longer = Runs(replace(self.job, until=self.job.until / BEFORE), self.listen)
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
        method = self.job.method(level, tight, twin if moved else 0)
        if self._simulation is None:
            self._simulation = Simulation(self.job.scene, method)
        else:
            self._simulation.reset(method=method)
        simulation = self._simulation
        if twin:
            simulation.state.set_motion(**_displaced(simulation, twin))
        looks: Any = {"samples": self.job.rows(level, brief), "frames": frames, "progress": None}
        until = self.job.until
        if self.job.goal.kind == "extreme" and not (twin or tight):
            self._earlier[level] = Earlier(until)
            looks["observers"] = [self._earlier[level]]
        return result_of(run_simulation, simulation, until=until, brief=brief, **looks)


def _apart(frame, finer):
    """Difference of the displacements of a usual body, as a share of a usual one."""
    ways = finer.displacement, frame.displacement - finer.displacement
    moved, apart = (np.linalg.norm(way, axis=1) for way in ways)
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


class Earlier:
    """Observer of the largest speeds up to a share of a run."""

    def __init__(self, until: float):
        self.when = At((BEFORE * until,))
        self.time_s, self.peak_speed = math.nan, np.zeros(0)

    def observe(self, view: RunView) -> None:
        """Keep the speeds so far."""
        self.time_s, self.peak_speed = view.time_s, view.peak_speed


def change(goal: Goal, result: Result, time_s: float, peak_speed: np.ndarray) -> float:
    """How much a goal changes from a time on [s]; NaN for a function that cannot say it then."""
    # A user's function may fail in whatever way where nothing changes.
    try:
        return abs(goal.value(result) - goal.value(_stopped(result, time_s, peak_speed)))
    except Exception:
        return math.nan


def _stopped(result, time_s, peak_speed):
    """The result as if nothing changed from a time on [s]."""
    times = result.series["time_s"]
    last = int(np.searchsorted(times, time_s, side="right")) - 1
    rows = np.minimum(np.arange(len(times)), last)
    series = {name: column[rows] for name, column in result.series.items()}
    broken = np.where(result.broken_time <= time_s, result.broken_time, np.nan)
    kept = {**series, "time_s": times}
    return replace(result, series=kept, broken_time=broken, peak_speed=peak_speed)


def extreme_doubts(
    runs: Any, first: float, last: float, error: float, affords: Callable[[float, float], bool]
) -> Iterator[str]:
    """Reasons to doubt an extreme, as sentences; none where it was passed before the end."""
    goal, until, result = runs.job.goal, runs.job.until, runs.results[last]
    if change(goal, result, 0.0, result.frames[0].speed) <= error:
        yield (
            "the extreme is the value at the start, which no later one exceeds by more than the "
            "bar: ask for a later time, or for a goal of the kind 'value'"
        )
    elif runs.late_change(last) > error:
        words = "the extreme lies in the last tenth of the run"
        if not affords(1.0 / BEFORE, first):
            yield f"{words}, and no budget is left for a longer one"
        elif (grown := runs.longer_change(first)) > error:
            by = share_in_words(grown, runs.value(first), goal.unit)
            to = f"{until / BEFORE:.3g} s"
            yield f"{words} and changes by {by} in one to {to}: ask for a later time"
