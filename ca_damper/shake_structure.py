"""Time histories of a structure of several modes with boxes of particles at some of its places."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.batch import Batch
from ca_damper.checks import MOST_SCENES, MOST_SEED, STARTS, check_run
from ca_damper.engine.modal_mount import ModalMount
from ca_damper.excitation.excitation import Excitation
from ca_damper.excitation.signal import Signal
from ca_damper.filling import Filling, check_filling
from ca_damper.measures import history_dataset
from ca_damper.report import Report
from ca_damper.scenes.clock import LEAST_STEPS_PER_CYCLE, automatic_dt
from ca_damper.scenes.table import SceneTable
from ca_damper.structure import Box, ModalStructure
from ca_damper.window import one_for_all, run_duration, run_seeds, window
from taichi_dem.kit.checkpoint import Checkpoint, identity_of
from taichi_dem.kit.data_table import Tabulated
from taichi_dem.kit.display import counted, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import (
    AUTO,
    FileName,
    instance,
    positive,
    real_numbers,
    shown,
    told_apart,
    whole,
)

# Between the seeds of two boxes: larger than the seeds that users count, and prime.
_BETWEEN_BOXES = 15_485_863
# Share of a motion at the start that may lie outside the modes.
_OUTSIDE_MODES = 1e-3


@dataclass(frozen=True, eq=False)
class StructureHistory(Tabulated):
    """Motions of a structure with boxes under one excitation.

    Parameters
    ----------
    label : str
        Short word for the filling.
    structure : ModalStructure
        Places and modes.
    boxes : tuple of Box
        Boxes.
    excitation : Excitation
        Motion of the base and force on a place.
    seeds : tuple of int
        Seeds.
    time_s : ndarray
        Times [s], shape (samples,).
    base : ndarray
        Displacement of the base [m], shape (samples,).
    x : ndarray
        Displacement of all places [m], shape (samples, places, seeds).
    v : ndarray
        Velocity of all places [m/s], shape (samples, places, seeds).
    force : ndarray
        Force of the filling on each box [N], mean since the sample before, shape (samples, boxes,
        seeds).
    rms : ndarray
        RMS of the displacement about its mean [m], of all steps, shape (places, seeds).
    peak : ndarray
        Largest magnitude of the displacement [m], of all steps, shape (places, seeds).
    report : Report, optional
        Figures and cost of the run; a place without a box counts as a scene without particles.
    """

    label: str
    structure: ModalStructure
    boxes: tuple
    excitation: Excitation
    seeds: tuple
    time_s: np.ndarray
    base: np.ndarray
    x: np.ndarray
    v: np.ndarray
    force: np.ndarray
    rms: np.ndarray
    peak: np.ndarray
    report: Report | None = None

    def __repr__(self) -> str:
        number = len(self.boxes)
        axes = f"{number} box{'es' * (number > 1)}, {counted(len(self.seeds), 'seed')}"
        size = f"{counted(len(self.time_s), 'sample')} in {self.time_s[-1]:.6g} s"
        highest = f"largest RMS {1e3 * np.nanmax(self.rms):.4g} mm"
        return in_brief(self, self.label, axes, size, highest)

    @property
    def relative(self) -> np.ndarray:
        """Displacement of the places from the base [m], (samples, places, seeds)."""
        return self.x - self.base[:, None, None]

    @property
    def modal(self) -> np.ndarray:
        """Modal coordinates of the motion from the base [kg^1/2 m], (samples, modes, seeds).

        They are p - G y of ``structure``, and ``relative`` is the sum of shapes times these.
        """
        return np.moveaxis(self.structure._modal(np.moveaxis(self.relative, 1, -1)), -1, 1)

    def columns(self) -> dict[str, Any]:
        """A row a sample: time, base, x of each place and force of each box, for each seed.

        Returns
        -------
        dict
            Columns by name, which ends in the unit.
        """
        columns = {"time_s": self.time_s, "base_m": self.base}
        for name, values in (("x_m_place", self.x), ("force_N_box", self.force)):
            for i in range(values.shape[1]):
                for j, seed in enumerate(self.seeds):
                    columns[f"{name}{i}_seed{seed}"] = values[:, i, j]
        return columns

    def to_xarray(self) -> Any:
        """An xarray Dataset over time, place, box and seed, units in attributes.

        Returns
        -------
        xarray.Dataset
            ``base``, ``x``, ``v``, ``force`` over time; ``rms`` and ``peak`` of the run.
        """
        axes = {"seed": (self.seeds, "1")}
        return history_dataset(self, ("place", "seed"), {"force": ("box", "seed")}, axes)


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
        Filling of all boxes.
    structure : ModalStructure
        Places and modes.
    boxes : Box or sequence of Box
        Boxes, one or several; several may share a place.
    excitation : Signal or Excitation
        Motion of the base [m], or an Excitation, whose force acts at ``force_place``.
    seeds : int or sequence of int, default 5
        Number of seeds, counted from 1, or the seeds themselves.
    dt : float, optional
        Largest step [s]. None: that of the filling, or a fortieth of a cycle of the highest mode
        where that is shorter.
    duration : float, optional
        Duration [s]; that of the excitation if None.
    interval : float, default 0.001
        Longest time between samples [s].
    force_place : int, optional
        Place where the force of the excitation acts.
    displacement : float or array_like, default 0.0
        Displacement of the places at the beginning [m], one number or (places,); a sum of the
        modes.
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

    Returns
    -------
    StructureHistory
        Motion of all places and force on all boxes over time.

    Raises
    ------
    InputError
        An argument is out of its range, or the step is too long for the highest mode.
    SimulationDiverged
        All scenes left the range in which their numbers mean anything. Where some did, a warning
        tells which, and their results are nan.
    """
    check_run(0, STARTS[0], progress)
    plan = _Plan(filling, structure, boxes, one_for_all(excitation), seeds, force_place)
    plan.choose_steps(dt, duration, interval)
    start = plan.start(displacement=displacement, velocity=velocity)
    with reporting(progress, "shaking") as report_progress:
        batch = plan.batch(effects)
        batch.start(**start)
        words = f"{plan.words()}, from {identity_of(start)}"
        with batch.checkpointed(checkpoint, resume, {"job": words}) as writer:
            cycles = batch.run(0, 1, report_progress, record_every=plan.window.every)
            writer.save()
    return plan.history(batch, cycles)


