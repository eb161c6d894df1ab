"""The state of a batch as arrays: the parts of an engine's fields that its scenes use."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneField
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.field_memory import fields_of


class SceneMemory:
    """Reads and writes the state of a batch, for checkpoints that another session can go on from.

    engine: of the batch. sizes: places that a scene of it uses, by name. Arrays of the scenes are
    cut to what is in use, as engines differ in capacity.
    """

    def __init__(self, engine: Any, sizes: dict[str, int]):
        self.engine, self.sizes = engine, sizes

    def read(self) -> dict[str, np.ndarray]:
        """Copies of all that changes in a run, by name."""
        scenes = {f"scenes/{k}": self._cut(one) for k, one in enumerate(self._made())}
        return {**scenes, **{name: values(field) for name, field in self._others().items()}}

    def misfit(self, arrays: Mapping[str, np.ndarray]) -> str:
        """Name of a field that the arrays of ``read`` lack or do not fit; else ""."""
        for name, mine in self.read().items():
            array = arrays.get(name)
            if array is None or array.dtype != mine.dtype or array.shape != mine.shape:
                return name
        return ""

    def write(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the fields from arrays that ``read`` returned and ``misfit`` accepts."""
        for k, one in enumerate(self._made()):
            whole = values(one.field)
            self._window(one, whole)[...] = arrays[f"scenes/{k}"]
            assign(one.field, whole)
        for name, field in self._others().items():
            assign(field, arrays[name])

    def _made(self) -> list[SceneField]:
        return self.engine.table.made

    def _others(self) -> dict[str, ti.Field]:
        """Fields that are not of the scenes: those of fillings that declare them by themselves."""
        scenes = {id(one.field) for one in self._made()}
        found = [one for one in fields_of(self.engine) if one.kind == "saved"]
        return {f"others/{one.name}": one.field for one in found if id(one.field) not in scenes}

    def _cut(self, one: SceneField) -> np.ndarray:
        return self._window(one, values(one.field)).copy()

    def _window(self, one: SceneField, whole: np.ndarray) -> np.ndarray:
        """Part of an array of a field that the batch uses."""
        table = self.engine.table
        if one.flat:
            entry = whole.shape[1:]
            whole = whole.reshape(table.capacity, table.length(one.lengths[0]), *entry)
        used = [self.sizes.get(n, n) if isinstance(n, str) else n for n in one.lengths]
        return whole[tuple(slice(n) for n in (table.scene_count, *used))]
