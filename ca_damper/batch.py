"""Many scenes, run together in launches of bounded length.

A batch borrows the engine of its structure: a batch of another size, or of other numbers, runs in the
same one and compiles nothing. Batches alive at once on one engine take turns.
"""

import contextlib
import time
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from ca_damper import measures
from ca_damper.checks import MOST_CYCLES, STARTS, check_record_fits, for_all
from ca_damper.clock import steps_per_cycle
from ca_damper.container import CONTAINERS
from ca_damper.divergence import divergence
from ca_damper.engine import DamperEngine, borrow
from ca_damper.filling import check_filling, structure_of
from ca_damper.launches import Launches
from ca_damper.oscillator import Oscillator
from ca_damper.progress import BatchProgress
from ca_damper.report import RK45_STAGES, Report
from ca_damper.scene_memory import SceneMemory
from ca_damper.table import SceneTable, dealt
from taichi_dem.kit import runtime
from taichi_dem.kit.checkpoint import version_text
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import compiling
from taichi_dem.kit.restart import CheckpointWriter, NoCheckpointWriter, RunSnapshot, opened
from taichi_dem.kit.validation import choice, instance, positive, whole

MOUNTS = tuple(CONTAINERS)

_MOST_STEPS = 2**31 - 1
_STRUCTURE = ("mass", "stiffness", "damping", "base_amplitude")


