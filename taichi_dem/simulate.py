"""The loop a user calls: step, sample, keep frames, and hand everything back as one result."""

import warnings
from dataclasses import dataclass, replace

import numpy as np

from taichi_dem.kit.checkpoint import Checkpoint, digest, version_text
from taichi_dem.kit.display import prefixed
from taichi_dem.kit.engine_pool import LoanMemory
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress import LEAST_SHARE, Pace, Progress, compiling
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.restart import CheckpointWriter, NoCheckpointWriter, RunSnapshot, opened
from taichi_dem.kit.validation import AUTO, instance, progress_option, shown
from taichi_dem.measured_speedup import measured_speedup
from taichi_dem.methods import check_method
from taichi_dem.output.record import Recorder
from taichi_dem.result import Result
from taichi_dem.scene import Scene, outer_faces_warnings
from taichi_dem.simulation import Simulation, macro_steps
from taichi_dem.timeline import MACRO_TICKS

#: Progress is reported this often [s].
_REPORT_SECONDS = 0.2
#: Samples or frames of a run: each costs a look at all bodies.
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
    def seconds_left(self):
        """Time expected until the end [s], each level weighted by its steps; infinite at first.

        Without bonds and pairs to evaluate, as the share of the way tells.
        """
        if self.share < LEAST_SHARE or not self.evaluation_rate or not self.evaluations:
            return super().seconds_left
        work = max(0.0, self.until_s - self.time_s) * self.evaluation_rate
        return work * self.seconds / self.evaluations

    @property
    def speed(self):
        """Simulated time and evaluations a second."""
        seconds = max(self.seconds, 1e-9)
        passed = prefixed(self.time_s / seconds, "s/s")
        return f"{passed}, {prefixed(self.evaluations / seconds, 'evaluations/s')}"


def simulate(
    scene,
    *,
    method,
    until,
    driver="auto",
    samples=200,
    frames=0,
    progress=AUTO,
    output=None,
    checkpoint=None,
    resume=None,
    measure_gain=False,
):
    """Run a scene to a time and return the result.

    method: from ``taichi_dem.methods``. until: simulated time [s], rounded up to whole largest
    steps. samples, frames: how many evenly spaced rows of the time series, and snapshots, after
    the one at the start. progress: "auto" for a bar on a terminal and in Jupyter, None for silence,
    or a function that is called with a Progress while kernels are compiled, and then with a
    RunProgress about five times a second; ``progress=print`` prints percent and time left.
    output: folder for the result, written at the end, or up to the last good sample when the
    run diverges. checkpoint: a Checkpoint that says where and when the run saves itself, besides
    at its end and on Ctrl-C. resume: a checkpoint file to go on from, of the same scene and method;
    the bits are those of a run that was never stopped. measure_gain: whether the report says how
    much time steps of different length saved, which takes some seconds more (``measured_speedup``).
    Raises InputError for bad arguments, SimulationDiverged when the run leaves its bounds,
    Interrupted when Ctrl-C has saved the run. Warns, as a UserWarning before the first step, of
    parts of the mesh that can pass through each other (``outer_faces_warnings``).
    """
    instance("scene", scene, Scene)
    check_method(method)
    last = macro_steps(until, method.dt0)
    _check_count("samples", samples, 1)
    _check_count("frames", frames, 0)
    progress_option("progress", progress)
    arrays = _opened(scene, method, checkpoint, resume, last)
    if output is not None:
        output_folder(output)
    for sentence in outer_faces_warnings(scene):
        warnings.warn(sentence, stacklevel=2)
    with reporting(progress, "simulating") as report_progress:
        simulation, recorder = _started(scene, method, driver)
        writer = _checkpoint_writer(simulation, recorder, checkpoint, resume, arrays)
        marks = _marks(last, samples), _marks(last, frames)
        error = _run_saved(simulation, recorder, writer, marks, report_progress)
        result = _result(scene, method, simulation, recorder, error)
        if measure_gain and error is None:
            report = replace(result.report, measured_speedup=measured_speedup(simulation))
            result = replace(result, report=report)
    if output is not None:
        _write(result, output, writer)
    if error is not None:
        error.result = result
        raise error
    return result


def _started(scene, method, driver):
    """A simulation ready to step and its recorder, with all kernels compiled."""
    simulation = Simulation(scene, method, driver)
    recorder = Recorder(simulation, _watched_group(scene))
    simulation.start()
    compiling("recording", 0.95)
    recorder.compile()
    return simulation, recorder


def _opened(scene, method, checkpoint, resume, last):
    """What a run goes on from, arrays by name, or None; InputError for what it cannot."""
    if isinstance(checkpoint, Checkpoint):
        # Refuses too many of them, before anything is done.
        checkpoint.marks(last, method.dt0)
    arrays = opened(checkpoint, resume, lambda: identity_of(scene, method))
    begin = int(np.asarray(arrays.get("field/state.tick", 0)).max(initial=0)) if arrays else 0
    if begin > last * MACRO_TICKS:
        seconds = method.dt0 / MACRO_TICKS
        raise InputError(
            f"until must be at least {begin * seconds:.6g} s, where {resume} begins, "
            f"got {last * method.dt0:.6g}"
        )
    return arrays


