"""Shake an oscillator, or a structure of several modes with boxes, by any motion or force."""

import contextlib
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ca_damper.batch import Batch
from ca_damper.engine.mount import ModalMount
from ca_damper.excitation.excitation import Excitation, excitation_of
from ca_damper.excitation.signal import Signal
from ca_damper.filling import Filling, check_filling
from ca_damper.oscillator import Oscillator
from ca_damper.runs.history import StructureHistory, TimeHistory
from ca_damper.runs.result import scenes_over
from ca_damper.scenes.checks import MOST_SCENES, MOST_SEED, for_all, run_seeds
from ca_damper.scenes.clock import LEAST_STEPS_PER_CYCLE, MOST_STEPS_PER_CYCLE, automatic_dt
from ca_damper.scenes.table import SceneTable
from ca_damper.structure import Box, ModalStructure
from taichi_dem.kit.checkpoint import Checkpoint, identity_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import (
    AUTO,
    FileName,
    instance,
    positive,
    progress_option,
    several,
    shown,
    told_apart,
    whole,
)

# Between the seeds of two boxes: larger than the seeds that users count, and prime.
_BETWEEN_BOXES = 15_485_863
# Share of a motion at the start that may lie outside the modes.
_OUTSIDE_MODES = 1e-3


def shake(
    filling: Filling,
    excitation: Signal | Excitation,
    *,
    particles: int | Sequence[int],
    seeds: int | Sequence[int] = 5,
    oscillator: Oscillator | None = None,
    dt: float | None = None,
    mount: str = "spring",
    duration: float | None = None,
    interval: float = 1e-3,
    displacement: float = 0.0,
    velocity: float = 0.0,
    effects: str = "listed",
    progress: Listener | str | None = AUTO,
    checkpoint: Checkpoint | None = None,
    resume: FileName | None = None,
) -> TimeHistory:
    """Shake a structure and record its motion.

    Parameters
    ----------
    filling : Filling
        Filling of the container.
    excitation : Signal or Excitation
        Motion of the base [m], or an Excitation; the base stands still where its member is None.
    particles : int or sequence of int
        Numbers of particles, one or several.
    seeds : int or sequence of int, default 5
        Number of seeds, counted from 1, or the seeds themselves.
    oscillator : Oscillator, optional
        Primary structure, without its base_amplitude; that of the paper if None.
    dt : float, optional
        Largest step [s]; that of the filling if None.
    mount : str, default "spring"
        ``"spring"``, ``"base"`` or ``"floor"``, see ``Batch``.
    duration : float, optional
        Duration [s]; that of the excitation if None.
    interval : float, default 0.001
        Longest time between samples [s]; the measures take all steps into account.
    displacement : float, default 0.0
        Displacement of the container at the beginning [m]; without excitation a free decay.
    velocity : float, default 0.0
        Velocity of the container at the beginning [m/s].
    effects : str, default "listed"
        As in ``frequency_response``.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.
    checkpoint : Checkpoint, optional
        As in ``frequency_response``.
    resume : path, optional
        As in ``frequency_response``.

    Raises
    ------
    SimulationDiverged
        All scenes diverged. If only some do, a warning names them, and their results are nan.

    Examples
    --------
    >>> ground = excitation.random_vibration([2.0, 20.0], [0.1, 0.1], duration=10.0)
    >>> shake(Spheres(), ground, particles=30).relative_rms  # doctest: +SKIP
    """
    progress_option("progress", progress)
    check_filling(filling)
    excitation, numbered = _excitation(excitation), run_seeds(seeds)
    own = instance("oscillator", Oscillator() if oscillator is None else oscillator, Oscillator)
    counts = several("particles", particles, lambda n, x: whole(n, x, 0, filling.capacity))
    most = filling.default_dt if dt is None else positive("dt", dt)
    window = _window(excitation, duration, most, interval)
    structure = 0.0, own.mass, own.stiffness, own.damping
    number, seed = scenes_over(particles=counts, seeds=numbered).values()
    table = SceneTable(number, seed, window.dt, 1.0 / window.duration, *structure)
    start = {"displacement": displacement, "velocity": velocity}
    job = f"shaken {identity_of((counts, numbered, window, own, mount, start))}"
    options = {"excitation": excitation, "mount": mount, "effects": effects}
    shape = len(counts), len(numbered)
    with _recorded(
        (filling, table), options, window, start, progress, (job, checkpoint, resume)
    ) as (common, motion, writer):
        over_axes = {
            name: values.reshape(*values.shape[:-1], *shape) for name, values in motion.items()
        }
        axes: dict[str, Any] = {"oscillator": own, "particles": counts, "seeds": numbered}
        history = TimeHistory(**axes, **common, **over_axes)
        writer.save(history)
    return history