class Batch:
    """A filling, a table of scenes and the container's mount, ready to run.

    table.dt holds the largest step of every scene; it is shortened so that a whole number of steps
    makes a cycle of the base: ``steps_per_cycle``, (scenes,). The batch keeps a table of its own.
    mount: "spring", or "base" for a container that moves like the base whatever the filling does.
    measured_cycles: most cycles that one run may measure. rtol, atol: of RK45, on the spring.
    ``run_seconds`` and ``compile_seconds`` tell what was spent, ``report()`` all of it in short.
    Raises InputError for a scene that the filling refuses or a step out of range.
    """

    def __init__(
        self,
        filling: Any,
        table: SceneTable,
        *,
        mount: str = "spring",
        measured_cycles: int = 1,
        rtol: float = 1e-9,
        atol: float = 1e-12,
    ):
        runtime.session()
        self.filling = check_filling(filling)
        self.table = instance("table", table, SceneTable).copy()
        self.count, self.mount = table.count, choice("mount", mount, MOUNTS)
        self.measured_cycles = whole("measured_cycles", measured_cycles, 0, 100_000)
        check_record_fits(table.count, self.measured_cycles)
        rtol = positive("rtol", rtol, zero_allowed=True)
        atol = positive("atol", atol)
        self.oscillators, self.largest_dt = self._structures(), self.table.column("dt")
        frequency = self.table.column("frequency")
        dt = self._fit_steps(frequency)
        compiling("set-up", 0.0)
        self.loan = borrow(self.filling, mount, self.count, self.measured_cycles)
        self.engine.clear()
        self.engine.load(self.filling, self.table, rtol, atol)
        self._set_pace(frequency, dt)
        self.time_origin = np.zeros(self.count)
        self.launches, self.compile_seconds = Launches(self.count), 0.0
        self.scene_steps = self.particle_steps = 0
        self._started = False
        # Whether the present run goes on from a checkpoint.
        self.going_on = False
        self.writer = NoCheckpointWriter()

    @property
    def engine(self) -> DamperEngine:
        """The engine, with the data of this batch on it.

        Raises InputError for a session that has been stopped or cleared, and on another thread.
        """
        self.loan.activate()
        return self.loan.engine

    @property
    def device(self) -> Any:
        """The filling on the device."""
        return self.engine.device

    @property
    def memory(self) -> SceneMemory:
        """State of the batch on the device, as arrays."""
        sizes = {"cycles": max(1, self.measured_cycles), **structure_of(self.filling).sizes}
        return SceneMemory(self.loan, sizes)

    @property
    def run_seconds(self) -> float:
        """Time spent on stepping [s]."""
        return self.launches.run_seconds

    def __repr__(self):
        return in_brief(self, self.filling.label, f"{self.count:,} scenes", f"on the {self.mount}")

    def start(self, start="rest"):
        """Place the particles anew and begin at time zero, the base passing upwards through zero.

        start: the container begins at "rest", or in the steady state of the "empty" container, or
        in that of a container with the particles as "rigid" mass.
        """
        coupling = self.engine.coupling
        choice("start", start, STARTS)
        compiling("placing", 0.2)
        coupling.start(np.ascontiguousarray(self._initial(start)))
        self._started = True
        self.time_origin[:] = 0.0
        self._check_divergence()

    def change(self, **numbers):
        """Give the scenes other numbers, as ``SceneTable.change``; then ``start`` begins anew.

        The bits are those of a batch that is made with them, and nothing is compiled.
        Raises InputError for what that batch would refuse.
        """
        engine = self.engine
        self.table.change(**{"dt": self.largest_dt, **numbers})
        self._started, self.largest_dt = False, self.table.column("dt")
        self.oscillators = self._structures()
        frequency = self.table.column("frequency")
        dt = self._fit_steps(frequency)
        engine.table.load(self.table)
        self._set_pace(frequency, dt)

    def _structures(self):
        """What every scene hangs on; InputError for numbers that cannot be meant."""
        return [Oscillator(*row) for row in zip(*map(self.table.column, _STRUCTURE))]

    def drive(self, frequency):
        """Go on at another frequency [Hz], a scalar or (scenes,), at the end of a cycle.

        The base keeps its place and changes its speed. Raises InputError within a cycle.
        """
        self._check_cycle_is_full()
        before, frequency = self.time_s, for_all("frequency", frequency, self.count)
        self._set_pace(frequency, self._fit_steps(frequency))
        self.engine.coupling.renew()
        self.time_origin += before - self.time_s

    def run(self, transient_cycles, measured_cycles, progress=None):
        """Run whole cycles and measure the last of them; returns ``measures.Cycles``.

        progress: called with a BatchProgress about six times a second.
        Raises InputError for numbers of cycles that are none, or within a cycle;
        SimulationDiverged.
        """
        transient = whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
        measured = whole("measured_cycles", measured_cycles, 0, self.measured_cycles)
        self._check_started()
        if not self.going_on:
            self._check_cycle_is_full()
        steps = self.steps_per_cycle.astype(np.int64)
        self._go((transient + measured) * steps, transient * steps, progress)
        record = np.empty((self.count, measured, len(measures.COLUMNS)))
        if measured:
            self.engine.coupling.read(record)
        return measures.Cycles(self.table.column("frequency"), self.steps_per_cycle, record)

    def advance(self, steps, progress=None):
        """Advance every scene by a number of steps, one for all or (scenes,), without measuring.

        Raises InputError unless they are whole numbers from zero, SimulationDiverged.
        """
        self._check_started()
        steps = for_all("steps", steps, self.count, _MOST_STEPS).astype(np.int64)
        self._go(steps, steps, progress)

    @property
    def time_s(self):
        """Present time of every scene [s], (scenes,)."""
        return self.time_origin + self._read_status()[0] * self.table.column("dt")

    def sample(self):
        """The present state: arrays (scenes,) by name.

        time_s; x [m], v [m/s], a [m/s^2] of the container, y [m] of the base; force [N]: mean of
        the filling on the container in the last step; energy [J], momentum [kg m/s] of the
        particles.
        """
        self._check_started()
        values = np.empty((len(measures.SAMPLE), self.count))
        self.engine.coupling.sample(values)
        return {"time_s": self.time_s, **dict(zip(measures.SAMPLE, values))}

    def snapshot(self, s):
        """Positions and velocities of the particles of scene s, as the filling gives them."""
        self._check_started()
        return self.device.snapshot(whole("s", s, 0, self.count - 1))

    def attempts(self):
        """Steps that RK45 has tried since the start, (scenes,); one a step unless some failed."""
        return self.engine.table.in_use(self.engine.coupling.attempts)

    @contextlib.contextmanager
    def checkpointed(self, checkpoint, resume, identity, owners=()):
        """Let the runs in its block save themselves; gives what saves them.

        checkpoint: a Checkpoint or None. resume: file to go on from, or None: the run that it was
        saved in is then to be called for again, and goes on. identity: words by name that a file
        must share; owners: (name, object) of what else goes into it, as in ``restart.RunSnapshot``.
        Raises InputError.
        """
        self._check_started()
        own = {"version": version_text(), "filling": repr(self.filling)}
        arrays = opened(checkpoint, resume, lambda: {**own, **identity})
        self._compile()
        saved = RunSnapshot({**own, **identity}, self.memory, {"batch": self, **dict(owners)})
        if arrays:
            saved.restore(arrays, resume)
        writer = NoCheckpointWriter()
        if checkpoint:
            writer = CheckpointWriter(checkpoint, saved, self._now)
        with writer as self.writer:
            try:
                yield self.writer
            finally:
                self.writer = NoCheckpointWriter()

    def _now(self):
        """Mean step and time [s] of the scenes."""
        return int(self._read_status()[0].mean()), float(self.time_s.mean())

    def saved(self):
        """What a checkpoint holds of it beside the fields, arrays by name."""
        pace = [self.table.column(name) for name in ("frequency", "dt")]
        return {
            "run": self.launches.saved(),
            "steps": np.array([self.scene_steps, self.particle_steps]),
            "pace": np.stack([*pace, self.time_origin]),
            "steps_per_cycle": self.steps_per_cycle,
        }

    def resume(self, saved):
        """Take over what ``saved`` gave."""
        self.launches.resume(saved["run"])
        self.scene_steps, self.particle_steps = saved["steps"].tolist()
        frequency, dt, self.time_origin = saved["pace"].copy()
        self.steps_per_cycle = saved["steps_per_cycle"]
        self._set_pace(frequency, dt)
        self.going_on = True

    def report(self):
        """What was done and what it cost, as a ``report.Report``."""
        particles, dt = self.table.column("particles"), self.table.column("dt")
        sprung = self.mount == "spring"
        return Report(
            method=self.filling.label,
            mount=self.mount,
            effects=self.filling.effects,
            effect_activity=self.device.uses(self.filling.effects),
            scenes=self.count,
            particles=(int(particles.min()), int(particles.max())),
            dt_s=(float(dt.min()), float(dt.max())),
            simulated_s=float(self.time_s.max()),
            scene_steps=self.scene_steps,
            particle_steps=self.particle_steps,
            step_bound=self.filling.step_bound,
            momentum_error=self._momentum_error(),
            container_evaluations=RK45_STAGES * int(self.attempts().sum()) if sprung else 0,
            compile_seconds=self.compile_seconds,
            run_seconds=self.run_seconds,
        )

    def _momentum_error(self):
        return self.engine.account.error(self.sample()["momentum"]) if self._started else 0.0

    def _read_status(self):
        """Step, position in the cycle, and status of all scenes, (3, scenes)."""
        seen = np.empty((3, self.count), dtype=np.int32)
        self.engine.coupling.read_status(seen)
        return seen

    def _check_started(self):
        self.loan.activate()
        if not self._started:
            raise InputError("this batch has no state yet: call start() first")

    def _check_cycle_is_full(self):
        self._check_started()
        position = self._read_status()[1]
        if position.any():
            late = int(position.argmax())
            raise InputError(
                f"a cycle must be full here, scene {late} stands at step {position[late]} of "
                f"{self.steps_per_cycle[late]}: advance it first"
            )

    def _fit_steps(self, frequency):
        """Fit the steps to the cycle, have the filling check them, and return them [s]."""
        scenes = zip(frequency, self.largest_dt)
        self.steps_per_cycle = np.array(
            [steps_per_cycle(float(f), float(dt)) for f, dt in scenes], np.int32
        )
        dt = 1.0 / (frequency * self.steps_per_cycle)
        for particles, step in sorted(set(zip(self.table.column("particles").tolist(), dt))):
            self.filling.check(particles, float(step))
        return dt

    def _set_pace(self, frequency, dt):
        engine = self.engine
        self.table.drive(frequency, dt)
        engine.table.drive(np.ascontiguousarray(np.stack([frequency, dt]), dtype=np.float64))
        engine.clock.set(self.steps_per_cycle)

    def _initial(self, start):
        """(x, v) of the container at the beginning, shape (scenes, 2)."""
        state = np.zeros((self.count, 2))
        if start == "rest":
            return state
        for s, oscillator in enumerate(self.oscillators):
            row = self.table.row(s)
            fixed = row["particles"] * self.filling.particle_mass if start == "rigid" else 0.0
            state[s] = oscillator.steady_state(row["frequency"], fixed, self.filling.gravity)
        return state

    def _go(self, steps, before_measuring, progress):
        """Take every scene a number of steps on, in launches of bounded length."""
        if not self.going_on:
            self._aim(steps, before_measuring)
        self.going_on = False
        self._compile()
        self._launch_until_done(steps, progress)

    def _aim(self, steps, before_measuring):
        """Say how far every scene is to go."""
        begin = self._read_status()[0].astype(np.int64)
        if (begin + steps).max() > _MOST_STEPS:
            raise InputError(f"steps since the start must stay below {_MOST_STEPS}: run fewer")
        order = dealt((1 + self.table.column("particles")) * steps, runtime.settings().threads)
        plan = np.stack([begin, begin + steps, begin + before_measuring, order])
        self.engine.coupling.aim(plan.astype(np.int32))
        self.launches.begin()

    def _compile(self):
        """Compile the launch without stepping, unless a batch on this engine has done so."""
        engine = self.engine
        if not engine.is_compiled:
            started = time.perf_counter()
            compiling("time step", 0.4)
            engine.coupling.advance(0.0)
            self.compile_seconds += time.perf_counter() - started
            engine.is_compiled = True

    def _launch_until_done(self, steps, progress):
        """Launch, tell and save; a run that was saved at its end is told and saved once more."""
        launches, total, done = self.launches, max(1, int(steps.sum())), -1.0
        while done < 1.0:
            done = launches.done
            launches.launch(total, self._advance, self._check_divergence)
            if done < 1.0 == launches.done:
                self._count(steps)
            if progress is not None:
                progress(
                    BatchProgress(launches.done, launches.seconds, round(launches.done * total))
                )
            self.writer.save_if_needed()
            done = launches.done

    def _advance(self, share):
        self.engine.coupling.advance(share)

    def _count(self, steps):
        self.scene_steps += int(steps.sum())
        self.particle_steps += int((self.table.column("particles") * steps).sum())

    def _check_divergence(self):
        step, _, status = self._read_status()
        if status.any():
            # Scenes stop where they diverge: the first of them in time speaks for all.
            time_s = self.time_s
            s = int(np.argmin(np.where(status != 0, time_s, np.inf)))
            found = int(status[s]), int(step[s]), float(time_s[s])
            raise divergence(self.filling, self.table.row(s), *found)
