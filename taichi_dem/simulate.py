"""The loop of a run: step, sample, keep frames, save, return the result."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from taichi_dem.kit.allocation import values
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.display import prefixed
from taichi_dem.kit.errors import InputError, SimulationDiverged, carry, carrying
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress import Listener, Pace, Progress, compiling
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.restart import CheckpointWriter
from taichi_dem.kit.validation import (
    AUTO,
    FileName,
    instance,
    progress_option,
    whole,
    word,
)
from taichi_dem.loads.history import unresolved_histories
from taichi_dem.methods import Method
from taichi_dem.observers import (
    MOST_CALLS,
    Every,
    Observer,
    RunView,
    checked_observers,
    macro_steps,
    receivers_among,
)
from taichi_dem.output.hole_monitor import watched_groups
from taichi_dem.output.record import Recorder
from taichi_dem.result import Result
from taichi_dem.saved_run import arrays_of, writer_of
from taichi_dem.scene import Scene, scene_warnings
from taichi_dem.simulation import PARTS, Simulation
from taichi_dem.state.timeline import MACRO_TICKS

#: Progress is reported this often [s].
_REPORT_SECONDS = 0.2


def simulate(
    scene: Scene,
    *,
    method: Method,
    until: float,
    driver: str = "auto",
    samples: int = 200,
    frames: int = 0,
    progress: Listener | str | None = AUTO,
    title: str = "simulating",
    output: FileName | None = None,
    checkpoint: Checkpoint | None = None,
    resume: FileName | None = None,
    observers: Sequence[Observer] = (),
) -> Result:
    """Run a scene to a time and return the result.

    Parameters
    ----------
    scene : Scene
        Scene.
    method : Method
        Method, from ``taichi_dem.methods``.
    until : float
        Simulated time [s], rounded up to whole largest steps.
    driver : str, default "auto"
        ``"resident"``, ``"parallel"``, or ``"auto"``, see ``Simulation``.
    samples : int, default 200
        Number of evenly spaced rows of the time series after the one at the start.
    frames : int, default 0
        Number of evenly spaced snapshots after the one at the start.
    progress : callable or str or None, default "auto"
        ``"auto"``: a bar on a terminal and in Jupyter, elsewhere lines. None: silence. A function
        gets a Progress about five times a second; ``print`` prints percent and time left.
    title : str, default "simulating"
        Title of the progress bar.
    output : path, optional
        Folder for the result; it is written at the end, up to the last good sample if the run
        diverges, and up to the failure of an observer or a checkpoint.
    checkpoint : Checkpoint, optional
        Where and when the run saves itself, besides its end, Ctrl-C and signals of batch systems.
    resume : path, optional
        Checkpoint to continue from, of the same scene and method; the bits stay the same.
    observers : sequence of Observer, default ()
        Observers, called during the run with a ``RunView``; after a resume, at the remaining times.

    Raises
    ------
    InputError
        An argument is out of its range, or a file cannot be written, as on a full disk; then
        ``result`` of the exception is the result.
    SimulationDiverged
        The run diverged; ``result`` of the exception has the data before that. So has that of
        whatever an observer raises.
    Interrupted
        A signal ended the run, which has been saved.

    Notes
    -----
    A UserWarning before the first step names what the scene cannot do (``scene_warnings``),
    histories that change within less than a step, bodies that overlap at the start, and steps
    above the longest one that is stable for sure (``step_report``).

    Examples
    --------
    >>> result = simulate(scene, method=ImplicitDashpots(4e-7), until=1e-4)  # doctest: +SKIP
    >>> print(result.report)  # doctest: +SKIP
    """
    instance("scene", scene, Scene)
    instance("method", method, Method)
    word("title", title)
    plan = _Plan(scene, method, until, samples, frames, observers, progress)
    arrays = arrays_of(scene, method, checkpoint, resume, plan.last)
    if output is not None:
        output_folder(output)
    for sentence in (*scene_warnings(scene), *unresolved_histories(scene.effects, method.dt0)):
        warnings.warn(sentence, stacklevel=2)
    with reporting(progress, title) as tell:
        simulation, recorder = _started(Simulation(scene, method, driver))
        for sentence in simulation.followed.at_start():
            warnings.warn(sentence, stacklevel=2)
        writer = writer_of(simulation, recorder, checkpoint, resume, arrays)
        result, error = _result(simulation, recorder, writer, plan, tell)
        if error is None:
            # Observers may keep their view of it.
            simulation.close()
    with carrying(result):
        if output is not None:
            try:
                result.write(output)
            except InputError as unwritten:
                ended = "" if error is None else f"; the run ended before: {error}"
                raise InputError(f"{unwritten}{writer.last_good()}{ended}") from error
        if error is not None:
            raise error
    return result


def run_simulation(
    simulation: Simulation,
    *,
    until: float,
    samples: int = 200,
    frames: int = 0,
    progress: Listener | str | None = AUTO,
    title: str = "simulating",
    observers: Sequence[Observer] = (),
    brief: bool = False,
) -> Result:
    """Run a Simulation, whose motion may have been set, to a time; otherwise as ``simulate``."""
    instance("simulation", simulation, Simulation)
    scene, method = simulation.scene, simulation.method
    plan = _Plan(scene, method, until, samples, frames, observers, progress, brief)
    with reporting(progress, title) as tell:
        simulation, recorder = _started(simulation, brief)
        given = simulation, recorder, CheckpointWriter(), plan, tell
        result, error = _result(*given, start=simulation.first_motion)
    if error is not None:
        raise error
    return result


def result_of(run: Callable[..., Result], *arguments: Any, **options: Any) -> Result:
    """Result of ``simulate`` or ``run_simulation``, also of a run that diverged."""
    try:
        return run(*arguments, **options)
    except SimulationDiverged as diverged:
        if diverged.result is None:
            raise
        return diverged.result


class Call(NamedTuple):
    """A function to call with a view at some of the largest steps, and whenever its pace says."""

    observe: Callable[[RunView], object]
    steps: set[int]
    pace: Pace | None = None


class _Plan:
    """When a run is sampled, photographed, observed and reported, checked before it begins."""

    def __init__(
        self,
        scene: Scene,
        method: Method,
        until: float,
        samples: int,
        frames: int,
        observers: Sequence[Observer],
        progress: Listener | str | None,
        brief: bool = False,
    ):
        self.brief = brief
        self.dt0, self.last = method.dt0, macro_steps(until, method.dt0)
        whole("samples", samples, 1, MOST_CALLS)
        whole("frames", frames, 0, MOST_CALLS)
        progress_option("progress", progress)
        self.samples, self.frames = samples, frames
        self.observed = [
            (observer, observer.when.marks(self.last, self.dt0, samples))
            for observer in checked_observers(observers)
        ]
        for observer in observers:
            if hasattr(observer, "check_scene"):
                observer.check_scene(scene)
        self.receivers = receivers_among(observers)

    def calls(self, simulation: Simulation, recorder: Recorder, tell: Any) -> list[Call]:
        """Calls of a run: samples and frames come before the user's observers."""

        def sample(_):
            with simulation.readings.held():
                simulation.sample(self.brief)
                recorder.sample()

        def progress(_):
            time_s, seconds = simulation.time_s, simulation.run_seconds
            rates = (time_s, "s/s"), (simulation.evaluations(), "evaluations/s")
            words = ", ".join(prefixed(done / max(seconds, 1e-9), unit) for done, unit in rates)
            share = min(1.0, time_s / (self.last * self.dt0))
            tell(Progress(share, seconds, "stepping", words))

        calls = [Call(sample, self._evenly(self.samples))]
        if self.frames:
            calls.append(Call(lambda _: recorder.snapshot(), self._evenly(self.frames)))
        for observer, steps in self.observed:
            wall_s = observer.when.wall_s
            calls.append(Call(observer.observe, steps, None if wall_s is None else Pace(wall_s)))
        if tell is not None:
            calls.append(Call(progress, {self.last}, Pace(_REPORT_SECONDS)))
        return calls

    def _evenly(self, count):
        return Every(samples=1).marks(self.last, self.dt0, count)


