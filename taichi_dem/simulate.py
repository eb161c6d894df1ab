"""The loop a user calls: step, sample, keep frames, and hand everything back as one result."""

import json
import os
from dataclasses import dataclass

import numpy as np

from taichi_dem.errors import InputError, SimulationDiverged
from taichi_dem.files import output_folder, write_csv, write_text
from taichi_dem.mesh_files import write_mesh
from taichi_dem.record import (
    Recorder,
    write_paraview,
)
from taichi_dem.simulation import Simulation, macro_steps


@dataclass(frozen=True)
class Progress:
    """How far a run is: time_s of until_s; bonds and pairs evaluated, in run_seconds."""

    time_s: float
    until_s: float
    evaluations: int
    run_seconds: float

    @property
    def share(self):
        """Of the way, in [0, 1]."""
        return self.time_s / self.until_s

    def __str__(self):
        """How fast it goes."""
        seconds = max(self.run_seconds, 1e-9)
        rate = 1e-6 * self.evaluations / seconds
        return f"{1e6 * self.time_s / seconds:.3g} us/s, {rate:.3g} M evaluations/s"


@dataclass(frozen=True, eq=False)
class Result:
    """What a run produced.

    history: arrays by column name, one row a sample. frames: snapshots. broken_time: when each
    bond was released [s], NaN while it holds. report: figures of the run. diverged: the sentence
    of a run that left its bounds (all else then ends before that), else "".
    """

    scene: object
    method: object
    model: object
    history: dict
    frames: tuple
    broken_time: np.ndarray
    report: object
    diverged: str = ""

    def write(self, folder):
        """Write history.csv, mesh.msh, report.json and the ParaView series to a folder.

        Raises InputError when the folder cannot be written to.
        """
        output_folder(folder)
        write_csv(os.path.join(folder, "history.csv"), self.history)
        write_mesh(os.path.join(folder, "mesh.msh"), self.scene.mesh)
        text = json.dumps({**self.report.as_dict(), "diverged": self.diverged}, indent=1)
        write_text(os.path.join(folder, "report.json"), text)
        if self.frames:
            write_paraview(os.path.join(folder, "paraview"), self.model, self.frames)


def simulate(
    scene, *, method, until, driver="auto", samples=200, frames=0, progress=None, output=None
):
    """Run a scene to a time and return the result.

    method: from ``taichi_dem.methods``. until: simulated time [s], rounded up to whole largest
    steps. samples, frames: how many evenly spaced rows of the time series, and snapshots, after
    the one at the start. progress: called with a Progress about five times a second.
    output: folder for the result, written at the end, or up to the last good sample when the
    run diverges.
    Raises InputError for bad arguments, SimulationDiverged when the run leaves its bounds.
    """
    if output is not None:
        output_folder(output)
    last = macro_steps(until, method.dt0)
    _check_count("samples", samples, 1)
    _check_count("frames", frames, 0)
    simulation = Simulation(scene, method, driver)
    recorder = Recorder(simulation, _watched_group(scene))
    simulation.start()
    sample_steps, frame_steps = _marks(last, samples), _marks(last, frames)
    error = None
    try:
        _run(simulation, recorder, sample_steps, frame_steps, progress)
    except SimulationDiverged as diverged:
        error = diverged
    result = _result(scene, method, simulation, recorder, error)
    if output is not None:
        result.write(output)
    if error is not None:
        error.result = result
        raise error
    return result


def _run(simulation, recorder, sample_steps, frame_steps, progress):
    """Step from mark to mark; every mark is sampled, photographed, or both."""
    last = max(sample_steps)

    def tell():
        if progress is not None:
            progress(progress_of(simulation, last * simulation.method.dt0))

    for step in sorted(sample_steps | frame_steps):
        simulation.advance_to(step, tell)
        if step in sample_steps:
            simulation.look()
            recorder.sample()
        if step in frame_steps:
            recorder.snapshot()


def progress_of(simulation, until):
    """Progress of a simulation towards a time [s]."""
    done, seconds = simulation.evaluations(), simulation.running_seconds()
    return Progress(simulation.time_s, until, done, seconds)


def _marks(last, count):
    """Evenly spaced macro steps from 0 to last, count of them after the first; none for 0."""
    return {round(last * k / count) for k in range(count + 1)} if count else set()


def _check_count(name, value, least):
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")


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
        report=simulation.report(),
        diverged=str(error) if error else "",
    )
