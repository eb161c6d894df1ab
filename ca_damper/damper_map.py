"""Maps of a driven damper: loss and apparent mass over amplitude, frequency, number, clearance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.batch import Batch
from ca_damper.checks import MOST_CYCLES, MOST_SCENES, MOST_SEED
from ca_damper.collect_and_collide import CollectAndCollide, collect_and_collide
from ca_damper.filling import Filling, check_filling
from ca_damper.progress import Stages
from ca_damper.report import Report
from ca_damper.scenes.clock import automatic_dt
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.data_table import Tabulated, dataset
from taichi_dem.kit.display import in_brief, listed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import (
    AUTO,
    positive,
    progress_option,
    several,
    shown,
    whole,
)

_AXES = ("clearances", "particles", "amplitudes", "frequencies", "seeds")
_UNITS = ("m", "1", "m", "Hz", "1")


@dataclass(frozen=True, eq=False)
class DamperMap(Tabulated):
    """Measures of a container that is driven as A sin(2 pi f t), whatever its filling does.

    The axes of all measures are clearances, particles, amplitudes, frequencies, seeds, in this
    order.

    Parameters
    ----------
    label : str
        Short word for the filling.
    particle_mass : float
        Mass of a particle [kg].
    clearances : tuple of float
        Distances from the settled grains to the lid [m]; (None,) for the box as it is.
    particles : tuple of int
        Numbers of particles.
    amplitudes : tuple of float
        Amplitudes A of the container [m].
    frequencies : tuple of float
        Frequencies f of the container [Hz].
    seeds : tuple of int
        Seeds.
    gaps : ndarray
        Clearance of each box [m], shape (clearances, particles).
    apparent_damping : ndarray
        Apparent damping of the filling [N s/m], of ``measures.Cycles``.
    apparent_mass : ndarray
        Apparent mass of the filling [kg], of ``measures.Cycles``.
    reports : tuple of Report, default ()
        Report of each batch.
    """

    label: str
    particle_mass: float
    clearances: tuple
    particles: tuple
    amplitudes: tuple
    frequencies: tuple
    seeds: tuple
    gaps: np.ndarray
    apparent_damping: np.ndarray
    apparent_mass: np.ndarray
    reports: tuple[Report, ...] = ()

    def __repr__(self) -> str:
        names = ("particles", "amplitudes", "frequencies")
        axes = (f"{name} {listed(getattr(self, name))}" for name in names)
        return in_brief(self, self.label, *axes, f"largest loss {np.nanmax(self.loss):.4g}")

    @property
    def omega(self) -> np.ndarray:
        """Angular frequencies [rad/s], (frequencies, 1), which broadcast against measures."""
        return 2.0 * np.pi * np.array(self.frequencies)[:, None]

    @property
    def mass(self) -> np.ndarray:
        """Mass of the filling [kg], (particles, 1, 1, 1)."""
        return self.particle_mass * np.array(self.particles, float)[:, None, None, None]

    @property
    def loss(self) -> np.ndarray:
        """Apparent damping by N m w: 1 for grains that take N m A^2 w^2 / 2 in a radian."""
        return self.apparent_damping / (self.mass * self.omega)

    @property
    def mass_share(self) -> np.ndarray:
        """Apparent mass by N m: 1 for grains that move along."""
        return self.apparent_mass / self.mass

    @property
    def energy(self) -> np.ndarray:
        """Energy taken in a cycle by N m A^2 w^2."""
        return np.pi * self.loss

    def loss_factor(self, container_mass: float) -> np.ndarray:
        """Energy lost in a radian over the energy in motion, c / (w (M + m)).

        Parameters
        ----------
        container_mass : float
            Mass M of the container [kg].

        Returns
        -------
        ndarray
            Loss factor [-], shape of all axes.
        """
        moving = positive("container_mass", container_mass) + self.apparent_mass
        return self.apparent_damping / (self.omega * moving)

    @property
    def theory(self) -> CollectAndCollide:
        """Collect and collide without gravity, at every clearance, number and amplitude."""
        return collect_and_collide(np.array(self.amplitudes), self.gaps[:, :, None])

    def to_xarray(self) -> Any:
        """An xarray Dataset over clearance, particles, amplitude, frequency and seed.

        Returns
        -------
        xarray.Dataset
            ``apparent_damping``, ``apparent_mass``, ``loss``, ``mass_share``, ``energy``, and
            ``gap``, the clearance of each box; units in attributes.
        """
        dims = "clearance", "particles", "amplitude", "frequency", "seed"
        units = {"apparent_damping": "N s/m", "apparent_mass": "kg", "loss": "1"}
        units.update(mass_share="1", energy="1")
        found: dict[str, Any] = {n: (dims, getattr(self, n), u) for n, u in units.items()}
        found["gap"] = dims[:2], self.gaps, "m"
        axes = {one: (getattr(self, name), unit) for one, name, unit in zip(dims, _AXES, _UNITS)}
        if self.clearances == (None,):
            del axes["clearance"]
        return dataset(found, axes, filling=self.label)

    def columns(self) -> dict[str, Any]:
        """A row a scene: its place on the axes, measures, and the theory's loss and mass.

        Returns
        -------
        dict
            Columns by name, which ends in the unit.
        """
        indices = np.indices(self.loss.shape).reshape(len(_AXES), -1)
        clearance, number, amplitude = indices[:3]
        columns: dict[str, Any] = {"filling": [self.label] * len(clearance)}
        columns["clearance_m"] = self.gaps[clearance, number]
        units = {"particles": "particles", "amplitudes": "amplitude_m"}
        units.update(frequencies="frequency_Hz", seeds="seed")
        for name, axis in zip(_AXES[1:], indices[1:]):
            columns[units[name]] = np.array(getattr(self, name))[axis]
        for name in ("loss", "mass_share", "energy"):
            columns[name] = getattr(self, name).ravel()
        made = self.theory
        for name in ("loss", "mass"):
            columns[f"{name}_theory"] = getattr(made, name)[clearance, number, amplitude]
        return columns


def damper_map(
    filling: Filling,
    *,
    amplitudes: float | Sequence[float],
    frequencies: float | Sequence[float],
    particles: int | Sequence[int],
    clearances: float | Sequence[float] | None = None,
    seeds: int | Sequence[int] = 3,
    dt: float | None = None,
    transient_cycles: int = 50,
    measured_cycles: int = 50,
    progress: Listener | str | None = AUTO,
) -> DamperMap:
    """Loss and apparent mass of a driven damper over all its axes.

    Parameters
    ----------
    filling : Filling
        Filling of the container.
    amplitudes : float or sequence of float
        Amplitudes of the container [m], one or several.
    frequencies : float or sequence of float
        Frequencies of the container [Hz], one or several.
    particles : int or sequence of int
        Numbers of particles, one or several.
    clearances : float or sequence of float, optional
        Distances from the settled grains to the lid [m]; the box is made as high as each needs.
        None: the box of the filling as it is.
    seeds : int or sequence of int, default 3
        Number of seeds, counted from 1, or the seeds themselves.
    dt : float, optional
        Largest step [s]; chosen from the filling and the highest frequency if None.
    transient_cycles : int, default 50
        Cycles before the measured ones.
    measured_cycles : int, default 50
        Cycles to measure.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.

    Returns
    -------
    DamperMap
        Measures over all axes.

    Raises
    ------
    InputError
        An argument is out of its range, or the filling has no box to change.
    SimulationDiverged
        All scenes left the range in which their numbers mean anything. Where some did, a warning
        tells which, and their results are nan.

    Examples
    --------
    >>> damper_map(
    ...     Spheres(), amplitudes=[5e-3, 1e-2], frequencies=10.0, particles=30
    ... )  # doctest: +SKIP
    """
    check_filling(filling)
    progress_option("progress", progress)
    plan = _Plan(filling, amplitudes, frequencies, particles, seeds)
    plan.transient = whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
    plan.measured = whole("measured_cycles", measured_cycles, 1, 100_000)
    plan.dt = automatic_dt(filling.default_dt, max(plan.frequencies))
    plan.dt = plan.dt if dt is None else positive("dt", dt)
    jobs = plan.jobs(clearances)
    with reporting(progress, "map") as report_progress:
        tell = Stages(report_progress, [(k + 1.0) / len(jobs) for k in range(len(jobs))])
        runs = [plan.run(one, numbers, tell) for one, numbers in jobs]
    return plan.map(clearances, jobs, runs)


class _Plan:
    """The checked axes of a map."""

    transient: int
    measured: int
    dt: float

    def __init__(self, filling, amplitudes, frequencies, particles, seeds):
        self.filling = filling
        self.amplitudes = several("amplitudes", amplitudes, positive)
        self.frequencies = several("frequencies", frequencies, positive)
        self.particles = several("particles", particles, lambda n, x: whole(n, x, 1, 1_000_000))
        if not hasattr(seeds, "__iter__") or isinstance(seeds, (str, bytes, dict)):
            seeds = range(1, whole("seeds", seeds, 1, 1_000_000) + 1)
        self.seeds = several("seeds", seeds, lambda n, x: whole(n, x, 0, MOST_SEED))
        self.scenes = len(self.amplitudes) * len(self.frequencies) * len(self.seeds)
        if self.scenes * len(self.particles) > MOST_SCENES:
            raise InputError(
                f"amplitudes x frequencies x particles x seeds must make at most {MOST_SCENES} "
                f"scenes, got {self.scenes * len(self.particles)}"
            )

    def jobs(self, clearances):
        """(filling, particle numbers) of each batch."""
        if clearances is None:
            return [(self.filling, self.particles)]
        ways = several("clearances", clearances, positive)
        return [
            (with_clearance(self.filling, number, way), (number,))
            for way in ways
            for number in self.particles
        ]

    def run(self, filling, numbers, progress):
        """Cycles of all scenes of a batch, and its report."""
        axes = numbers, self.amplitudes, self.frequencies, self.seeds
        number, size, frequency, seed = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
        table = SceneTable(number, seed, self.dt, frequency, size)
        batch = Batch(filling, table, mount="base", measured_cycles=self.measured)
        batch.start()
        return batch.run(self.transient, self.measured, progress), batch.report()

    def map(self, clearances, jobs, runs):
        """The map of all runs."""
        ways = (None,) if clearances is None else several("clearances", clearances, positive)
        shape = len(ways), len(self.particles), len(self.amplitudes), len(self.frequencies)
        gaps = [clearance_of(one, number) for one, numbers in jobs for number in numbers]

        def joined(name):
            values = [getattr(cycles, name) for cycles, _ in runs]
            return np.concatenate(values).reshape(*shape, len(self.seeds))

        return DamperMap(
            *(self.filling.label, self.filling.particle_mass, ways, self.particles),
            *(self.amplitudes, self.frequencies, self.seeds),
            gaps=np.array(gaps).reshape(shape[:2]),
            apparent_damping=joined("apparent_damping"),
            apparent_mass=joined("apparent_mass"),
            reports=tuple(report for _, report in runs),
        )


def clearance_of(filling: Any, particles: int) -> float:
    """Way of settled grains, in N / columns layers, to the lid of a filling's box [m], or NaN."""
    return float(filling.clearance(particles)) if hasattr(filling, "clearance") else math.nan


def with_clearance(filling: Any, particles: int, clearance: float) -> Any:
    """The filling in a box with a clearance [m] above so many settled grains.

    InputError for a filling without a box, and for an automaton whose box would end within a cell.
    """
    if not hasattr(filling, "with_clearance"):
        raise InputError(
            f"clearances must be None for a filling without a box, got {shown(clearance)} for "
            f"{shown(filling)}"
        )
    return filling.with_clearance(particles, clearance)
