"""When a run is sampled, photographed, observed and reported."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Callable, NamedTuple, Optional, Union

from taichi_dem.kit.display import prefixed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import LEAST_SHARE, Listener, Pace, Progress
from taichi_dem.kit.validation import positive, progress_option, shown, told_apart, whole
from taichi_dem.methods import Method
from taichi_dem.observers import At, Every, Observer, RunView
from taichi_dem.output.receivers import Receivers
from taichi_dem.output.record import Recorder
from taichi_dem.scene import Scene
from taichi_dem.simulation import MOST_STEPS, Simulation

#: Progress is reported this often [s].
_REPORT_SECONDS = 0.2
#: Most samples or frames of a run: each reads all bodies.
_MOST_RECORDS = 1_000_000


@dataclass(frozen=True)
class RunProgress(Progress):
    """How far a run is: time_s of until_s; bonds and pairs evaluated.

    evaluation_rate: bonds and pairs to evaluate in a simulated second at the present levels [1/s].
    """

    time_s: float
    until_s: float
    evaluations: int
    evaluation_rate: float

    @property
    def seconds_left(self) -> float:
        """Time expected until the end [s], each level weighted by its steps; infinite at first.

        Without bonds and pairs to evaluate, as the share of the way tells.
        """
        if self.share < LEAST_SHARE or not self.evaluation_rate or not self.evaluations:
            return super().seconds_left
        work = max(0.0, self.until_s - self.time_s) * self.evaluation_rate
        return work * self.seconds / self.evaluations

    @property
    def speed(self) -> str:
        """Simulated time and evaluations a second."""
        seconds = max(self.seconds, 1e-9)
        passed = prefixed(self.time_s / seconds, "s/s")
        return f"{passed}, {prefixed(self.evaluations / seconds, 'evaluations/s')}"


class Call(NamedTuple):
    """A function to call with a view at some of the largest steps, and whenever its pace says."""

    observe: Callable[[RunView], object]
    steps: set[int]
    pace: Optional[Pace] = None


def progress_of(simulation: Simulation, until: float) -> RunProgress:
    """RunProgress of a simulation towards a time [s]."""
    done, seconds = simulation.evaluations(), simulation.run_seconds
    rate = simulation.evaluation_rate()
    time_s = simulation.time_s
    return RunProgress(min(1.0, time_s / until), seconds, time_s, until, done, rate)


class RunPlan:
    """When a run is sampled, photographed, observed and reported, checked before it begins.

    last: number of largest steps. receivers: those among the observers. Raises InputError.
    """

    def __init__(
        self,
        scene: Scene,
        method: Method,
        until: float,
        samples: int,
        frames: int,
        observers: Sequence[Observer],
        progress: Union[Listener, str, None],
    ):
        self.dt0, self.last = method.dt0, macro_steps(until, method.dt0)
        whole("samples", samples, 1, _MOST_RECORDS)
        whole("frames", frames, 0, _MOST_RECORDS)
        progress_option("progress", progress)
        self.samples, self.frames = samples, frames
        self.observed = [
            (one, one.when.marks(self.last, self.dt0, samples)) for one in _checked(observers)
        ]
        for one in observers:
            if hasattr(one, "check_scene"):
                one.check_scene(scene)
        self.receivers = _receivers_among(observers)

    def calls(
        self, simulation: Simulation, recorder: Recorder, report_progress: Optional[Listener]
    ) -> list[Call]:
        """Calls of a run: samples and frames come before the user's observers."""

        def sample(_):
            with simulation.readings.held():
                simulation.sample()
                recorder.sample()

        made = [Call(sample, self._evenly(self.samples))]
        if self.frames:
            made.append(Call(lambda _: recorder.snapshot(), self._evenly(self.frames)))
        for one, steps in self.observed:
            wall_s = one.when.wall_s
            made.append(Call(one.observe, steps, None if wall_s is None else Pace(wall_s)))
        if report_progress is not None:
            tell, until, pace = report_progress, self.last * self.dt0, Pace(_REPORT_SECONDS)
            made.append(Call(lambda _: tell(progress_of(simulation, until)), {self.last}, pace))
        return made

    def _evenly(self, count):
        return Every(samples=1).marks(self.last, self.dt0, count)


def macro_steps(until: float, dt0: float) -> int:
    """Number of largest steps that reach a time [s]; InputError unless it can be counted to."""
    steps = positive("until", until) / dt0
    if steps > MOST_STEPS:
        got, most = told_apart(until, MOST_STEPS * dt0)
        raise InputError(
            f"until must be at most {most} s, {MOST_STEPS} largest steps of {dt0:g} s, got {got}"
        )
    return max(1, math.ceil(steps - 1e-9))


def _checked(observers):
    """Observers as a tuple; InputError for one without a member, or with a wrong one."""
    if not isinstance(observers, (list, tuple)):
        raise InputError(f"observers must be a list of observers, got {shown(observers)}")
    for place, one in enumerate(observers):
        when = getattr(one, "when", None)
        if not isinstance(when, (Every, At)):
            raise InputError(
                f"observers[{place}] must have a member when, an Every or an At, got {shown(when)}"
            )
        if isinstance(one, type) or not callable(getattr(one, "observe", None)):
            raise InputError(
                f"observers[{place}] must have a method observe(view), got {shown(one)}"
            )
    return tuple(observers)


def _receivers_among(observers):
    """Receivers among observers; InputError where two have one name."""
    found = [one for one in observers if isinstance(one, Receivers)]
    names = [name for one in found for name in one.points]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"observers must have receivers of different names, got {twice[0]} twice")
    return found
