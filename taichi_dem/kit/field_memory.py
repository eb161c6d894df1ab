"""All fields of an object and its parts, and fast access to their bits."""

import types
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import taichi as ti
from taichi.lang.matrix import MatrixField
from taichi.lang.struct import StructField
from taichi.lang.util import to_numpy_type

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.taichi_patches.addresses import array_of

#: Libraries whose objects are not searched for fields.
_FOREIGN = ("taichi", "numpy", "builtins")
#: Bytes of a field that are looked at together for its last entry in use.
_BLOCK = 4096


class FieldOf(NamedTuple):
    """A field, where it is found, and whether it is "saved", "constant" or "scratch"."""

    name: str
    field: ti.Field
    kind: str


def fields_of(root: object) -> list[FieldOf]:
    """Every field that can be reached from an object, as a list of FieldOf."""
    # Fields are saved unless their class says that they never change or are written before they are
    # read, so that no new part is forgotten.
    entries, seen, ahead = [], set(), [("", "saved", root)]
    while ahead:
        name, kind, thing = ahead.pop(0)
        if id(thing) not in seen:
            seen.add(id(thing))
            if isinstance(thing, ti.Field) and not isinstance(thing, StructField):
                entries.append(FieldOf(name[1:], thing, kind))
            else:
                ahead += [(f"{name}.{key}", *rest) for key, *rest in _members(thing, kind)]
    return entries


def _members(thing, kind):
    """Members of an object, as (name, kind of a field there, member)."""
    if isinstance(thing, StructField):
        thing = thing.field_dict
    if isinstance(thing, dict):
        return [(key, kind, member) for key, member in thing.items()]
    if isinstance(thing, (list, tuple)):
        return [(key, kind, member) for key, member in enumerate(thing)]
    if isinstance(thing, types.MethodType):
        return [("of", kind, thing.__self__)]
    if type(thing).__module__.split(".")[0] in _FOREIGN or not hasattr(thing, "__dict__"):
        return []
    return [(key, _declared(type(thing), key), member) for key, member in vars(thing).items()]


def _declared(owner, name):
    for kind in ("constant", "scratch"):
        if name in getattr(owner, f"{kind}_fields", ()):
            return kind
    return "saved"


class FieldMemory:
    """Reads and writes the fields of an object bit by bit; kind: as in ``FieldOf``."""

    def __init__(self, root: object, kind: str = "saved"):
        self.fields = {entry.name: entry.field for entry in fields_of(root) if entry.kind == kind}

    def read(self) -> dict[str, np.ndarray]:
        """Copies of all fields as arrays by name, without the zeros at their ends."""
        ti.sync()
        return {name: without_end(lying(field)).copy() for name, field in self.fields.items()}

    def misfit(self, arrays: Mapping[str, np.ndarray]) -> str:
        """Name of a field that the arrays of ``read`` lack or do not fit; else ""."""
        for name, field in self.fields.items():
            shape, array = shape_of(field), arrays.get(name)
            if array is None or array.dtype != to_numpy_type(field.dtype):
                return name
            if array.shape[1:] != shape[1:] or array.shape[:1] > shape[:1]:
                return name
        return ""

    def write(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore all fields from arrays that ``read`` returned and ``misfit`` accepts."""
        for name, field in self.fields.items():
            whole = np.zeros(shape_of(field), arrays[name].dtype)
            whole[slice(len(arrays[name])) if whole.ndim else ()] = arrays[name]
            assign(field, whole)


def lying(field):
    """Array of a field where it lies, or a copy on a device; for ``ti.sync`` before."""
    array = array_of(field)
    return field.to_numpy() if array is None else array


def without_end(array: np.ndarray) -> np.ndarray:
    """The array without trailing entries that are zero in all bits; lists have spare room."""
    if array.ndim == 0 or array.size == 0:
        return array
    in_bytes = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    # By blocks: the room of a list is thousands of times longer than what is in use.
    blocks = np.flatnonzero(np.bitwise_or.reduceat(in_bytes, np.arange(0, len(in_bytes), _BLOCK)))
    if len(blocks) == 0:
        return array[:0]
    begin = int(blocks[-1]) * _BLOCK
    last = begin + int(np.flatnonzero(in_bytes[begin : begin + _BLOCK])[-1])
    return array[: last * len(array) // len(in_bytes) + 1]


def shape_of(field):
    """Shape of a field as an array."""
    entry: tuple[int, ...] = ()
    if isinstance(field, MatrixField):
        entry = (field.n,) if field.ndim == 1 else (field.n, field.m)
    return (*field.shape, *entry)