def shake_structure(
    filling: Filling,
    structure: ModalStructure,
    boxes: Box | Sequence[Box],
    excitation: Signal | Excitation,
    *,
    seeds: int | Sequence[int] = 5,
    dt: float | None = None,
    duration: float | None = None,
    interval: float = 1e-3,
    force_place: int | None = None,
    displacement: Any = 0.0,
    velocity: Any = 0.0,
    effects: str = "listed",
    progress: Listener | str | None = AUTO,
    checkpoint: Checkpoint | None = None,
    resume: FileName | None = None,
) -> StructureHistory:
    """Shake a structure with boxes and record its motion.

    Parameters
    ----------
    filling : Filling
        Filling of the boxes that have none of their own.
    structure : ModalStructure
        Places and modes.
    boxes : Box or sequence of Box
        Boxes, one or several; several may share a place.
    excitation : Signal or Excitation
        Motion of the base [m], or an Excitation, whose force acts at ``force_place``.
    seeds : int or sequence of int, default 5
        Number of seeds, counted from 1, or the seeds themselves.
    dt : float, optional
        Largest step [s]. None: the filling's, at most a fortieth of the highest mode's cycle.
    duration : float, optional
        Duration [s]; that of the excitation if None.
    interval : float, default 0.001
        Longest time between samples [s].
    force_place : int, optional
        Place where the force of the excitation acts.
    displacement : float or array_like, default 0.0
        Displacement of the places at the beginning [m], a number or (places,); a sum of the modes.
    velocity : float or array_like, default 0.0
        Velocity of the places at the beginning [m/s], likewise.
    effects : str, default "listed"
        As in ``frequency_response``.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.
    checkpoint : Checkpoint, optional
        As in ``frequency_response``.
    resume : path, optional
        As in ``frequency_response``.
    """
    progress_option("progress", progress)
    check_filling(filling)
    excitation, numbered = _excitation(excitation), run_seeds(seeds)
    if (excitation.force is None) != (force_place is None):
        wanted = "None without" if excitation.force is None else "a place for"
        raise InputError(
            f"force_place must be {wanted} a force in the excitation, got {shown(force_place)}"
        )
    boxed = several("boxes", boxes, lambda name, box: instance(name, box, Box))
    own = [filling if box.filling is None else box.filling for box in boxed]
    for box, values in zip(boxed, own):
        whole("particles", box.particles, 0, values.capacity)
    modal = ModalMount(structure, [box.place for box in boxed], force_place)
    scenes = modal.group * len(numbered)
    if scenes > MOST_SCENES:
        words = "(boxes + empty places) x seeds must be at most"
        raise InputError(f"{words} {MOST_SCENES}, got {scenes}")
    window = _window(excitation, duration, _longest_step(own, structure, dt), interval)
    start = {
        name: np.tile(_of_places(name, value, structure)[[*modal.scene_places]], len(numbered))
        for name, value in (("displacement", displacement), ("velocity", velocity))
    }
    table = _table_of_groups(modal, boxed, numbered, window)
    # Nothing is in the others, whatever their filling.
    fillings = [*own, *own[:1] * (modal.group - len(own))] * len(numbered)
    many = structure, boxed, numbered, window, force_place, start
    job = f"shaken structure {identity_of(many)}"
    options = {"excitation": excitation, "structure": modal, "effects": effects}
    # A place is that of the first scene there.
    places = [modal.scene_places.index(i) for i in range(structure.place_count)]
    groups = len(numbered), modal.group
    with _recorded(
        (fillings, table), options, window, start, progress, (job, checkpoint, resume)
    ) as (common, motion, writer):
        taken = {**dict.fromkeys(motion, places), "force": slice(len(boxed))}
        over_axes = {
            name: np.swapaxes(values.reshape(*values.shape[:-1], *groups), -1, -2)[
                ..., taken[name], :
            ]
            for name, values in motion.items()
        }
        axes: dict[str, Any] = {"structure": structure, "boxes": boxed, "seeds": numbered}
        history = StructureHistory(**axes, **common, **over_axes)
        writer.save(history)
    return history