def _checkpoint_writer(simulation, recorder, checkpoint, resume, arrays):
    """What saves the run, after the run has been put where it was saved."""
    if checkpoint is None and resume is None:
        return NoCheckpointWriter()
    saved = saved_run(simulation, recorder)
    if arrays:
        saved.restore(arrays, resume)

    def now():
        """Present largest step, and time [s]."""
        return simulation.state.tick[None] // MACRO_TICKS, simulation.time_s

    if checkpoint is None:
        return NoCheckpointWriter()
    return CheckpointWriter(checkpoint, saved, now)


def saved_run(simulation, recorder):
    """All that a checkpoint holds of a started simulation, a ``restart.RunSnapshot``."""
    parts = {
        "simulation": simulation,
        "energy balance": simulation.energy_balance,
        "missing effects": simulation.missing_effects,
        "step resolution": simulation.step_resolution,
        "recorder": recorder,
    }
    return RunSnapshot(
        identity_of(simulation.scene, simulation.method), LoanMemory(simulation.loan), parts
    )


def identity_of(scene, method):
    """What two runs must share for one to go on from the other, in words.

    Driver, threads, and how long a run goes and what it records may differ.
    """
    mesh = scene.mesh
    groups = [array for name in sorted(mesh.groups) for array in (list(name), mesh.groups[name])]
    content = digest(mesh.points, mesh.tetrahedra, *groups)
    return {
        "version": version_text(),
        "mesh": f"{mesh.body_count} tetrahedra ({content})",
        "material": repr(scene.material),
        "effects": ", ".join(f"{effect.name} {vars(effect)}" for effect in scene.effects),
        "max_speed": repr(scene.max_speed),
        "method": repr(method),
    }


def _run_saved(simulation, recorder, writer, marks, report_progress):
    """Run to the end, or as far as the run stays within its bounds: then the SimulationDiverged."""
    try:
        with writer:
            _run(simulation, recorder, writer, marks, report_progress)
    except SimulationDiverged as error:
        return error
    return None


def _run(simulation, recorder, writer, marks, report_progress):
    """Step from mark to mark; every mark is sampled, photographed, or only looked at.

    marks: largest steps to sample, and to photograph, two sets. Those up to which a resumed run
    has come have been seen to.
    """
    sample_steps, frame_steps = marks
    pace = Pace(_REPORT_SECONDS)
    last = max(sample_steps)
    seen = simulation.state.tick[None] if recorder.rows else -1
    marks = sorted(sample_steps | frame_steps | writer.marks(last, simulation.method.dt0))
    for step in (mark for mark in marks if mark * MACRO_TICKS > seen):

        def report_and_save(end=step * MACRO_TICKS):
            """Tell how far the run is, and save it if due; at a mark its rows come first."""
            end_of_run = simulation.state.tick[None] >= last * MACRO_TICKS
            if report_progress is not None and pace.should_report(end_of_run):
                report_progress(progress_of(simulation, last * simulation.method.dt0))
            if simulation.state.tick[None] < end:
                writer.save_if_needed()

        simulation.advance_to(step, report_and_save)
        if step in sample_steps:
            simulation.sample()
            recorder.sample()
        if step in frame_steps:
            recorder.snapshot()
        writer.save_if_needed()
    writer.save()


def _write(result, folder, writer):
    try:
        result.write(folder)
    except InputError as error:
        raise InputError(f"{error}{writer.last_good()}") from None


def progress_of(simulation, until):
    """RunProgress of a simulation towards a time [s]."""
    done, seconds = simulation.evaluations(), simulation.running_seconds()
    rate = simulation.evaluation_rate()
    time_s = simulation.time_s
    return RunProgress(min(1.0, time_s / until), seconds, time_s, until, done, rate)


def _marks(last, count):
    """Evenly spaced macro steps from 0 to last, count of them after the first; none for 0."""
    return {round(last * k / count) for k in range(count + 1)} if count else set()


def _check_count(name, value, least):
    wanted = isinstance(value, int) and not isinstance(value, bool)
    if not wanted or not least <= value <= _MOST_RECORDS:
        raise InputError(
            f"{name} must be a whole number of at least {least} and at most {_MOST_RECORDS}, "
            f"got {shown(value)}"
        )


def _watched_group(scene):
    """The group under gas pressure; without gas, one called hole if the mesh has it."""
    groups = [effect.group for effect in scene.effects if effect.name == "gas_pressure"]
    groups += [name for name in scene.mesh.groups if name == "hole"]
    return groups[0] if groups else None


def _result(scene, method, simulation, recorder, error):
    return Result(
        scene=scene,
        method=method,
        model=simulation.model,
        history=recorder.history(),
        frames=tuple(recorder.frames),
        broken_time=recorder.broken_time(),
        peak_speed=recorder.peak_speed,
        report=simulation.report(),
        diverged=str(error) if error else "",
    )
