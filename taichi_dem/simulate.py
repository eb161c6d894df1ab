"""The loop of a run: step, sample, keep frames, and return all as one result."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Optional, Union

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.checkpoint import Checkpoint, digest, identity_of, version_text
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.files import claiming, output_folder
from taichi_dem.kit.progress.progress import Listener, compiling
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.restart import CheckpointWriter, NoCheckpointWriter, Owner, RunSnapshot, opened
from taichi_dem.kit.validation import AUTO, FileName, instance, told_apart, word
from taichi_dem.loads.history import unresolved_histories
from taichi_dem.methods import Method, check_method
from taichi_dem.observers import Observer, RunView
from taichi_dem.output.hole_monitor import watched_groups
from taichi_dem.output.record import Recorder
from taichi_dem.result import Result
from taichi_dem.run_plan import RunPlan
from taichi_dem.scene import Scene, scene_warnings
from taichi_dem.simulation import Simulation
from taichi_dem.state.timeline import MACRO_TICKS


@claiming()
def simulate(
    scene: Scene,
    *,
    method: Method,
    until: float,
    driver: str = "auto",
    samples: int = 200,
    frames: int = 0,
    progress: Union[Listener, str, None] = AUTO,
    title: str = "simulating",
    output: Optional[FileName] = None,
    checkpoint: Optional[Checkpoint] = None,
    resume: Optional[FileName] = None,
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
        ``"auto"``: a bar on a terminal and in Jupyter. None: silence. A function is called with a
        Progress while kernels are compiled, and then with a RunProgress about five times a second;
        ``print`` prints percent and time left.
    title : str, default "simulating"
        Title of the progress bar.
    output : path, optional
        Folder for the result, which is written at the end, or up to the last good sample when the
        run diverges.
    checkpoint : Checkpoint, optional
        Where and when the run saves itself, besides at its end and on Ctrl-C, SIGTERM, SIGHUP,
        SIGXCPU and SIGUSR1.
    resume : path, optional
        Checkpoint to go on from, of the same scene and method; the bits are those of a run that was
        never stopped.
    observers : sequence of Observer, default ()
        Observers, called on the way with a ``RunView``; after a resume, at the times that are left.

    Returns
    -------
    Result
        Time series, snapshots and report.

    Raises
    ------
    InputError
        An argument is out of its range.
    SimulationDiverged
        The run left its bounds; ``result`` of the exception has the data up to there.
    Interrupted
        A signal ended the run, which has been saved.

    Notes
    -----
    A UserWarning before the first step says what the scene cannot do (``scene_warnings``), and
    which of its histories change within less than a step.

    Examples
    --------
    >>> result = simulate(scene, method=ImplicitDashpots(4e-7), until=1e-4)  # doctest: +SKIP
    >>> print(result.report)  # doctest: +SKIP
    """
    instance("scene", scene, Scene)
    check_method(method)
    word("title", title)
    plan = RunPlan(scene, method, until, samples, frames, observers, progress)
    arrays = _opened(scene, method, checkpoint, resume, plan)
    if output is not None:
        output_folder(output)
    for sentence in (*scene_warnings(scene), *unresolved_histories(scene.effects, method.dt0)):
        warnings.warn(sentence, stacklevel=2)
    with reporting(progress, title) as report_progress:
        simulation, recorder = _started(Simulation(scene, method, driver))
        writer = _checkpoint_writer(simulation, recorder, checkpoint, resume, arrays)
        error = _run_saved(simulation, recorder, writer, plan, report_progress)
        result = _result(simulation, recorder, error, plan)
        if error is None:
            # Observers may keep their view of it.
            simulation.close()
    if output is not None:
        _write(result, output, writer)
    return _given(result, error)


def run_simulation(
    simulation: Simulation,
    *,
    until: float,
    samples: int = 200,
    frames: int = 0,
    progress: Union[Listener, str, None] = AUTO,
    title: str = "simulating",
    observers: Sequence[Observer] = (),
    brief: bool = False,
) -> Result:
    """Run a Simulation, whose motion may have been set, to a time; otherwise as ``simulate``.

    brief: whether the report leaves out all that needs a comparison of the bodies at the end.
    """
    instance("simulation", simulation, Simulation)
    plan = RunPlan(simulation.scene, simulation.method, until, samples, frames, observers, progress)
    with reporting(progress, title) as report_progress:
        simulation, recorder = _started(simulation)
        error = _run_saved(simulation, recorder, NoCheckpointWriter(), plan, report_progress)
    result = _result(simulation, recorder, error, plan, brief)
    return _given(replace(result, start=simulation.first_motion), error)


def _given(result, error):
    """A result; of a run that left its bounds the exception that holds it."""
    if error is not None:
        error.result = result
        raise error
    return result


def result_of(run: Callable[..., Result], *arguments: Any, **options: Any) -> Result:
    """Result of ``simulate`` or ``run_simulation``, also of a run that diverged.

    Its ``diverged`` is then the sentence of the program, else "". arguments, options: of run.
    """
    try:
        return run(*arguments, **options)
    except SimulationDiverged as diverged:
        return diverged.result


def _started(simulation):
    """A simulation ready to step and its recorder, with all kernels compiled."""
    recorder = Recorder(simulation, *watched_groups(simulation.scene))
    simulation.start()
    compiling("recording", 0.95)
    recorder.compile()
    return simulation, recorder


