"""Launches of a kernel that is called again and again."""

from typing import Any

import numpy as np

from taichi_dem.kit.taichi_patches.names import are_on
from taichi_dem.kit.taichi_patches.prepared_launch import PreparedLaunch, prepared


class Launch:
    """A kernel, called with the same templates and other values each time."""

    def __init__(self, kernel: Any, *templates: Any):
        self._kernel, self._templates = kernel, templates
        self._prepared: PreparedLaunch | None = None

    def __call__(self, *values: int | np.ndarray) -> Any:
        """Run it with these values; what it returns."""
        if self._prepared is not None and self._prepared.is_of_this_session():
            return self._prepared(values)
        value = self._kernel(*self._templates, *values)
        if are_on():
            self._prepared = prepared(self._kernel, self._templates, values)
        return value

    def queue(self, *values: int | np.ndarray) -> None:
        """Run it some time soon, in order, without waiting for what it returns."""
        if self._prepared is not None and self._prepared.is_of_this_session():
            self._prepared(values, waits=False)
        else:
            self(*values)
