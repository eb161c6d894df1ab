"""Many scenes, run together in launches of bounded length."""

import contextlib
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ca_damper.engine.damper_engine import borrow
from ca_damper.engine.launches import Launches
from ca_damper.engine.loaded_scenes import LoadedScenes
from ca_damper.engine.mount import ModalMount, mount_of
from ca_damper.engine.recorder import ROOM
from ca_damper.excitation.excitation import Excitation
from ca_damper.filling import Filling, Fillings
from ca_damper.report import measures
from ca_damper.report.certificate import (
    EFFECTS,
    Certificate,
    Periods,
    certificate_of,
    checked_range,
    periods_of,
)
from ca_damper.report.progress import BatchProgress
from ca_damper.report.report import RK45_STAGES, Report
from ca_damper.scenes.checks import (
    MOST_CYCLES,
    check_single_sine,
    check_within,
    checked_excitation,
    for_all,
    sampling_found,
    starts_of,
)
from ca_damper.scenes.scene_numbers import SceneNumbers
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit import backend, runtime
from taichi_dem.kit.checkpoint import identity_of, version_text
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.restart import CheckpointWriter, RunSnapshot, opened
from taichi_dem.kit.validation import choice, instance, positive, shown, whole

_MOST_STEPS = 2**31 - 1
#: Rounds of the loops of a step for each cell or particle: a launch that needs more is refused.
_ROUNDS_A_PLACE = 24