def _opened(scene, method, checkpoint, resume, plan):
    """Arrays by name to resume from, or None. Raises InputError for an unusable checkpoint."""
    if isinstance(checkpoint, Checkpoint):
        # Refuses too many of them, before anything is done.
        checkpoint.marks(plan.last, plan.dt0)
    arrays = opened(checkpoint, resume, lambda: run_identity(scene, method))
    begin = int(np.asarray(arrays.get("field/state.tick", 0)).max(initial=0)) if arrays else 0
    if begin > plan.last * MACRO_TICKS:
        got, least = told_apart(plan.last * plan.dt0, begin * (plan.dt0 / MACRO_TICKS))
        raise InputError(f"until must be at least {least} s, where {resume} begins, got {got}")
    return arrays


def _checkpoint_writer(simulation, recorder, checkpoint, resume, arrays):
    """Writer of checkpoints, after a resumed run has been restored."""
    if arrays:
        saved_run(simulation, recorder).restore(arrays, resume)
    if checkpoint is None:
        return NoCheckpointWriter()

    def now():
        """Present largest step, and time [s]."""
        return int(values(simulation.state.tick)) // MACRO_TICKS, simulation.time_s

    return CheckpointWriter(checkpoint, saved_run(simulation, recorder), now)


def saved_run(simulation: Simulation, recorder: Recorder) -> RunSnapshot:
    """All that a checkpoint holds of a started simulation, a ``restart.RunSnapshot``."""
    parts: dict[str, Owner] = {"simulation": simulation, **simulation.followed}
    parts["recorder"] = recorder
    return RunSnapshot(
        run_identity(simulation.scene, simulation.method), FieldMemory(simulation.engine), parts
    )


def run_identity(scene: Scene, method: Method) -> dict[str, str]:
    """Properties that a resumed run must share with the saved one, in words by name.

    Driver, threads, and how long a run goes and what it records may differ.
    """
    mesh = scene.mesh
    groups = [array for name in sorted(mesh.groups) for array in (list(name), mesh.groups[name])]
    content = digest(mesh.points, mesh.tetrahedra, *groups)
    return {
        "version": version_text(),
        "mesh": f"{mesh.body_count} tetrahedra ({content})",
        "bonded shares": identity_of(mesh.bonded_shares),
        "material": _material_identity(scene),
        "effects": ", ".join(
            f"{effect.name} {identity_of(vars(effect))}" for effect in scene.effects
        ),
        "max_speed": identity_of(scene.max_speed),
        "initial motion": identity_of(scene.initial_motion) if scene.initial_motion else "nothing",
        "on demand": identity_of((scene.on_demand, scene.sleep)),
        "method": identity_of(method),
    }


def _material_identity(scene):
    """Materials of a scene in words, and which body has which."""
    laid = scene.body_materials
    if laid.is_one:
        return identity_of(laid.materials[0])
    names = [identity_of(material) for material in laid.materials]
    # In an order of their own, not that of the groups.
    order = sorted(range(len(names)), key=names.__getitem__)
    place = np.argsort(order)[laid.of_body]
    return f"{'; '.join(names[k] for k in order)} ({digest(place)})"


def _run_saved(simulation, recorder, writer, plan, report_progress):
    """Run to the end, or as far as the run stays within its bounds: then the SimulationDiverged."""
    calls = plan.calls(simulation, recorder, report_progress)
    try:
        with writer:
            _run(simulation, recorder, writer, plan, calls)
    except SimulationDiverged as error:
        return error
    return None


def _run(simulation, recorder, writer, plan, calls):
    """Step from mark to mark, and call the observers at each.

    A resumed run skips the marks that it has passed already.
    """
    view = RunView(simulation, recorder)
    seen = int(values(simulation.state.tick)) if recorder.rows else -1
    marks = sorted(writer.marks(plan.last, plan.dt0).union(*(call.steps for call in calls)))
    for step in (mark for mark in marks if mark * MACRO_TICKS > seen):

        def between(end=step * MACRO_TICKS):
            """Observe by the clock, and save if due; at a mark its observers come first."""
            tick = int(values(simulation.state.tick))
            if tick < plan.last * MACRO_TICKS:
                for call in calls:
                    if call.pace is not None and call.pace.should_report():
                        call.observe(view)
            if tick < end:
                writer.save_if_needed()

        simulation.advance_to(step, between)
        for call in calls:
            if step in call.steps:
                call.observe(view)
        writer.save_if_needed()
    writer.save()


def _write(result, folder, writer):
    try:
        result.write(folder)
    except InputError as error:
        raise InputError(f"{error}{writer.last_good()}") from None


def _result(simulation, recorder, error, plan, brief=False):
    received = [one.received() for one in plan.receivers]
    return Result(
        scene=simulation.scene,
        method=simulation.method,
        model=simulation.model,
        history=recorder.history(),
        frames=tuple(recorder.frames),
        broken_time=recorder.broken_time(),
        peak_speed=recorder.peak_speed,
        report=simulation.report(brief),
        diverged=str(error) if error else "",
        acting_since=simulation.acting_since(),
        receivers={name: part for parts in received for name, part in parts.items()},
    )
