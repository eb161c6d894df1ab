"""Costs of a run over its time, and the levels of its bodies."""

from collections.abc import Iterable
from typing import Any, Optional

import numpy as np

from taichi_dem.observers import Every, RunView


class RunCosts:
    """Observer that keeps what a run has cost at every sample, and the levels of its bodies.

    columns: cpu_s [s] and evaluations so far. levels: (body_count,) of each sample. view: the last.
    """

    when = Every(samples=1)

    def __init__(self):
        self.columns: dict[str, list] = {"cpu_s": [], "evaluations": []}
        self.levels: list[np.ndarray] = []
        self.view: Optional[RunView] = None

    def observe(self, view: Any) -> None:
        """Take a row."""
        self.view = view
        self.columns["cpu_s"].append(view.cpu_seconds)
        self.columns["evaluations"].append(view.evaluations)
        self.levels.append(view.motion()["level"])


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
