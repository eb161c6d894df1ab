"""Frequency response of the damped structure: every particle number, frequency and seed a scene."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ca_damper.batch import Batch
from ca_damper.filling import Filling, check_filling
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import MEASURE_UNITS, Cycles, column_of, peak
from ca_damper.report.report import Report
from ca_damper.report.steady_state import LEAST_TESTED, change_of_halves, half_width
from ca_damper.runs.result import ScenesResult, scenes_over
from ca_damper.scenes.checks import check_run, run_seeds
from ca_damper.scenes.clock import automatic_dt, steps_per_cycle
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.checkpoint import Checkpoint, identity_of
from taichi_dem.kit.data_table import Tabulated, unit_of
from taichi_dem.kit.display import counted, embedded, in_brief, listed, table, titled, verbatim
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, FileName, instance, positive, several, whole

#: Particle numbers that a notebook shows, evenly over those there are.
_MOST_SHOWN = 8
#: In tables, of a peak at an end of the ratios, where its height cannot be known.
OUTSIDE = "outside"
#: Likewise, of a curve with a scene that diverged.
DIVERGED = "diverged"
#: Of the sampling error in a report.
_CONFIDENCE = 0.95
# Share of a start that may be left in the middle of the measured cycles.
_LEFT = 0.1


_PEAK_COLUMNS = (
    *("particles", "peak at f/f0", "peak at [Hz]"),
    *("peak RMS [mm], median over seeds", "lowest to highest"),
)


@dataclass(frozen=True, eq=False)
class Response(ScenesResult):
    """Response curves of a filling; every measure is an array (particles, ratios, seeds).

    A notebook shows its curves and a table of the peaks, and marks those at an end of the ratios.

    Parameters
    ----------
    label : str
        Short word for the filling.
    oscillator : Oscillator
        Primary structure.
    particles : tuple of int
        Numbers of particles.
    ratios : ndarray
        Frequency over the natural one of the empty container [-], ascending, shape (ratios,).
    seeds : tuple of int
        Seeds.
    steps_per_cycle : ndarray
        Steps in a cycle at each ratio, shape (ratios,).
    rms : ndarray
        RMS of the displacement about its mean in each cycle [m].
    amplitude : ndarray
        Half the distance from the lowest to the highest displacement [m].
    mean : ndarray
        Mean displacement [m].
    mean_force : ndarray
        Mean force of the filling on the container [N].
    apparent_mass : ndarray
        Apparent mass of the filling [kg], of ``measures.Cycles``.
    apparent_damping : ndarray
        Apparent damping of the filling [N s/m], of ``measures.Cycles``.
    loss_factor : ndarray
        Loss factor [-], of ``measures.Cycles``.
    damping_ratio : ndarray
        Damping ratio [-], of ``measures.Cycles``.
    energy : ndarray
        Energy of the particles [J].
    rms_about_all : ndarray
        RMS of the displacement about its mean in all cycles [m], which includes slower motions.
    report : Report, optional
        Figures and cost of the run; None for one direction of a sweep.
    """

    label: str
    oscillator: Oscillator
    particles: tuple
    ratios: np.ndarray
    seeds: tuple
    steps_per_cycle: np.ndarray
    rms: np.ndarray
    amplitude: np.ndarray
    mean: np.ndarray
    mean_force: np.ndarray
    apparent_mass: np.ndarray
    apparent_damping: np.ndarray
    loss_factor: np.ndarray
    damping_ratio: np.ndarray
    energy: np.ndarray
    rms_about_all: np.ndarray
    report: Report | None = None

    def __repr__(self):
        highest = f"largest RMS {1e3 * np.fmax.reduce(self.rms, axis=None, initial=np.nan):.4g} mm"
        return in_brief(self, self.axes_in_words(), highest)

    def axes_in_words(self) -> str:
        """Filling, particles, ratios and seeds in words."""
        axes = f"particles {listed(self.particles)}, f/f0 {listed(self.ratios)}"
        return f"{self.label}, {axes}, {counted(len(self.seeds), 'seed')}"

    def _repr_html_(self):
        # Imported here, so that matplotlib loads only where a picture is shown.
        from taichi_dem.kit.plot_style import png_of

        count = len(self.particles)
        rows = np.unique(np.linspace(0, count - 1, _MOST_SHOWN).round().astype(int))
        png = png_of(self.plot._curves("rms", rows=rows))
        some = f" ({len(rows)} of {count} particle numbers)" if len(rows) < count else ""
        return titled(
            f"Response: {self.axes_in_words()}{some}",
            embedded(png, "RMS displacement over frequency"),
            table(self._peak_rows(rows), _PEAK_COLUMNS),
            verbatim(self.report.details()) if self.report else "",
        )

    def _peak_rows(self, rows):
        """Cells of the table of peaks: median over the seeds, and lowest to highest RMS."""
        natural = self.oscillator.natural_frequency
        peak_rows = []
        for k, ratio, rms in zip(rows, *(measure[rows] for measure in self.peaks())):
            middle, spread = np.median(ratio), 1e3 * rms
            cells = f"{middle:.4f}", f"{natural * middle:.4g}", f"{np.median(spread):.4g}"
            ends = f"{spread.min():.4g} to {spread.max():.4g}"
            unknown = DIVERGED if np.isnan(self.rms[k]).any() else OUTSIDE
            row = (*cells, ends) if math.isfinite(middle) else (unknown,) * 4
            peak_rows.append((f"{self.particles[k]}", *row))
        return peak_rows

    def peaks(self) -> tuple[np.ndarray, np.ndarray]:
        """Locate the peak of each curve.

        Returns
        -------
        tuple of (ndarray, ndarray)
            Frequency ratio f/f0 [-] and RMS displacement [m], shape (particles, seeds) each. NaN
            where a peak lies outside the ratios: its curve is highest at the first or last of them.
        """
        curves = np.moveaxis(self.rms, 2, 1).reshape(-1, len(self.ratios))
        peaks = np.array([peak(self.ratios, curve) for curve in curves])
        shape = (len(self.particles), len(self.seeds))
        return peaks[:, 0].reshape(shape), peaks[:, 1].reshape(shape)

    @property
    def dt(self) -> np.ndarray:
        """Step at each ratio [s]: the one asked for, shortened to make whole steps a cycle."""
        return 1.0 / (self.ratios * self.oscillator.natural_frequency * self.steps_per_cycle)

    @property
    def units(self) -> dict[str, str]:
        """Unit of every measure, by name."""
        return {name: unit_of(column_of(name)) for name in MEASURE_UNITS}

    def _axes(self) -> dict[str, Any]:
        frequency = self.ratios * self.oscillator.natural_frequency
        axes = {"particles": (self.particles, "1"), "frequency": (frequency, "Hz")}
        return {**axes, "seed": (self.seeds, "1")}

    def _variables(self) -> dict[str, Any]:
        dims = "particles", "frequency", "seed"
        return {name: (dims, getattr(self, name), unit) for name, unit in self.units.items()}

    def to_xarray(self) -> Any:
        """As of ``ScenesResult``; ``ratio`` is along frequency."""
        ratio = "frequency", self.ratios, {"units": "1"}
        return super().to_xarray().assign_coords(ratio=ratio)

    @property
    def plot(self) -> Any:
        """Pictures of the response, one function each: ``response.plot.curves("loss_factor")``."""
        # Imported here, so that matplotlib loads only where a picture is drawn.
        from ca_damper.plot.curves import ResponsePlots

        return ResponsePlots(self)

    def columns(self) -> dict[str, Any]:
        """Columns of equal length with a row a scene, as they are written."""
        columns: dict[str, Any] = {"filling": [self.label] * self.rms.size}
        columns |= scenes_over(particles=self.particles, ratio=self.ratios, seed=self.seeds)
        columns["frequency_Hz"] = columns["ratio"] * self.oscillator.natural_frequency
        return columns | {column_of(name): getattr(self, name).ravel() for name in MEASURE_UNITS}


@dataclass(frozen=True, eq=False)
class AmplitudeResponse(Tabulated):
    """A Response for each amplitude of the base, from one batch.

    Returned by ``frequency_response`` for several amplitudes of the base, as a sequence.

    Parameters
    ----------
    amplitudes : tuple of float
        Amplitudes of the base [m].
    responses : tuple of Response
        A Response for each amplitude; each has the report of the whole batch.
    """

    amplitudes: tuple[float, ...]
    responses: tuple[Response, ...]

    def __repr__(self) -> str:
        amplitudes = f"base amplitudes {listed([1e3 * a for a in self.amplitudes])} mm"
        return in_brief(self, amplitudes, self.responses[0].axes_in_words())

    def __len__(self) -> int:
        return len(self.responses)

    def __getitem__(self, k: int) -> Response:
        return self.responses[k]

    def __iter__(self) -> Iterator[Response]:
        return iter(self.responses)

    def peaks(self) -> tuple[np.ndarray, np.ndarray]:
        """Locate the peak of each curve.

        Returns
        -------
        tuple of (ndarray, ndarray)
            Frequency ratio f/f0 [-] and RMS displacement [m] of the peaks, each of shape
            (amplitudes, particles, seeds); NaN where a peak lies outside the ratios.
        """
        ratio, rms = zip(*(response.peaks() for response in self.responses))
        return np.stack(ratio), np.stack(rms)

    def columns(self) -> dict[str, Any]:
        """A row a scene, as of ``Response.columns``, with its amplitude in front."""
        columns = [response.columns() for response in self.responses]
        sizes = [len(response["filling"]) for response in columns]
        joined = {
            name: np.concatenate([response[name] for response in columns]) for name in columns[0]
        }
        amplitude = np.repeat(self.amplitudes, sizes)
        return {"base_amplitude_m": amplitude, **joined}

    def to_xarray(self) -> Any:
        """As ``Response.to_xarray``, over base_amplitude [m] too."""
        return stacked(self.responses, "base_amplitude", list(self.amplitudes), units="m")


def frequency_response(
    filling: Filling,
    *,
    particles: int | Sequence[int],
    ratios: float | Sequence[float] | np.ndarray,
    seeds: int | Sequence[int] = 5,
    oscillator: Oscillator | None = None,
    dt: float | None = None,
    base_amplitude: float | Sequence[float] | None = None,
    transient_cycles: int = 150,
    measured_cycles: int = 20,
    start: str = "rest",
    effects: str = "listed",
    progress: Listener | str | None = AUTO,
    checkpoint: Checkpoint | None = None,
    resume: FileName | None = None,
) -> Any:
    """Response curves of a filling, all scenes in one batch.

    Parameters
    ----------
    filling : Filling
        Filling of the container, such as ``Automaton()`` or ``Spheres()``.
    particles : int or sequence of int
        Numbers of particles, one or several.
    ratios : float or sequence of float or ndarray
        Ascending frequency ratios f/f0 [-], f0 of the empty container.
    seeds : int or sequence of int, default 5
        Number of seeds, counted from 1, or the seeds themselves.
    oscillator : Oscillator, optional
        Primary structure; that of the paper if None.
    dt : float, optional
        Largest step [s]; that of the filling if None.
    base_amplitude : float or sequence of float, optional
        Amplitude of the base [m]; that of the oscillator if None.
    transient_cycles : int, default 150
        Cycles before the measured ones.
    measured_cycles : int, default 20
        Cycles to measure.
    start : str, default "rest"
        Motion of the container at the beginning: ``"rest"``, ``"empty"`` or ``"rigid"``.
    effects : str, default "listed"
        ``"listed"`` or ``"auto"``, see ``Batch``; ``report.certificate`` tells which acted.
    progress : callable or str or None, default "auto"
        ``"auto"``: a bar on a terminal and in Jupyter, elsewhere lines. None: silence. A function
        is called with a Progress while kernels are compiled, and then six times a second.
    checkpoint : Checkpoint, optional
        Where and when the run saves itself; it also does so at its end and on Ctrl-C.
    resume : path, optional
        Checkpoint to continue from; the bits are those of an uninterrupted run.

    Returns
    -------
    Response or AmplitudeResponse
        The latter where several base amplitudes are given.

    Raises
    ------
    SimulationDiverged
        All scenes diverged. If only some do, a warning names them, and their results are nan.

    Examples
    --------
    >>> response = frequency_response(
    ...     Automaton(), particles=[10, 30], ratios=[0.95, 0.97, 0.99], seeds=3
    ... )  # doctest: +SKIP
    >>> ratio, rms = response.peaks()  # doctest: +SKIP
    """
    grid = Grid(filling, particles, ratios, seeds, oscillator, dt, base_amplitude)
    check_run(transient_cycles, measured_cycles, start, progress)
    job = f"response, {grid.identity()}, {transient_cycles} + {measured_cycles} cycles from {start}"
    with reporting(progress, "response") as report_progress:
        batch = grid.batch(grid.ratios, measured_cycles, effects)
        batch.start(start)
        with batch.checkpointed(checkpoint, resume, {"job": job}) as writer:
            cycles = batch.run(transient_cycles, measured_cycles, report_progress)
            sampled = _sampling(cycles, grid.oscillator, transient_cycles)
            report = replace(batch.report(), **sampled)
            responses = tuple(
                replace(response, report=report) for response in grid.responses(batch, cycles)
            )
            result = (
                AmplitudeResponse(grid.amplitudes, responses) if grid.is_several else responses[0]
            )
            writer.save(result)
    return result


def _sampling(cycles, oscillator, transient):
    """What is known of the mean RMS in the scene where it is highest, by name for a Report."""
    highest = int(np.nanargmax(cycles.rms))
    last = slice(highest, highest + 1)
    scene = Cycles(cycles.frequency[last], cycles.steps[last], cycles.record[last])
    series = scene.rms_by_cycle[0]
    mean = float(series.mean())
    if not mean > 0.0 or len(series) < 2:
        return {}
    if len(series) < LEAST_TESTED:
        few = counted(len(series), "cycle")
        return {"transient": f"a mean over {few}, {LEAST_TESTED} show whether it still changes"}
    change, may_be_chance = change_of_halves(series)
    if not may_be_chance:
        trend = "grows" if change > 0.0 else "falls"
        share, all_of_them = f"{100.0 * abs(change):.2g} %", counted(len(series), "cycle")
        return {"transient": f"it {trend} by {share} from half to half of {all_of_them}"}
    own = oscillator.mass, oscillator.stiffness, oscillator.damping
    ratio = float(scene.damping_ratio(*own)[0])
    left = math.exp(-2.0 * math.pi * ratio * (transient + 0.5 * len(series)))
    if left > _LEFT:
        # Beats of a light structure look steady at their extremes.
        by = f"by then, with a damping ratio of {ratio:.2g}"
        return {"transient": f"{100.0 * left:.2g} % of its start is left {by}"}
    return {"sampling": (len(series), half_width(series, _CONFIDENCE) / mean)}


class Grid:
    """The checked axes of a response: particles, ratios, seeds, amplitudes, and the step."""

    def __init__(
        self,
        filling: Filling,
        particles: int | Sequence[int],
        ratios: float | Sequence[float] | np.ndarray,
        seeds: int | Sequence[int],
        oscillator: Oscillator | None,
        dt: float | None,
        base_amplitude: float | Sequence[float] | None = None,
    ):
        self.filling = check_filling(filling)
        own = instance("oscillator", Oscillator() if oscillator is None else oscillator, Oscillator)
        given = own.base_amplitude if base_amplitude is None else base_amplitude
        self.is_several = hasattr(base_amplitude, "__iter__")
        self.amplitudes = several(
            "base_amplitude", given, lambda name, x: positive(name, x, zero_allowed=True)
        )
        self.oscillator = replace(own, base_amplitude=self.amplitudes[0])
        most = filling.capacity
        self.particles = several("particles", particles, lambda name, n: whole(name, n, 0, most))
        self.ratios = np.array(several("ratios", ratios, positive))
        if (np.diff(self.ratios) <= 0.0).any():
            raise InputError(f"ratios must ascend, got {self.ratios.tolist()}")
        self.seeds = run_seeds(seeds)
        highest = float(self.ratios[-1]) * own.natural_frequency
        longest = automatic_dt(filling.default_dt, highest)
        self.dt = longest if dt is None else positive("dt", dt)
        self._check_steps()

    def _check_steps(self):
        """InputError for a step that fits no cycle, or that the filling refuses."""
        for frequency in self.ratios * self.oscillator.natural_frequency:
            dt = 1.0 / (frequency * steps_per_cycle(float(frequency), self.dt))
            for particles in self.particles:
                self.filling.check(particles, float(dt))

    def identity(self) -> str:
        """Words that are the same for equal scenes, whatever the filling."""
        axes = self.amplitudes, self.particles, self.ratios, self.seeds
        return identity_of((*axes, self.dt, self.oscillator))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Of the measures: particles, ratios, seeds."""
        return len(self.particles), len(self.ratios), len(self.seeds)

    def batch(self, ratios: np.ndarray, measured_cycles: int, effects: str = "listed") -> Batch:
        """Batch of all scenes at these ratios, amplitude by amplitude, seeds running fastest."""
        o = self.oscillator
        scenes = scenes_over(
            amplitudes=self.amplitudes, particles=self.particles, ratios=ratios, seeds=self.seeds
        )
        amplitude, number, ratio, seed = scenes.values()
        structure = (amplitude, o.mass, o.stiffness, o.damping)
        table = SceneTable(number, seed, self.dt, ratio * o.natural_frequency, *structure)
        return Batch(self.filling, table, measured_cycles=measured_cycles, effects=effects)

    def measures(self, cycles: Cycles) -> dict[str, np.ndarray]:
        """Measures of all scenes by name, each (scenes,)."""
        return measures_of(self.oscillator, cycles)

    def response(self, steps: np.ndarray, values: Mapping[str, Any]) -> Response:
        """Response of measures by name, each of our shape; steps: a cycle, (ratios,)."""
        axes = (self.particles, self.ratios, self.seeds)
        return Response(self.filling.label, self.oscillator, *axes, steps, **values)

    def responses(self, batch: Batch, cycles: Cycles) -> Iterator[Response]:
        """The Response of a batch that has run, one for each amplitude."""
        shape = (len(self.amplitudes), *self.shape)
        steps = batch.steps_per_cycle.reshape(shape)[0, 0, :, 0]
        values = {name: measure.reshape(shape) for name, measure in self.measures(cycles).items()}
        for k, amplitude in enumerate(self.amplitudes):
            response = self.response(steps, {name: measure[k] for name, measure in values.items()})
            yield replace(response, oscillator=replace(self.oscillator, base_amplitude=amplitude))


def stacked(responses: Sequence[Response], name: str, values: list, **attributes: str) -> Any:
    """Responses as an xarray Dataset over a further axis, whose values and attributes are given."""
    import xarray

    axis = xarray.Variable(name, values, attributes)
    return xarray.concat([response.to_xarray() for response in responses], axis)


def measures_of(oscillator: Oscillator, cycles: Cycles) -> dict[str, np.ndarray]:
    """Measures of scenes on an oscillator by name, those of a Response, each (scenes,)."""
    o = oscillator
    of_structure = {
        "loss_factor": cycles.loss_factor(o.mass),
        "damping_ratio": cycles.damping_ratio(o.mass, o.stiffness, o.damping),
    }
    plain = {name: getattr(cycles, name) for name in MEASURE_UNITS if name not in of_structure}
    return {**plain, **of_structure}
