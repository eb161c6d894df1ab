"""Maps of a driven damper: loss and apparent mass over amplitude, frequency, number, clearance."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.batch import Batch
from ca_damper.filling import Filling, check_filling
from ca_damper.report.progress import Stages
from ca_damper.report.report import Report
from ca_damper.runs.result import ScenesResult, scenes_over
from ca_damper.scenes.checks import STARTS, check_run, run_seeds
from ca_damper.scenes.clock import automatic_dt
from ca_damper.scenes.table import SceneTable
from ca_damper.theory.collect_and_collide import CollectAndCollide, collect_and_collide
from taichi_dem.kit.display import in_brief, listed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import (
    AUTO,
    positive,
    several,
    shown,
    whole,
)

#: Axes of a map: attribute and unit by dimension; units of its measures.
_AXES = {
    "clearance": ("clearances", "m"),
    "particles": ("particles", "1"),
    "amplitude": ("amplitudes", "m"),
    "frequency": ("frequencies", "Hz"),
    "seed": ("seeds", "1"),
}
_UNITS = {"apparent_damping": "N s/m", "apparent_mass": "kg"}
_UNITS |= dict.fromkeys(("loss", "mass_share", "energy"), "1")


@dataclass(frozen=True, eq=False)
class DamperMap(ScenesResult):
    """Measures of a container that is driven as A sin(2 pi f t), whatever its filling does.

    Axes of all measures: clearances, particles, amplitudes, frequencies, seeds.

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

    @property
    def theory(self) -> CollectAndCollide:
        """Collect and collide without gravity, at every clearance, number and amplitude."""
        return collect_and_collide(np.array(self.amplitudes), self.gaps[:, :, None])

    def _axes(self) -> dict[str, Any]:
        axes = {key: (getattr(self, name), unit) for key, (name, unit) in _AXES.items()}
        return {key: axis for key, axis in axes.items() if axis[0] != (None,)}

    def _variables(self) -> dict[str, Any]:
        variables = {
            name: (tuple(_AXES), getattr(self, name), unit) for name, unit in _UNITS.items()
        }
        return {**variables, "gap": (("clearance", "particles"), self.gaps, "m")}

    def columns(self) -> dict[str, Any]:
        """A row a scene: its place on the axes, measures, and where there is one the theory."""
        names = "clearance_m", "particles", "amplitude_m", "frequency_Hz", "seed"
        axes = dict(zip(names, (getattr(self, name) for name, _ in _AXES.values())))
        columns: dict[str, Any] = {"filling": [self.label] * self.loss.size} | scenes_over(**axes)
        columns["clearance_m"] = self._of_scenes(self.gaps)
        columns |= {name: getattr(self, name).ravel() for name in ("loss", "mass_share", "energy")}
        if np.isnan(self.gaps).any():  # a filling without a box: no theory
            return columns
        theory_columns = {"loss_theory": self.theory.loss, "mass_theory": self.theory.mass}
        return columns | {name: self._of_scenes(values) for name, values in theory_columns.items()}

    def _of_scenes(self, values: np.ndarray) -> np.ndarray:
        """Values over the first axes as a number a scene, (scenes,)."""
        shape = self.loss.shape
        alike = np.reshape(values, (*values.shape, *[1] * (len(shape) - values.ndim)))
        return np.broadcast_to(alike, shape).ravel()


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
        Distances from the settled grains to the lid [m]. None: the box of the filling as it is.
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

    Raises
    ------
    SimulationDiverged
        All scenes diverged. If only some do, a warning names them, and their results are nan.

    Examples
    --------
    >>> damper_map(
    ...     Spheres(), amplitudes=[5e-3, 1e-2], frequencies=10.0, particles=30
    ... )  # doctest: +SKIP
    """
    axes: dict[str, Any] = {
        "particles": several("particles", particles, lambda n, x: whole(n, x, 1, 1_000_000)),
        "amplitudes": several("amplitudes", amplitudes, positive),
        "frequencies": several("frequencies", frequencies, positive),
        "seeds": run_seeds(seeds),
    }
    check_run(transient_cycles, measured_cycles, STARTS[0], progress)
    cycles = transient_cycles, measured_cycles
    longest = automatic_dt(check_filling(filling).default_dt, max(axes["frequencies"]))
    step = longest if dt is None else positive("dt", dt)
    ways = (None,) if clearances is None else several("clearances", clearances, positive)
    jobs = _jobs(filling, axes["particles"], ways)
    with reporting(progress, "map") as report_progress:
        tell = Stages(report_progress, [(k + 1.0) / len(jobs) for k in range(len(jobs))])
        runs = [
            _run(box, {**axes, "particles": numbers}, step, cycles, tell) for box, numbers in jobs
        ]
    gaps = [clearance_of(box, number) for box, numbers in jobs for number in numbers]
    shape = len(ways), *map(len, axes.values())
    measures: dict[str, Any] = {
        name: np.concatenate([getattr(run, name) for run, _ in runs]).reshape(shape)
        for name in ("apparent_damping", "apparent_mass")
    }
    own: dict[str, Any] = {
        "label": filling.label,
        "particle_mass": filling.particle_mass,
        "clearances": ways,
    }
    own |= {
        "gaps": np.array(gaps).reshape(shape[:2]),
        "reports": tuple(report for _, report in runs),
    }
    return DamperMap(**own, **axes, **measures)


def _jobs(filling, particles, clearances):
    if clearances == (None,):
        return [(filling, particles)]
    pairs = itertools.product(clearances, particles)
    return [(with_clearance(filling, number, clearance), (number,)) for clearance, number in pairs]


def _run(filling, axes, dt, cycles, progress):
    """Cycles of all scenes of a batch, and its report."""
    (transient, measured), scenes = cycles, scenes_over(**axes)
    frequency, size = scenes["frequencies"], scenes["amplitudes"]
    table = SceneTable(scenes["particles"], scenes["seeds"], dt, frequency, size)
    batch = Batch(filling, table, mount="base", measured_cycles=measured)
    batch.start()
    return batch.run(transient, measured, progress), batch.report()


def clearance_of(filling: Any, particles: int) -> float:
    """Way of settled grains, in N / columns layers, to the lid of a filling's box [m], or NaN."""
    return float(filling.clearance(particles)) if hasattr(filling, "clearance") else math.nan


def with_clearance(filling: Any, particles: int, clearance: float) -> Any:
    """The filling in a box with a clearance [m] above so many settled grains."""
    if not hasattr(filling, "with_clearance"):
        raise InputError(
            f"clearances must be None for a filling without a box, got {shown(clearance)} for "
            f"{shown(filling)}"
        )
    return filling.with_clearance(particles, clearance)