class Batch(LoadedScenes):
    """A filling, a table of scenes and the container's mount, ready to run.

    Below ``frequency_response``, ``shake`` and ``film``. A known structure compiles nothing.

    Parameters
    ----------
    filling : Filling or sequence of Filling
        Filling of the containers, such as ``Automaton()`` or ``Spheres()``; or one for each scene,
        all of one class with the same rules and effects, which differ in numbers and sizes.
    table : SceneTable
        Parameters of the scenes; the batch copies them. ``table.dt`` holds the largest step of each
        scene [s], which is shortened so that a whole number of steps makes a cycle of the base.
    mount : str, default "spring"
        ``"spring"``: on spring and dashpot. ``"base"``: moves like the base whatever the filling
        does. ``"floor"``: rests on the base, on a stiffness and damping that never pull.
    measured_cycles : int, default 1
        Largest number of cycles that one run may measure.
    rtol : float, default 1e-09
        Relative tolerance of RK45, as a share of the state of the container.
    atol : float, default 1e-12
        Absolute tolerance of RK45 [m, m/s].
    effects : str, default "listed"
        ``"listed"``: effects that the options of the filling ask for. ``"auto"``: effects that an
        estimate shows to be negligible are left out; see ``certificate``.
    excitation : Signal or Excitation, optional
        Base motion [m] of all scenes, or an Excitation. None: the sine of the table. Under a
        Signal, a cycle is a window of 1 / frequency and base_amplitude is not used.
    recorded_samples : int, default 0
        Largest number of samples that a run may record for ``time_series``.
    structure : ModalMount, optional
        Places of structures given by modes (``shake_structure``); None: single containers.
    if_diverged : str, default "nan"
        ``"nan"``: a scene that diverges has nan as results. ``"raise"``: it ends all.

    Attributes
    ----------
    diverged : ndarray
        Scenes that diverged, with all on the same structure, (scenes,); see ``divergences()``.
    run_seconds : float
        Wall time spent on stepping [s].
    compile_seconds : float
        Wall time spent on compiling [s].
    steps_per_cycle : ndarray
        Steps in a cycle of the base, shape (scenes,).

    Examples
    --------
    >>> table = SceneTable([10, 20], seed=1, dt=1e-4, base_amplitude=0.6e-3)
    >>> batch = Batch(Automaton(), table, measured_cycles=20)  # doctest: +SKIP
    >>> batch.start("rigid")  # doctest: +SKIP
    >>> batch.run(150, 20).rms  # doctest: +SKIP
    """

    def __init__(
        self,
        filling: Filling | Sequence[Filling],
        table: SceneTable,
        *,
        mount: str = "spring",
        measured_cycles: int = 1,
        rtol: float = 1e-9,
        atol: float = 1e-12,
        effects: str = "listed",
        excitation: object = None,
        recorded_samples: int = 0,
        structure: ModalMount | None = None,
        if_diverged: str = "nan",
    ):
        self.asked_effects = choice("effects", effects, EFFECTS)
        self.count = instance("table", table, SceneTable).count
        given = Fillings(filling, self.count)
        self.most_particles = int(table.column("particles").max())
        active = given.activated(self.most_particles) if effects == "auto" else (given, ())
        self.fillings, self.estimates = active
        runtime.session()
        self.if_diverged = choice("if_diverged", if_diverged, ("nan", "raise"))
        self.support = mount_of(mount, structure)
        self.mount = self.support.kind.word
        self.measured_cycles = whole("measured_cycles", measured_cycles, 0, 100_000)
        tolerances = positive("rtol", rtol, zero_allowed=True), positive("atol", atol)
        self.excitation = checked_excitation(excitation, mount)
        has_box = self.support.has_box(self.count)
        self.numbers = SceneNumbers(self.fillings, table, has_box)
        self.support.check(self.table)
        natural = self.support.frequencies(self.table)
        self.too_few = sampling_found(self.excitation, natural)
        self.recorded_samples = whole("recorded_samples", recorded_samples, 0, MOST_CYCLES)
        self.time_origin = np.zeros(self.count)
        self.periods: Periods | None = None
        self.launches, self.compile_seconds = Launches(self.count), 0.0
        # Whether the present run goes on from a checkpoint.
        self.going_on = False
        self.writer = CheckpointWriter()
        self._take_engine(*tolerances)

    def _take_engine(self, rtol: float, atol: float) -> None:
        counts = self.count, self.measured_cycles, self.recorded_samples
        kinds = self.support.kind, self.excitation.kind
        self._engine = borrow(self.fillings, *kinds, counts, self.excitation.sizes, owner=self)
        self._tell_compiling("set-up", 1)
        engine = self.engine
        engine.clear()
        engine.upload(self.fillings, self.table, self.support, rtol, atol, self.excitation)
        self._load_pace()
        if backend.most_rounds():
            rounds = _ROUNDS_A_PLACE * max(engine.capacity[3:], default=1)
            self.launches.most_steps = max(1, backend.most_rounds() // rounds)

    def __repr__(self) -> str:
        label, count = self.fillings.kinds[0].label, f"{self.count:,} scenes"
        return in_brief(self, label, count, f"on the {self.mount}")

    @property
    def run_seconds(self) -> float:
        """Time spent on stepping [s]."""
        return self.launches.run_seconds

    @property
    def scene_steps(self) -> int:
        """Steps of all scenes in all runs."""
        return self.launches.scene_steps

    def start(
        self, start: str = "rest", *, displacement: object = 0.0, velocity: object = 0.0
    ) -> None:
        """Place the particles at their start, at time zero, where the base passes zero upwards.

        Parameters
        ----------
        start : str, default "rest"
            ``"rest"``, the steady state of the ``"empty"`` container, or that of a container with
            the particles as a ``"rigid"`` mass; only ``"rest"`` unless the base is a single sine.
        displacement : float or array_like, default 0.0
            Displacement of the container beside that [m], one number or (scenes,).
        velocity : float or array_like, default 0.0
            Velocity of the container beside that [m/s], one number or (scenes,).

        Notes
        -----
        A UserWarning says where the filling is known to fail, or samples are too few.
        """
        coupling = self.engine.coupling
        choice("start", start, starts_of(self.excitation, self.mount))
        more = for_all("displacement", displacement, self.count)
        initial = self.numbers.initial(start)
        initial += np.column_stack([more, for_all("velocity", velocity, self.count)])
        checked = checked_range(self)
        if checked is not None and checked.warning:
            warnings.warn(checked.warning, stacklevel=2)
        for words in self.too_few:
            warnings.warn(words, stacklevel=2)
        self._tell_compiling("placing", 2)
        coupling.start(np.ascontiguousarray(initial))
        self._started, self._told = True, 0
        self.time_origin[:] = 0.0
        self._check_divergence()
        self._warn_of_divergence()

    def drive(self, frequency: object) -> None:
        """Continue at another frequency, at the end of a cycle.

        The base keeps its position and changes its speed.

        Parameters
        ----------
        frequency : float or array_like
            Frequency of the base [Hz], one number or (scenes,).
        """
        check_single_sine(self.excitation, "drive")
        self._check_cycle_is_full()
        before = self.time_s
        self.numbers.drive(for_all("frequency", frequency, self.count))
        self._load_pace()
        self.engine.coupling.renew()
        self.time_origin += before - self.time_s

    def run(
        self,
        transient_cycles: int,
        measured_cycles: int,
        progress: Listener | None = None,
        *,
        record_every: int = 0,
    ) -> measures.Cycles:
        """Run whole cycles and measure the last of them, as a ``measures.Cycles``.

        Parameters
        ----------
        transient_cycles : int
            Cycles before the measured ones.
        measured_cycles : int
            Cycles to measure, at most those of the batch.
        progress : callable, optional
            Function that is called with a BatchProgress about six times a second.
        record_every : int, default 0
            Steps between samples for ``time_series``, from the beginning of this run; 0 for none.

        Raises
        ------
        SimulationDiverged
            All scenes diverged, or one with ``if_diverged="raise"``.
        """
        transient = whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
        measured = whole("measured_cycles", measured_cycles, 0, self.measured_cycles)
        self._check_started()
        if not self.going_on:
            self._check_cycle_is_full()
        steps = self.steps_per_cycle.astype(np.int64)
        every = whole("record_every", record_every, 0, _MOST_STEPS)
        self._set_recorder((transient + measured) * steps, every)
        self._go((transient + measured) * steps, transient * steps, progress, every)
        record = self._read_cycles(measured)
        cycles = measures.Cycles(self.table.column("frequency"), self.steps_per_cycle, record)
        self.periods = periods_of(cycles)
        return cycles

    def measure_each(
        self, cycles: object, progress: Listener | None = None
    ) -> tuple[np.ndarray, ...]:
        """Continue by a number of cycles for each scene, and measure all of them.

        Parameters
        ----------
        cycles : int or array_like
            Number of cycles, one for all scenes or (scenes,); a scene with 0 stays as it is.
        progress : callable, optional
            As in ``run``.

        Returns
        -------
        tuple of ndarray
            Record of each scene, shape (cycles, len(measures.COLUMNS)).

        Raises
        ------
        SimulationDiverged
            All scenes diverged, or one with ``if_diverged="raise"``.
        """
        counts = for_all("cycles", cycles, self.count, self.measured_cycles).astype(np.int64)
        self._check_cycle_is_full()
        self._recording = None
        self._go(counts * self.steps_per_cycle, np.zeros_like(counts), progress)
        record = self._read_cycles(int(counts.max()))
        return tuple(column[:count].copy() for column, count in zip(record, counts))

    def advance(self, steps: object, progress: Listener | None = None) -> None:
        """Advance every scene by a number of steps without measuring.

        Parameters
        ----------
        steps : int or array_like
            Number of steps, one for all scenes or (scenes,).
        progress : callable, optional
            As in ``run``.

        Raises
        ------
        SimulationDiverged
            All scenes diverged, or one with ``if_diverged="raise"``.
        """
        self._check_started()
        self._recording = None
        steps = for_all("steps", steps, self.count, _MOST_STEPS).astype(np.int64)
        self._go(steps, steps, progress)

    def record(
        self, steps: int, every: int, late: int = 0, progress: Listener | None = None
    ) -> dict[str, np.ndarray]:
        """Advance every scene by a number of steps, with samples taken inside the kernel.

        Parameters
        ----------
        steps : int
            Number of steps.
        every : int
            Steps between samples.
        late : int, default 0
            Steps since the last sample was due: below ``every``, and 0 for a sample at once.
        progress : callable, optional
            As in ``run``.

        Returns
        -------
        dict
            Arrays (samples, scenes) by name, as those of ``sample``; none of the end.

        Raises
        ------
        SimulationDiverged
            As in ``advance``.
        """
        self._check_started()
        every = whole("every", every, 1, _MOST_STEPS)
        late = whole("late", late, 0, every - 1)
        steps = whole("steps", steps, 1, min(ROOM * every - late, _MOST_STEPS))
        begin, self._recording = self._read_status()[0].astype(np.int64), None
        ways = np.full(self.count, steps)
        self._go(ways, ways, progress, every, late)
        return self._recorded(begin, steps, every, late)

    @contextlib.contextmanager
    def checkpointed(
        self, checkpoint: Any, resume: Any, identity: dict[str, str], owners: Any = ()
    ) -> Iterator[Any]:
        """Save the runs inside a ``with`` block as a checkpoint asks.

        Parameters
        ----------
        checkpoint : Checkpoint, optional
            Where and when to save; None for no checkpoint.
        resume : path, optional
            Checkpoint to continue from; the saved run must be called again.
        identity : dict of str
            Words by name that the file and this run must share.
        owners : dict or sequence of (str, object), default ()
            Further objects whose data belong in the file, as in ``restart.RunSnapshot``.

        Yields
        ------
        CheckpointWriter
            Writer of the checkpoint; ``save()`` saves now.
        """
        self._check_started()
        own = {"version": version_text(), "filling": identity_of(self.fillings.identity)}
        if self.excitation != Excitation():
            own["excitation"] = self.excitation.identity()
        identity = {**own, **identity}
        arrays = opened(checkpoint, resume, lambda: identity)
        self._compile()
        saved = RunSnapshot(identity, lambda: self.memory, {"batch": self, **dict(owners)})
        if arrays:
            saved.restore(arrays, resume)
        with CheckpointWriter(checkpoint, saved, self._now) as self.writer:
            try:
                yield self.writer
            finally:
                self.writer = CheckpointWriter()

    def _now(self) -> tuple[int, float]:
        """Mean step and time [s] of the scenes."""
        return int(self._read_status()[0].mean()), float(self.time_s.mean())

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint beside the fields, arrays by name."""
        pace = np.stack([*self.numbers.pace(), self.time_origin])
        return {**self.launches.saved(), "pace": pace, "steps_per_cycle": self.steps_per_cycle}

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.launches.resume(saved)
        *pace, self.time_origin = saved["pace"].copy()
        self.numbers.take_pace(pace, saved["steps_per_cycle"])
        self._load_pace()
        self.going_on = True

    def aside(self) -> tuple[dict[str, np.ndarray], ...]:
        """Read the whole state, to keep it while another batch uses the engine."""
        return self.memory.read(), self.saved()

    def take_up(self, aside: tuple[dict[str, np.ndarray], ...], rows: Any = None) -> None:
        """Continue from a state instead of a start.

        Parameters
        ----------
        aside : tuple
            State that ``aside`` of a batch of the same filling has returned.
        rows : sequence of int, optional
            Scene of that batch which each scene of this one goes on from, at the end of a cycle:
            they may differ by their steps. None: all, with the same bits.
        """
        arrays, saved = aside
        if rows is None:
            self.memory.write(arrays)
            self.resume(saved)
        else:
            own = {name: one[rows] for name, one in arrays.items() if name.startswith("scenes/")}
            self.memory.write({**self.memory.read(), **own})
            self._load_pace()
            self.engine.coupling.renew()
            _, dt, origin = saved["pace"][:, rows]
            self.time_origin = origin + self._read_status()[0] * (dt - self.table.column("dt"))
        self._started, self.going_on = True, False

    def report(self) -> Report:
        """Summarize figures and cost of the run."""
        particles, dt = self.table.column("particles"), self.table.column("dt")
        sprung, kind = self.mount != "base", self.fillings.kinds[0]
        return Report(
            method=kind.label,
            mount=self.mount,
            effects=kind.effects,
            scenes=self.count,
            particles=(int(particles.min()), int(particles.max())),
            dt_s=(float(dt.min()), float(dt.max())),
            simulated_s=float(self.time_s.max()),
            scene_steps=self.launches.scene_steps,
            particle_steps=self.launches.particle_steps,
            **self._bound_of_step(),
            momentum_error=self._momentum_error(),
            container_evaluations=RK45_STAGES * int(self.attempts().sum()) if sprung else 0,
            compile_seconds=self.compile_seconds,
            run_seconds=self.run_seconds,
            order=getattr(kind, "order", None),
            certificate=self.certificate,
            diverged=tuple(map(str, self.divergences())),
            excitation=(*self.excitation.in_words(), *self.too_few),
        )

    def _bound_of_step(self) -> dict[str, Any]:
        """Fields of a Report: the bound of which a scene takes the largest share, and that."""
        bound = self.fillings.of_scenes(lambda filling: (filling.step_bound or (np.inf,))[0])
        shares = self.table.column("dt") / bound
        worst = int(shares.argmax())
        return {
            "step_bound": self.fillings.of(worst).step_bound,
            "bound_taken": float(shares[worst]),
        }

    @property
    def certificate(self) -> Certificate:
        """Effects that acted and since when, size of those left out."""
        return certificate_of(self, self._momentum_error())

    def _go(
        self,
        steps: np.ndarray,
        before_measuring: np.ndarray,
        progress: object,
        every: int = 0,
        late: int = 0,
    ) -> None:
        """Take every scene a number of steps on, in launches of bounded length."""
        if not (progress is None or callable(progress)):
            raise InputError(f"progress must be a function or None, got {shown(progress)}")
        if not self.going_on:
            self._aim(steps, before_measuring)
            self.engine.recorder.aim(every, late)
        self.going_on = False
        self._compile()
        self._launch_until_done(steps, progress)
        self._warn_of_divergence()

    def _read_cycles(self, count: int) -> np.ndarray:
        """Record of the first measured cycles, (scenes, cycles, columns); NaN of lost scenes."""
        record: np.ndarray = self.engine.coupling.read(count).copy()
        record[self.diverged] = np.nan
        return record

    def _aim(self, steps: np.ndarray, before_measuring: np.ndarray) -> None:
        begin = self._read_status()[0].astype(np.int64)
        if (begin + steps).max() > _MOST_STEPS:
            raise InputError(f"steps since the start must stay below {_MOST_STEPS}: run fewer")
        check_within(self.excitation, (begin + steps) * self.table.column("dt"))
        cost = (1 + self.table.column("particles")) * steps
        order = self.support.order(cost, runtime.settings().threads)
        plan = np.stack([begin, begin + steps, begin + before_measuring, order])
        self.engine.coupling.aim(plan)
        self.launches.begin()

    def _compile(self) -> None:
        """Compile the launch without stepping, unless a batch on this engine has done so."""
        engine = self.engine
        if not engine.is_compiled:
            started = time.perf_counter()
            self._tell_compiling("time step", 3)
            engine.coupling.advance(0.0)
            self.compile_seconds += time.perf_counter() - started
            engine.is_compiled = True

    def _launch_until_done(self, steps: np.ndarray, progress: Any) -> None:
        """Launch, report and save; one saved at its end is reported and saved once more."""
        launches, coupling = self.launches, self.engine.coupling
        total, done = int(steps.sum()), -1.0
        while done < 1.0:
            done = launches.done
            launches.launch(steps, coupling.advance, self._check_divergence)
            if done < 1.0 == launches.done:
                begin, end = map(self.engine.table.in_use, (coupling.begin, coupling.step))
                launches.count((end - begin).astype(np.int64), self.table.column("particles"))
            if progress is not None:
                scene_steps = round(launches.done * total)
                progress(BatchProgress(launches.done, launches.seconds, steps=scene_steps))
            self.writer.save_if_needed()
            done = launches.done
