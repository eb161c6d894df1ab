"""Time histories of the damped structure under a motion of its base or a force that is no sine."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.batch import Batch
from ca_damper.checks import MOST_SCENES, STARTS, check_run
from ca_damper.excitation.excitation import Excitation
from ca_damper.excitation.signal import Signal
from ca_damper.filling import Filling, check_filling
from ca_damper.measures import history_dataset
from ca_damper.oscillator import Oscillator
from ca_damper.report import Report
from ca_damper.scenes.table import SceneTable
from ca_damper.window import one_for_all, run_duration, run_seeds, window
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.data_table import Tabulated
from taichi_dem.kit.display import counted, in_brief, listed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName, instance, positive, several, whole


@dataclass(frozen=True, eq=False)
class TimeHistory(Tabulated):
    """Motions of containers under one excitation.

    Parameters
    ----------
    label : str
        Short word for the filling.
    oscillator : Oscillator
        Primary structure.
    excitation : Excitation
        Motion of the base and force on the container.
    particles : tuple of int
        Numbers of particles.
    seeds : tuple of int
        Seeds.
    time_s : ndarray
        Times [s], shape (samples,).
    base : ndarray
        Displacement of the base [m], shape (samples,).
    x : ndarray
        Displacement of the container [m], shape (samples, particles, seeds).
    v : ndarray
        Velocity of the container [m/s], shape (samples, particles, seeds).
    force : ndarray
        Force of the filling on the container [N], mean since the sample before, shape (samples,
        particles, seeds).
    rms : ndarray
        RMS of the displacement about its mean [m], of all steps, shape (particles, seeds).
    peak : ndarray
        Largest magnitude of the displacement [m], of all steps, shape (particles, seeds).
    report : Report, optional
        Figures and cost of the run.
    """

    label: str
    oscillator: Oscillator
    excitation: Excitation
    particles: tuple
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
        axes = f"particles {listed(self.particles)}, {counted(len(self.seeds), 'seed')}"
        size = f"{counted(len(self.time_s), 'sample')} in {self.time_s[-1]:.6g} s"
        highest = f"largest RMS {1e3 * np.nanmax(self.rms):.4g} mm"
        return in_brief(self, self.label, axes, size, highest)

    @property
    def relative(self) -> np.ndarray:
        """Displacement of the container from the base [m], (samples, particles, seeds)."""
        return self.x - self.base[:, None, None]

    @property
    def relative_rms(self) -> np.ndarray:
        """RMS of the samples of ``relative`` about their mean [m], (particles, seeds)."""
        return self.relative.std(axis=0)

    @property
    def relative_peak(self) -> np.ndarray:
        """Largest magnitude of ``relative`` [m], of the samples, (particles, seeds)."""
        return np.abs(self.relative).max(axis=0)

    @property
    def added_damping(self) -> np.ndarray:
        """Coefficient of a dashpot on the base that takes the filling's work [N s/m].

        -int F dx / int (x' - y')^2 dt over the run, (particles, seeds); NaN where the container
        never moves on the base. Between samples the force counts by its mean and the speed as even,
        so that they must be close together.
        """
        work = -(self.force[1:] * np.diff(self.x, axis=0)).sum(axis=0)
        stretch = np.diff(self.relative, axis=0) ** 2
        moved = (stretch / np.diff(self.time_s)[:, None, None]).sum(axis=0)
        return np.divide(work, moved, out=np.full_like(work, np.nan), where=moved > 0.0)

    @property
    def damping_ratio(self) -> np.ndarray:
        """Share of critical damping by the structure's own dashpot and ``added_damping``."""
        o = self.oscillator
        critical = 2.0 * math.sqrt(o.stiffness * o.mass)
        return (o.damping + self.added_damping) / critical

    def columns(self) -> dict[str, Any]:
        """A row a sample: time, base, and x and force of each particle number and seed.

        Returns
        -------
        dict
            Columns by name, which ends in the unit.
        """
        columns = {"time_s": self.time_s, "base_m": self.base}
        for name, values in (("x_m", self.x), ("force_N", self.force)):
            for k, number in enumerate(self.particles):
                for j, seed in enumerate(self.seeds):
                    columns[f"{name}_N{number}_seed{seed}"] = values[:, k, j]
        return columns

    def to_xarray(self) -> Any:
        """An xarray Dataset over time, particles and seed, units in attributes.

        Returns
        -------
        xarray.Dataset
            ``base``, ``x``, ``v``, ``force`` over time; ``rms`` and ``peak`` of the run.
        """
        axes = {"particles": (self.particles, "1"), "seed": (self.seeds, "1")}
        return history_dataset(self, ("particles", "seed"), {"force": ("particles", "seed")}, axes)


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
        Displacement of the container at the beginning [m]. With an excitation that is zero, the
        record is a free decay.
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

    Returns
    -------
    TimeHistory
        Motion and force over time.

    Raises
    ------
    InputError
        An argument is out of its range.
    SimulationDiverged
        All scenes left the range in which their numbers mean anything. Where some did, a warning
        tells which, and their results are nan.

    Examples
    --------
    >>> ground = excitation.random_vibration([2.0, 20.0], [0.1, 0.1], duration=10.0)
    >>> shake(Spheres(), ground, particles=30).relative_rms  # doctest: +SKIP
    """
    check_run(0, STARTS[0], progress)
    plan = _Plan(filling, excitation, particles, seeds, oscillator, dt, duration, interval)
    with reporting(progress, "shaking") as report_progress:
        batch = plan.batch(mount, effects)
        batch.start(displacement=displacement, velocity=velocity)
        words = f"{plan.words(mount)}, from {displacement} m and {velocity} m/s"
        with batch.checkpointed(checkpoint, resume, {"job": words}) as writer:
            cycles = batch.run(0, 1, report_progress, record_every=plan.every)
            writer.save()
    return plan.history(batch, cycles)


class _Plan:
    """The checked arguments: one window that lasts as long as the run, in even samples."""

    def __init__(self, filling, excitation, particles, seeds, oscillator, dt, duration, interval):
        self.filling = check_filling(filling)
        self.excitation = one_for_all(excitation)
        self.oscillator = Oscillator() if oscillator is None else oscillator
        instance("oscillator", self.oscillator, Oscillator)
        most = filling.capacity
        self.particles = several("particles", particles, lambda n, x: whole(n, x, 0, most))
        self.seeds = run_seeds(seeds)
        if len(self.particles) * len(self.seeds) > MOST_SCENES:
            raise InputError(f"particles x seeds must make at most {MOST_SCENES} scenes")
        lasting = run_duration(self.excitation, duration)
        dt = filling.default_dt if dt is None else positive("dt", dt)
        self.duration, self.samples, self.every, self.dt = window(lasting, dt, interval)

    def words(self, mount):
        """The run without the filling, in words."""
        axes = f"particles {self.particles}, seeds {self.seeds}, dt {self.dt}, every {self.every}"
        return f"shaken for {self.duration} s on the {mount}, {axes}, {self.oscillator}"

    def batch(self, mount, effects):
        """Batch of all scenes, the last axis (seeds) running fastest."""
        numbers, seeds = np.meshgrid(self.particles, self.seeds, indexing="ij")
        o = self.oscillator
        structure = (0.0, o.mass, o.stiffness, o.damping)
        one = 1.0 / self.duration
        table = SceneTable(numbers.ravel(), seeds.ravel(), self.dt, one, *structure)
        options: dict[str, Any] = {"excitation": self.excitation, "recorded_samples": self.samples}
        return Batch(
            self.filling, table, mount=mount, measured_cycles=1, effects=effects, **options
        )

    def history(self, batch, cycles):
        """What the batch recorded."""
        series, shape = batch.time_series(), (len(self.particles), len(self.seeds))
        sound = int(np.argmin(batch.diverged))
        highest = np.maximum(cycles.mean_of("x_max"), -cycles.mean_of("x_min"))
        return TimeHistory(
            *(self.filling.label, self.oscillator, self.excitation, self.particles, self.seeds),
            time_s=series["time_s"][:, sound],
            base=series["y"][:, sound],
            rms=cycles.rms.reshape(shape),
            peak=highest.reshape(shape),
            report=batch.report(),
            **{name: series[name].reshape(-1, *shape) for name in ("x", "v", "force")},
        )
