"""Costs of a run over its time, and the levels of its bodies."""

from collections.abc import Iterable

import numpy as np

from taichi_dem.observers import Collector, Every


class RunCosts(Collector):
    """Observer that keeps what a run has cost at every sample, and the levels of its bodies.

    view: of the last sample.
    """

    def __init__(self):
        super().__init__(
            Every(samples=1),
            cpu_s=lambda view: view.cpu_seconds,
            evaluations=lambda view: view.evaluations,
            level=lambda view: view.motion()["level"],
        )

    @property
    def columns(self) -> dict[str, list]:
        """CPU seconds and evaluations so far, of each sample."""
        return {name: self.rows[name] for name in ("cpu_s", "evaluations")}

    @property
    def levels(self) -> list[np.ndarray]:
        """Levels of the bodies of each sample, (body_count,) each."""
        return self.rows["level"]


def level_shares(levels: Iterable[np.ndarray]) -> np.ndarray:
    """Share of bodies on each level: rows (sample, level) that sum to 1.

    levels: of all bodies, (body_count,) each.
    """
    rows = [*levels]
    count = max(int(level.max()) for level in rows) + 1
    return np.array([np.bincount(level, minlength=count) / len(level) for level in rows])


def level_columns(shares: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of a table, by name, of the result of ``level_shares``."""
    return {f"level_{k}": share for k, share in enumerate(shares.T)}