def _started(simulation, brief=False):
    recorder = Recorder(simulation, *watched_groups(simulation.scene), brief=brief)
    simulation.start(brief)
    compiling("recording", PARTS, PARTS)
    recorder.compile()
    return simulation, recorder


def _result(simulation, recorder, writer, plan, tell, start=None):
    """Run to the end, or as far as the run stays within its bounds and nothing fails beside it."""
    calls, error = plan.calls(simulation, recorder, tell), None
    try:
        with writer:
            _run(simulation, recorder, writer, plan, calls)
    except Exception as raised:
        # Within a step there is no state to report.
        if simulation.cut_short:
            raise
        error = raised
    received = [receiver.received() for receiver in plan.receivers]
    result = Result(
        scene=simulation.scene,
        method=simulation.method,
        model=simulation.model,
        series=recorder.history(),
        frames=tuple(recorder.frames),
        broken_time=recorder.broken_time(),
        peak_speed=recorder.peak_speed,
        report=simulation.report(plan.brief),
        diverged=str(error) if isinstance(error, SimulationDiverged) else "",
        start=start,
        acting_since=simulation.acting_since(),
        receivers={name: part for parts in received for name, part in parts.items()},
    )
    if error is not None:
        carry(error, result)
    return result, error


def _run(simulation, recorder, writer, plan, calls):
    """Step from mark to mark, and call the observers at each."""
    view = RunView(simulation, recorder)
    seen = int(values(simulation.state.tick)) if recorder.rows else -1
    marks = sorted(writer.marks(plan.last, plan.dt0).union(*(call.steps for call in calls)))
    for step in (mark for mark in marks if mark * MACRO_TICKS > seen):

        def between(step=step):
            """Observe by the clock and at the mark, and save if due."""
            tick = int(values(simulation.state.tick))
            if tick < plan.last * MACRO_TICKS:
                for call in calls:
                    if call.pace is not None and call.pace.should_report():
                        call.observe(view)
            if tick >= step * MACRO_TICKS:
                for call in calls:
                    if step in call.steps:
                        call.observe(view)
            writer.save_if_needed()

        simulation.advance_to(step, between)
        if step == 0:
            between()
    writer.save()
