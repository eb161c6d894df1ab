"""When a run is sampled, photographed, observed and reported; all of these are observers of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

from taichi_dem.kit.display import prefixed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import LEAST_SHARE, Listener, Progress
from taichi_dem.kit.validation import is_whole, progress_option, shown
from taichi_dem.observers import Every, Observer, ObserverCalls, checked_observers
from taichi_dem.output.record import Recorder
from taichi_dem.scene import Scene
from taichi_dem.simulation import Simulation

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


def progress_of(simulation: Simulation, until: float) -> RunProgress:
    """RunProgress of a simulation towards a time [s]."""
    done, seconds = simulation.evaluations(), simulation.run_seconds
    rate = simulation.evaluation_rate()
    time_s = simulation.time_s
    return RunProgress(min(1.0, time_s / until), seconds, time_s, until, done, rate)


class RunPlan:
    """Checked answer to when a run is sampled, photographed, observed and reported.

    last: number of largest steps of dt0 [s]. Raises InputError.
    """

    def __init__(
        self,
        last: int,
        dt0: float,
        samples: int,
        frames: int,
        observers: Sequence[Observer],
        progress: Union[Listener, str, None],
    ):
        _check_count("samples", samples, 1)
        _check_count("frames", frames, 0)
        progress_option("progress", progress)
        self.last, self.dt0, self.samples, self.frames = last, dt0, samples, frames
        self.observers = checked_observers(observers)
        ObserverCalls(self.observers, last, dt0, samples)

    def check_scene(self, scene: Scene) -> None:
        """Let the observers that want it look at the scene of the run; they raise InputError."""
        for observer in self.observers:
            check = getattr(observer, "check_scene", None)
            if check is not None:
                check(scene)

    def calls(
        self, simulation: Simulation, recorder: Recorder, report_progress: Optional[Listener]
    ) -> ObserverCalls:
        """ObserverCalls of a run: samples and frames come before the user's observers."""
        observers: list[Any] = [_Sampler(simulation, recorder)]
        observers += [_Photographer(recorder, self.frames), *self.observers]
        if report_progress is not None:
            until = self.last * self.dt0
            observers.append(_Reporter(simulation, until, report_progress))
        return ObserverCalls(observers, self.last, self.dt0, self.samples)


class _Sampler:
    """Adds rows to the time series, and samples missing effects."""

    when = Every(samples=1)

    def __init__(self, simulation, recorder):
        self.simulation, self.recorder = simulation, recorder

    def observe(self, view):
        """Sample."""
        with self.simulation.readings.held():
            self.simulation.sample()
            self.recorder.sample()


class _EvenlySpaced:
    """A number of times after the start; none for 0.

    Apart from its observer: one that named itself would keep its simulation, and so its engine,
    until the next collection of garbage.
    """

    def __init__(self, count):
        self.count = count

    def marks(self, last, dt, samples):
        """Largest steps at which to call."""
        return Every(samples=1).marks(last, dt, self.count) if self.count else set()


class _Photographer:
    """Keeps a number of frames after the one at the start."""

    def __init__(self, recorder, count):
        self.when, self.recorder = _EvenlySpaced(count), recorder

    def observe(self, view):
        """Keep a frame."""
        self.recorder.snapshot()


class _Reporter:
    """Reports progress towards a time [s]."""

    when = Every(wall_s=_REPORT_SECONDS)

    def __init__(self, simulation, until, report_progress):
        self.simulation, self.until, self.report_progress = simulation, until, report_progress

    def observe(self, view):
        """Report."""
        self.report_progress(progress_of(self.simulation, self.until))


def _check_count(name, value, least):
    if not is_whole(value) or not least <= value <= _MOST_RECORDS:
        raise InputError(
            f"{name} must be a whole number of at least {least} and at most {_MOST_RECORDS}, "
            f"got {shown(value)}"
        )