class _Plan:
    """The checked arguments: a group of scenes a seed, over one window."""

    def __init__(self, filling, structure, boxes, excitation, seeds, force_place):
        self.filling, self.excitation = check_filling(filling), excitation
        self.boxes = _checked_boxes(boxes)
        if (excitation.force is None) != (force_place is None):
            wanted = "None without" if excitation.force is None else "a place for"
            raise InputError(
                f"force_place must be {wanted} a force in the excitation, got {shown(force_place)}"
            )
        self.mount = ModalMount(structure, [box.place for box in self.boxes], force_place)
        self.structure, self.seeds = structure, run_seeds(seeds)
        for box in self.boxes:
            whole("particles", box.particles, 0, self.filling.capacity)
        if self.mount.group * len(self.seeds) > MOST_SCENES:
            raise InputError(f"(boxes + empty places) x seeds must be at most {MOST_SCENES}")

    def choose_steps(self, dt, duration, interval):
        """Set the window of the run."""
        highest = float(self.structure.frequencies.max())
        most = automatic_dt(self.filling.default_dt, highest)
        if dt is not None:
            most = positive("dt", dt)
            longest = 1.0 / (LEAST_STEPS_PER_CYCLE * highest)
            if most > longest * (1.0 + 1e-12):
                got, bound = told_apart(most, longest)
                raise InputError(
                    f"dt must be at most {bound} s, {LEAST_STEPS_PER_CYCLE} steps to a cycle "
                    f"of the highest mode of {highest:.6g} Hz, got {got}: keep fewer modes, or "
                    "take shorter steps"
                )
        self.window = window(run_duration(self.excitation, duration), most, interval)

    def start(self, **motion):
        """Motion of the place of each scene at the beginning, by name; InputError."""
        places = list(self.mount.scene_places)
        made = {}
        for name, value in motion.items():
            of_places = _of_places(name, value, self.structure)
            made[name] = np.tile(of_places[places], len(self.seeds))
        return made

    def words(self):
        """The run without the filling, in words."""
        many = self.boxes, self.seeds, self.window, self.mount.force_place
        return f"shaken structure {identity_of(self.structure)}, {identity_of(many)}"

    def batch(self, effects):
        """Batch of all groups, the scenes of a group running fastest."""
        empty = self.mount.group - len(self.boxes)
        particles = [*(box.particles for box in self.boxes), *[0] * empty]
        seeds = np.concatenate([[*self._box_seeds(seed), *[0] * empty] for seed in self.seeds])
        mass = float(self.structure.masses.sum())
        omega = 2.0 * np.pi * float(self.structure.frequencies.min())
        damping = 2.0 * mass * omega * float(self.structure.damping_ratios[0])
        table = SceneTable(
            *(np.tile(particles, len(self.seeds)), seeds, self.window.dt),
            *(1.0 / self.window.duration, 0.0, mass, mass * omega**2, damping),
        )
        options = {"excitation": self.excitation, "recorded_samples": self.window.samples}
        return Batch(
            *(self.filling, table),
            structure=self.mount,
            measured_cycles=1,
            effects=effects,
            **options,
        )

    def _box_seeds(self, seed):
        """Seed of each box in the run of a seed: that of the run for box 0."""
        numbers = (k if box.seed is None else box.seed for k, box in enumerate(self.boxes))
        return [(seed + number * _BETWEEN_BOXES) % (MOST_SEED + 1) for number in numbers]

    def history(self, batch, cycles):
        """What the batch recorded."""
        series, group = batch.time_series(), self.mount.group
        sound = int(np.argmin(batch.diverged))
        # A place is that of the first scene there.
        of_place = [self.mount.scene_places.index(i) for i in range(self.structure.place_count)]
        highest = np.maximum(cycles.mean_of("x_max"), -cycles.mean_of("x_min"))
        rms, peak = (one.reshape(-1, group).T[of_place] for one in (cycles.rms, highest))
        x, v, force = (
            np.swapaxes(series[name].reshape(-1, len(self.seeds), group), 1, 2)
            for name in ("x", "v", "force")
        )
        return StructureHistory(
            *(self.filling.label, self.structure, self.boxes, self.excitation, self.seeds),
            *(series["time_s"][:, sound], series["y"][:, sound]),
            *(x[:, of_place], v[:, of_place], force[:, : len(self.boxes)], rms, peak),
            batch.report(),
        )


def _checked_boxes(boxes):
    """Boxes as a tuple; InputError."""
    given = (boxes,) if isinstance(boxes, Box) else boxes
    if not isinstance(given, (list, tuple)) or not given:
        raise InputError(f"boxes must be a Box or a list of at least one, got {shown(boxes)}")
    return tuple(instance("boxes", box, Box) for box in given)


def _of_places(name, value, structure):
    """Motion at the beginning, (places,); InputError unless it is a sum of the modes."""
    places = structure.place_count
    try:
        motion = np.broadcast_to(real_numbers(name, value), places)
    except ValueError:
        raise InputError(
            f"{name} must be a finite number or {places}, one for each place, got {shown(value)}"
        ) from None
    left = motion - structure.shapes @ structure.modal(motion)
    if np.abs(left).max() > _OUTSIDE_MODES * np.abs(motion).max():
        raise InputError(
            f"{name} must be a sum of the modes of the structure, got {shown(value)}, of which "
            f"{np.abs(left).max():.3g} is none: keep more modes"
        )
    return motion
