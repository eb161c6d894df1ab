"""Progress of a long run as lines that stay, for a log file; a progress bar leaves nothing."""

from typing import Any

from taichi_dem.kit.allocation import field_bytes
from taichi_dem.kit.process_memory import peak_memory_mb
from taichi_dem.kit.progress.progress import time_left
from taichi_dem.observers import Every


class ProgressLines:
    """Observer that prints a line every tenth of the way: time per step, time left, memory.

    until: simulated time at the end of the run [s].
    """

    def __init__(self, until: float):
        self.until, self.when = until, Every(time_s=until / 10)
        self._before = 0, 0.0

    def observe(self, view: Any) -> None:
        """Print the line; none at the start of the run."""
        (step, seconds), self._before = self._before, (view.step, view.wall_seconds)
        if view.step > step:
            step_s = (view.wall_seconds - seconds) / (view.step - step)
            left = time_left(step_s * max(0.0, self.until - view.time_s) / view.method.dt0)
            words = f"t = {1e3 * view.time_s:.3f} ms, {1e3 * step_s:.3g} ms a step, {left}"
            fields = f"{1e-6 * field_bytes():.0f} MB of fields"
            print(f"{words}, {fields}, {peak_memory_mb():.0f} MB in all", flush=True)
