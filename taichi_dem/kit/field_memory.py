"""All fields of an object, found by walking through it, and their bits, read and written fast."""

import ctypes
import types
from typing import NamedTuple

import numpy as np
import taichi as ti
from taichi.lang import impl
from taichi.lang.matrix import MatrixField
from taichi.lang.struct import StructField
from taichi.lang.util import to_numpy_type

#: What is looked into for fields: all objects but those of these libraries.
_FOREIGN = ("taichi", "numpy", "builtins")
#: Members of a static loop beyond which Taichi warns.
_UNROLLED = 32


class FieldOf(NamedTuple):
    """A field, where it is found, and whether it is "saved", "constant" or "scratch"."""

    name: str
    field: object
    kind: str


def fields_of(root):
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
    """What hangs on an object, as (name, kind of a field there, member)."""
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
    """Reads and writes the fields of an object bit by bit; kind: as in ``FieldOf``.

    On a CPU where they lie: Taichi's own way compiles two kernels a field, 20 s for a block.
    """

    def __init__(self, root, kind="saved"):
        kept = [one for one in fields_of(root) if one.kind == kind]
        self.fields = {one.name: one.field for one in kept}
        self.views = {}
        if impl.current_cfg().arch != ti.cuda:
            self.views = _views(self.fields)

    def read(self):
        """Copies of all fields as arrays by name, without the zeros at their ends."""
        ti.sync()
        return {name: without_end(self._whole(name)).copy() for name in self.fields}

    def _whole(self, name):
        return self.views[name] if name in self.views else self.fields[name].to_numpy()

    def misfit(self, arrays):
        """Name of a field that arrays, as ``read`` gave them, lack or do not fit; else ""."""
        for name, field in self.fields.items():
            shape, array = _shape(field), arrays.get(name)
            if array is None or array.dtype != to_numpy_type(field.dtype):
                return name
            if array.shape[1:] != shape[1:] or array.shape[:1] > shape[:1]:
                return name
        return ""

    def write(self, arrays):
        """Give all fields their values back, from what ``read`` gave and ``misfit`` accepts."""
        ti.sync()
        for name, field in self.fields.items():
            whole = np.zeros(_shape(field), arrays[name].dtype)
            whole[slice(len(arrays[name])) if whole.ndim else ()] = arrays[name]
            if name in self.views:
                self.views[name][...] = whole
            else:
                field.from_numpy(whole)


def without_end(array):
    """The array without what is zero in all bits at its end; lists have room to spare."""
    if array.ndim == 0 or array.size == 0:
        return array
    rows = np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1).any(axis=1)
    return array[: len(array) - int(rows[::-1].argmax()) if rows.any() else 0]


def _shape(field):
    """Shape of a field as an array."""
    entry = ()
    if isinstance(field, MatrixField):
        entry = (field.n,) if field.ndim == 1 else (field.n, field.m)
    return (*field.shape, *entry)


def _views(fields):
    """Arrays by name that lie where the fields do, of those whose entries lie side by side."""
    found = {}
    for (name, field), (first, last) in zip(fields.items(), _addresses(fields.values())):
        kind, shape = np.dtype(to_numpy_type(field.dtype)), _shape(field)
        size = int(np.prod(shape, dtype=np.int64)) * kind.itemsize
        if last - first + kind.itemsize == size:
            memory = (ctypes.c_char * size).from_address(first)
            found[name] = np.frombuffer(memory, dtype=kind).reshape(shape)
    return found


def _addresses(fields):
    """Addresses of the first number of each field and of its last, as a list of pairs."""
    asked = []
    for field in fields:
        ends = [0] * len(field.shape), [length - 1 for length in field.shape]
        parts = (field, field)
        if isinstance(field, MatrixField):
            parts = [field.get_scalar_field(*place) for place in _corners(field)]
        asked += list(zip(parts, ends))
    numbered = [(place, *end) for place, end in enumerate(asked)]
    groups = [tuple(numbered[k : k + _UNROLLED]) for k in range(0, len(asked), _UNROLLED)]

    @ti.kernel
    def ask(found: ti.types.ndarray(dtype=ti.u64, ndim=1)):
        """Fill in the addresses."""
        for _ in range(1):
            for group in ti.static(tuple(groups)):
                for place, field, index in ti.static(group):
                    found[place] = ti.get_addr(field, index)

    found = np.zeros(len(asked), dtype=np.uint64)
    ask(found)
    return found.reshape(-1, 2).tolist()


def _corners(field):
    """Places of the first and the last component of a matrix or vector field."""
    return ((0,), (field.n - 1,)) if field.ndim == 1 else ((0, 0), (field.n - 1, field.m - 1))