class Window(NamedTuple):
    """A run of ``duration`` [s]: even samples, steps between two of them, and the step [s]."""

    duration: float
    samples: int
    every: int
    dt: float


def _window(excitation: Excitation, asked: Any, dt: float, interval: Any) -> Window:
    """Window with the largest step up to dt [s] that makes a whole number of samples."""
    end = excitation.duration
    if asked is None and math.isinf(end):
        raise InputError("duration must be given for an excitation without an end, got None")
    duration = end if asked is None else positive("duration", asked)
    samples = math.ceil(duration / positive("interval", interval) * (1 - 1e-12))
    every = math.ceil(duration / (samples * dt) * (1.0 - 1e-12))
    every = max(every, math.ceil(LEAST_STEPS_PER_CYCLE / samples))
    if samples * every > MOST_STEPS_PER_CYCLE:
        got, most = told_apart(duration, MOST_STEPS_PER_CYCLE * dt)
        raise InputError(f"duration must be at most {most} s in steps of {dt:.3g} s, got {got}")
    return Window(duration, samples, every, duration / (samples * every))


def _excitation(value: Any) -> Excitation:
    """Excitation that a user means; InputError for None, which shakes nothing."""
    if value is None:
        raise InputError("excitation must be a Signal or an Excitation, got None")
    return excitation_of(value)


@contextlib.contextmanager
def _recorded(scenes, options, window, start, progress, saving):
    """Run a batch over its window; for its block what all scenes share, and what each has."""
    job, checkpoint, resume = saving
    with reporting(progress, "shaking") as tell:
        batch = Batch(*scenes, measured_cycles=1, recorded_samples=window.samples, **options)
        batch.start(**start)
        with batch.checkpointed(checkpoint, resume, {"job": job}) as writer:
            cycles = batch.run(0, 1, tell, record_every=window.every)
            series, sound = batch.time_series(), int(np.argmin(batch.diverged))
            common: dict[str, Any] = {
                "time_s": series["time_s"][:, sound],
                "base": series["y"][:, sound],
            }
            common.update(excitation=batch.excitation, report=batch.report())
            common["label"] = common["report"].method
            highest = np.maximum(cycles.mean_of("x_max"), -cycles.mean_of("x_min"))
            motion = {name: series[name] for name in ("x", "v", "force")}
            yield common, {**motion, "rms": cycles.rms, "peak": highest}, writer


def _longest_step(fillings, structure, dt):
    """Step asked for [s], or that of the fillings and of the highest mode; InputError."""
    highest = float(structure.frequencies.max())
    if dt is None:
        return automatic_dt(min(filling.default_dt for filling in fillings), highest)
    most, longest = positive("dt", dt), 1.0 / (LEAST_STEPS_PER_CYCLE * highest)
    if most > longest * (1.0 + 1e-12):
        got, bound = told_apart(most, longest)
        raise InputError(
            f"dt must be at most {bound} s, {LEAST_STEPS_PER_CYCLE} steps to a cycle of the "
            f"highest mode of {highest:.6g} Hz, got {got}: keep fewer modes, or shorter steps"
        )
    return most


def _table_of_groups(modal, boxes, seeds, window):
    """Scenes of all groups, those of a group running fastest; box 0 has the seed of the run."""
    empty = [0] * (modal.group - len(boxes))
    numbers = [k if box.seed is None else box.seed for k, box in enumerate(boxes)]
    started = [
        [*((seed + number * _BETWEEN_BOXES) % (MOST_SEED + 1) for number in numbers), *empty]
        for seed in seeds
    ]
    particles = [*(box.particles for box in boxes), *empty]
    structure = modal.structure
    mass = float(structure.masses.sum())
    omega = 2.0 * np.pi * float(structure.frequencies.min())
    damping = 2.0 * mass * omega * float(structure.damping_ratios[0])
    return SceneTable(
        *(np.tile(particles, len(seeds)), np.concatenate(started), window.dt),
        *(1.0 / window.duration, 0.0, mass, mass * omega**2, damping),
    )


def _of_places(name, value, structure):
    """Motion at the beginning, (places,); InputError unless it is a sum of the modes."""
    motion = for_all(name, value, structure.place_count)
    left = motion - structure.shapes @ structure.modal(motion)
    if np.abs(left).max() > _OUTSIDE_MODES * np.abs(motion).max():
        raise InputError(
            f"{name} must be a sum of the modes of the structure, got {shown(value)}, of which "
            f"{np.abs(left).max():.3g} is none: keep more modes"
        )
    return motion
