"""Scenes on an engine: their numbers, and access to their state between two steps."""

import warnings
from typing import Any

import numpy as np

from ca_damper.engine.coupling import CUT_SHORT, LOST
from ca_damper.engine.damper_engine import DamperEngine
from ca_damper.engine.mount import Mount
from ca_damper.errors import SimulationDiverged
from ca_damper.excitation.excitation import Excitation
from ca_damper.filling import Fillings
from ca_damper.report import measures
from ca_damper.scenes.scene_fields import SceneMemory
from ca_damper.scenes.scene_numbers import SceneNumbers
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import compiling
from taichi_dem.kit.validation import told_apart, whole

#: Parts in which the kernels of a batch are compiled.
_PARTS = 3
_LOST_IN_WORDS = "has a container whose motion is not a finite number"


class LoadedScenes:
    """Fillings and a table of scenes on an engine, put there by a Batch.

    time_origin: when step 0 would have been at the present step [s], (scenes,).
    """

    fillings: Fillings
    count: int
    if_diverged: str
    support: Mount
    measured_cycles: int
    recorded_samples: int
    numbers: SceneNumbers
    excitation: Excitation
    time_origin: np.ndarray
    _engine: DamperEngine
    _started: bool = False
    _told: int = 0
    _recording: tuple[int, int, int] | None = None

    @property
    def diverged(self) -> np.ndarray:
        """Scenes that have diverged, and those on one structure with them, (scenes,) of bool."""
        lost: np.ndarray = self._read_status()[2] != 0
        group = self.support.group
        return np.repeat(lost.reshape(-1, group).any(axis=1), group)

    @property
    def filling(self) -> Any:
        """The filling of all scenes; InputError where they differ."""
        return self.fillings.one

    @property
    def table(self) -> SceneTable:
        """Numbers of the scenes."""
        return self.numbers.table

    @property
    def steps_per_cycle(self) -> np.ndarray:
        """Steps in a cycle of the base, (scenes,)."""
        return self.numbers.steps_per_cycle

    @property
    def engine(self) -> DamperEngine:
        """Fields and kernels of this batch; InputError once the session has been stopped."""
        self._engine.check(self)
        return self._engine

    @property
    def device(self) -> Any:
        """The filling on the device."""
        return self.engine.device

    @property
    def memory(self) -> SceneMemory:
        """State of the batch on the device, as arrays."""
        sizes = {"cycles": max(1, self.measured_cycles), "samples": self.recorded_samples}
        places = {**self.fillings.structure.sizes, **self.excitation.sizes}
        return SceneMemory(self.engine, {**sizes, **places})

    @property
    def time_s(self) -> np.ndarray:
        """Present time of every scene [s], (scenes,)."""
        return self.time_origin + self._read_status()[0] * self.table.column("dt")

    def sample(self) -> dict[str, np.ndarray]:
        """Read the present state of all scenes.

        Returns
        -------
        dict
            Arrays (scenes,) by name: time_s [s]; x [m], v [m/s], a [m/s^2] of the container; y [m]
            of the base; force [N], mean of the filling on the container in the last step; energy
            [J] and momentum [kg m/s] of the particles. NaN but for the time in a diverged scene.
        """
        self._check_started()
        values = np.empty((len(measures.SAMPLE), self.count))
        self.engine.coupling.sample(values)
        values[:, self.diverged] = np.nan
        return {"time_s": self.time_s, **dict(zip(measures.SAMPLE, values))}

    def time_series(self) -> dict[str, np.ndarray]:
        """Samples that the last run recorded, and its end.

        Returns
        -------
        dict
            Arrays (samples, scenes) by name: time_s [s]; x [m], v [m/s] of the container; y [m] of
            the base; force [N] of the filling on the container. NaN in a diverged scene.
        """
        if self._recording is None:
            raise InputError("record_every of a run must be at least 1 before time_series, got 0")
        steps, every, count = self._recording
        recorder, end = self.engine.recorder, self.sample()
        end["force"] = recorder.mean_force(end["force"], steps - every * (count - 1))
        read = recorder.read_series(0, count)
        series = {name: np.concatenate([of, end[name][None]]) for name, of in read.items()}
        # Counted back from the present, as the run may have gone on from a checkpoint.
        marks = self._read_status()[0] - steps + np.append(every * np.arange(count), steps)[:, None]
        series["time_s"] = self.time_origin + marks * self.table.column("dt")
        for values in series.values():
            values[:, self.diverged] = np.nan
        return series

    def _set_recorder(self, steps: np.ndarray, every: int) -> None:
        """Note that the next run, of so many steps, (scenes,), records every so many of them."""
        self._recording = None
        if every:
            count = -(-int(steps.max()) // every)
            if steps.min() != steps.max():
                raise InputError(
                    "record_every must be 0 in a batch whose scenes have different steps a cycle, "
                    f"{steps.min()} to {steps.max()} in this run, got {every}"
                )
            if count > self.recorded_samples:
                raise InputError(
                    f"recorded_samples of the batch must be at least {count} for this run, got "
                    f"{self.recorded_samples}"
                )
            self._recording = int(steps.max()), every, count

    def _recorded(self, begin: np.ndarray, steps: int, every: int, late: int) -> dict[str, Any]:
        """Samples of a run of so many steps from steps ``begin`` on, as those of ``sample``."""
        # A scene that diverged stopped at a step of its own: NaN from there on, and its time stands
        # still.
        marks = begin + np.arange(-late % every, steps, every)[:, None]
        read = self.engine.recorder.read(-(-late // every), -(-(late + steps) // every))
        now, lost = self._read_status()[0], self.diverged
        time_s = self.time_origin + np.minimum(marks, now) * self.table.column("dt")
        gone = lost & (marks >= now)
        values = {name: np.where(gone, np.nan, read[name]) for name in measures.SAMPLE}
        return {"time_s": time_s, **values}

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Positions [m] and velocities [m/s] of the particles of a scene, (particles, 2) each.

        Parameters
        ----------
        s : int
            Number of the scene, from 0.
        """
        self._check_started()
        return self.device.snapshot(whole("s", s, 0, self.count - 1))

    def attempts(self) -> np.ndarray:
        """Steps (scenes,) that RK45 has tried since the start; one a step unless some failed."""
        engine = self.engine
        return engine.table.in_use(engine.coupling.attempts)

    def _tell_compiling(self, part: str, number: int) -> None:
        """Report that a part is compiled next, unless another batch has had it compiled."""
        if not self.engine.is_compiled:
            compiling(part, number, _PARTS)

    def _momentum_error(self) -> float:
        return self.engine.account.error(self.sample()["momentum"]) if self._started else 0.0

    def _read_status(self) -> np.ndarray:
        """Step, position in the cycle, and status of all scenes, (3, scenes)."""
        return self.engine.coupling.read_status()

    def _check_started(self) -> None:
        self._engine.check(self)
        if not self._started:
            raise InputError("this batch has no state yet: call start() first")

    def _check_cycle_is_full(self) -> None:
        self._check_started()
        position = np.where(self.diverged, 0, self._read_status()[1])
        if position.any():
            late = int(position.argmax())
            raise InputError(
                f"a cycle must be complete here, scene {late} stands at step {position[late]} of "
                f"{self.steps_per_cycle[late]}: advance it first"
            )

    def _load_pace(self) -> None:
        engine = self.engine
        engine.table.drive(self.numbers.pace())
        engine.clock.set(self.steps_per_cycle)

    def _check_divergence(self) -> None:
        """Raise SimulationDiverged where no scene is left that goes on, or one may not be lost."""
        if backend.most_rounds() and CUT_SHORT in self._read_status()[2]:
            raise backend.cut_short("of these scenes", "fewer particles")
        diverged = self.diverged
        if diverged.all() or (self.if_diverged == "raise" and diverged.any()):
            raise self.divergences()[0]

    def divergences(self) -> list[SimulationDiverged]:
        """A SimulationDiverged for each scene that has diverged, the first in time first."""
        step, _, status = self._read_status()
        # Scenes stop where they diverge.
        time_s, of, table = self.time_s, self.fillings.of, self.table
        lost = sorted(np.flatnonzero(status), key=lambda s: time_s[s])
        return [
            divergence(of(s), table.row(s), int(status[s]), int(step[s]), float(time_s[s]))
            for s in map(int, lost)
        ]

    def _warn_of_divergence(self) -> None:
        """Warn of scenes that have diverged since the last warning."""
        lost = int(np.count_nonzero(self.diverged))
        if lost > self._told:
            first = self.divergences()[0]
            warnings.warn(
                f"{lost} of {self.count} scenes diverged; their results are nan, and the others "
                f"went on: {first}",
                stacklevel=4,
            )
        self._told = lost


def divergence(
    filling: object, row: dict[str, Any], code: int, step: int, time_s: float
) -> SimulationDiverged:
    """Exception for a scene, a row of the table, that diverged with a code by a step."""
    dt = row["dt"]
    words, allowed = filling.divergence(max(code, 1), row["particles"], dt)
    if code == LOST:
        # The longest step of the filling is still the best advice.
        words, allowed = _LOST_IN_WORDS, min(allowed, 0.5 * dt)
    was, most = told_apart(dt, allowed)
    return SimulationDiverged(
        f"the scene of particles = {row['particles']} and seed {row['seed']} at "
        f"{row['frequency']:.5g} Hz diverged by step {step}, t = {time_s:.4g} s: it {words}; "
        f"dt must be at most {most} s, was {was} s",
        scene=row,
        step=step,
        time_s=time_s,
        dt=dt,
        dt_allowed=allowed,
    )
