"""Base of the results of all runs: values over named axes, as tables and grids."""

import math
from typing import Any

import numpy as np

from ca_damper.scenes.checks import MOST_SCENES
from taichi_dem.kit.data_table import Tabulated, dataset
from taichi_dem.kit.errors import InputError


class ScenesResult(Tabulated):
    """Values of scenes over named axes; ``label`` is a short word for the filling."""

    label: str

    def _axes(self) -> dict[str, Any]:
        raise NotImplementedError

    def _variables(self) -> dict[str, Any]:
        raise NotImplementedError

    def to_xarray(self) -> Any:
        """Give all values as an xarray Dataset over their axes."""
        return dataset(self._variables(), self._axes(), filling=self.label)


def scenes_over(**axes: Any) -> dict[str, np.ndarray]:
    """Value on each axis of all scenes, (scenes,) by name; the last axis runs fastest."""
    scenes = math.prod(map(len, axes.values()))
    if scenes > MOST_SCENES:
        words = " x ".join(axes)
        raise InputError(f"{words} must make at most {MOST_SCENES} scenes, got {scenes}")
    grids = np.meshgrid(*axes.values(), indexing="ij")
    return dict(zip(axes, (grid.ravel() for grid in grids)))
