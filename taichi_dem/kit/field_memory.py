"""All fields of an object and its parts, and fast access to their bits."""

import types
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import taichi as ti
from taichi.lang.matrix import MatrixField
from taichi.lang.struct import StructField
from taichi.lang.util import to_numpy_type

from taichi_dem.kit.allocation import assign, values

#: Libraries whose objects are not searched for fields.
_FOREIGN = ("taichi", "numpy", "builtins")


class FieldOf(NamedTuple):
    """A field, where it is found, and whether it is "saved", "constant" or "scratch"."""

    name: str
    field: ti.Field
    kind: str


def fields_of(root: object) -> list[FieldOf]:
    """Every field that can be reached from an object, as a list of FieldOf.

    Names are ways of attributes from the root. A class may name in ``constant_fields`` what never
    changes once it is built, and in ``scratch_fields`` what is written before it is read in every
    step or search: all else has to be saved, so that a new part is covered without being told.
    """
    found, seen, ahead = [], set(), [("", "saved", root)]
    while ahead:
        name, kind, thing = ahead.pop(0)
        if id(thing) not in seen:
            seen.add(id(thing))
            if isinstance(thing, ti.Field) and not isinstance(thing, StructField):
                found.append(FieldOf(name[1:], thing, kind))
            else:
                ahead += [(f"{name}.{key}", *rest) for key, *rest in _members(thing, kind)]
    return found


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
        self.fields = {one.name: one.field for one in fields_of(root) if one.kind == kind}

    def read(self) -> dict[str, np.ndarray]:
        """Copies of all fields as arrays by name, without the zeros at their ends."""
        return {name: without_end(values(field)).copy() for name, field in self.fields.items()}

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


def without_end(array: np.ndarray) -> np.ndarray:
    """The array without trailing entries that are zero in all bits; lists have spare room."""
    if array.ndim == 0 or array.size == 0:
        return array
    in_bytes = np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1)
    rows: Any = in_bytes.any(axis=1)
    return array[: len(array) - int(rows[::-1].argmax()) if rows.any() else 0]


def shape_of(field):
    """Shape of a field as an array."""
    entry: tuple[int, ...] = ()
    if isinstance(field, MatrixField):
        entry = (field.n,) if field.ndim == 1 else (field.n, field.m)
    return (*field.shape, *entry)
