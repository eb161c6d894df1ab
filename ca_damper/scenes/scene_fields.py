"""Numbers and state of the scenes of a batch on the device, with room for larger batches."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import taichi as ti

from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.field_memory import fields_of, lying

#: Length of an axis of a field: a number, or the name of one of the sizes.
Length = int | str


@dataclass(frozen=True, eq=False)
class SceneField:
    """A field of the scenes; flat: scenes share its first axis, places of a scene side by side."""

    field: ti.Field
    lengths: tuple[Length, ...]
    flat: bool


@ti.data_oriented
class SceneFields:
    """Parameters of each scene of a batch; fields of shape (capacity,)."""

    def __init__(self, capacity: int, sizes: dict[str, int]):
        self.capacity, self.sizes = capacity, dict(sizes)
        self.made: list[SceneField] = []
        self.scenes = ti.field(ti.i32, shape=())
        for name in SceneTable.COLUMNS:
            kind = ti.i32 if name in ("particles", "seed") else ti.f64
            setattr(self, name, self.field(kind))
        self.gravity, self.weight, self.recoil = (self.field(ti.f64) for _ in range(3))

    def field(self, dtype: object, *lengths: Length, flat: bool = False) -> ti.Field:
        """Declare a field of the scenes; lengths: of its axes after that of the scenes."""
        return self._made(lambda shape: ti.field(dtype, shape=shape), lengths, flat)

    def vector(self, n: int, dtype: object, *lengths: Length, flat: bool = False) -> ti.Field:
        """Declare a field of vectors with n components; else as ``field``."""
        return self._made(lambda shape: ti.Vector.field(n, dtype, shape=shape), lengths, flat)

    def structs(self, kind: object, *lengths: int) -> ti.StructField:
        """Declare structs of given numbers; members lie apart, which kernels find faster."""
        # Given numbers are no state: a class lists them in its ``constant_fields``.
        return kind.field(shape=(self.capacity, *lengths), layout=ti.Layout.SOA)

    def _made(self, make: Any, lengths: tuple[Length, ...], flat: bool) -> ti.Field:
        shape = (self.capacity, *(self.length(length) for length in lengths))
        field = make((shape[0] * shape[1], *shape[2:]) if flat else shape)
        self.made.append(SceneField(field, lengths, flat))
        return field

    def length(self, length: Length) -> int:
        """Number of places of a scene along an axis."""
        return self.sizes[length] if isinstance(length, str) else length

    def upload(self, table: SceneTable) -> None:
        """Take over the rows of a table that fits."""
        assign(self.scenes, table.count)
        for name in SceneTable.COLUMNS:
            assign(getattr(self, name), table.column(name))

    def in_use(self, field: ti.Field) -> np.ndarray:
        """Rows of the scenes in use, of a field whose first axis is that of the scenes."""
        return values(field, slice(self.scene_count))

    def row(self, field: ti.Field, s: int) -> np.ndarray:
        """Entries of scene s of a field whose first axis is that of the scenes."""
        return values(field, s)

    @property
    def scene_count(self) -> int:
        """Number of scenes in use, in Python."""
        return int(values(self.scenes))

    def drive(self, pair: np.ndarray) -> None:
        """Change frequency [Hz] and step [s] of all scenes: pair[0] and pair[1], (scenes,) each."""
        assign(self.frequency, pair[0])
        assign(self.dt, pair[1])


class SceneMemory:
    """State of a batch for checkpoints; arrays are cut to what its scenes use of the engine."""

    def __init__(self, engine: object, sizes: dict[str, int]):
        self.engine, self.sizes = engine, sizes

    def read(self) -> dict[str, np.ndarray]:
        """Copies of all that changes in a run, by name."""
        ti.sync()
        scenes = {f"scenes/{k}": self._cut(entry) for k, entry in enumerate(self.engine.table.made)}
        return {**scenes, **{name: values(field) for name, field in self._others.items()}}

    def misfit(self, arrays: Mapping[str, np.ndarray]) -> str:
        """Name of a field that the arrays of ``read`` lack or do not fit; else ""."""
        for name, mine in self.read().items():
            array = arrays.get(name)
            if array is None or array.dtype != mine.dtype or array.shape != mine.shape:
                return name
        return ""

    def write(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the fields from arrays that ``read`` returned and ``misfit`` accepts."""
        for k, entry in enumerate(self.engine.table.made):
            whole = values(entry.field)
            self._window(entry, whole)[...] = arrays[f"scenes/{k}"]
            assign(entry.field, whole)
        for name, field in self._others.items():
            assign(field, arrays[name])

    @functools.cached_property
    def _others(self) -> dict[str, ti.Field]:
        """Fields that are not of the scenes: those of fillings that declare them by themselves."""
        scenes = {id(entry.field) for entry in self.engine.table.made}
        entries = [entry for entry in fields_of(self.engine) if entry.kind == "saved"]
        return {
            f"others/{entry.name}": entry.field
            for entry in entries
            if id(entry.field) not in scenes
        }

    def _cut(self, field: SceneField) -> np.ndarray:
        return self._window(field, lying(field.field)).copy()

    def _window(self, field: SceneField, whole: np.ndarray) -> np.ndarray:
        """Part of an array of a field that the batch uses."""
        table = self.engine.table
        if field.flat:
            entry = whole.shape[1:]
            whole = whole.reshape(table.capacity, table.length(field.lengths[0]), *entry)
        used = [self.sizes.get(n, n) if isinstance(n, str) else n for n in field.lengths]
        return whole[tuple(slice(n) for n in (table.scene_count, *used))]
