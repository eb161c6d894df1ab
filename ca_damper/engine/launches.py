"""Launches of bounded length, and their cost."""

import math
import time
from collections.abc import Callable, Mapping

import numpy as np
import taichi as ti

#: A launch is kept near this long [s].
LAUNCH_SECONDS = 0.15


class Launches:
    """Progress of the present run in launches that advance every scene by the same share."""

    def __init__(self, scenes: int):
        self.done = self.seconds = self.run_seconds = 0.0
        self.scene_steps = self.particle_steps = 0
        # One a scene to begin with, as the cost of a step is not known yet.
        self.scenes, self.pace, self.most_steps = scenes, float(scenes), math.inf

    def begin(self) -> None:
        """Begin another run."""
        self.done = self.seconds = 0.0

    def launch(
        self, steps: np.ndarray, advance: Callable[[float], None], check: Callable[[], None]
    ) -> None:
        """Make one launch; steps: of the run, (scenes,). check: called after it."""
        started = time.perf_counter()
        try:
            share = min(self.pace / max(1, steps.sum()), self.most_steps / max(1, steps.max()))
            share = min(1.0, self.done + share)
            advance(share)
            ti.sync()
            # A short run does not determine the pace of a long one.
            if share < 1.0:
                self._adapt(time.perf_counter() - started)
            check()
            self.done = share
        finally:
            spent = time.perf_counter() - started
            self.seconds += spent
            self.run_seconds += spent

    def _adapt(self, seconds: float) -> None:
        self.pace *= min(4.0, max(0.25, LAUNCH_SECONDS / seconds))
        self.pace = max(self.pace, float(self.scenes))

    def count(self, steps: np.ndarray, particles: np.ndarray) -> None:
        """Count the steps of a run that has ended; both (scenes,)."""
        self.scene_steps += int(steps.sum())
        self.particle_steps += int((particles * steps).sum())

    def saved(self) -> dict[str, np.ndarray]:
        """Data for a checkpoint, arrays by name."""
        return {
            "run": np.array([self.done, self.seconds, self.run_seconds]),
            "steps": np.array([self.scene_steps, self.particle_steps]),
        }

    def resume(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore the data that ``saved`` returned."""
        self.done, self.seconds, self.run_seconds = saved["run"].tolist()
        self.scene_steps, self.particle_steps = saved["steps"].tolist()
