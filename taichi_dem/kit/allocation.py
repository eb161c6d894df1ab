"""Field trees: fields declared in one block, allocated together, read and written in place.

Taichi crashes beyond 512 field trees a session and never frees one by itself.
"""

import contextlib
import ctypes
import math
import mmap
import os
import weakref
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi._snode.fields_builder import FieldsBuilder
from taichi.lang import impl
from taichi.lang.matrix import MatrixField
from taichi.lang.snode import SNode
from taichi.lang.util import to_numpy_type

from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.taichi_names import may_use

#: Trees beyond which no new one is begun; a few more complete those begun.
MOST_TREES = 480
#: Share of the free memory that a tree may take.
_SHARE = 0.9
#: Bytes of a tree from which on giving its pages back is faster than to overwrite them.
_LARGE = 2**23
#: Taichi's lists of fields without a place.
_FIELDS = ("global_vars", "grad_vars", "dual_vars", "matrix_fields")


#: Names of Taichi by which a field is found in its tree.
_PLACES = (
    "taichi._lib.core.SNode.cell_size_bytes",
    "taichi._lib.core.SNode.offset_bytes_in_parent_cell",
)


class CapacityError(InputError):
    """The machine has no memory left, or Taichi no further field tree."""


class FieldTree:
    """Fields declared in its ``with`` block, allocated together at the end of the block."""

    scratch_fields = ("_anchor",)

    def __init__(self, advice: str = "take a smaller one", counted: tuple[int, str] = (0, "")):
        self.advice, self.counted, self.bytes = advice, counted, 0
        self._tree: Any = None

    def __enter__(self) -> "FieldTree":
        check_capacity()
        self._before = _Declared()
        self._builder = impl._root_fb = FieldsBuilder()
        self._anchor = ti.field(ti.i64, shape=1)
        return self

    def __exit__(self, kind, error, _):
        if kind is None:
            backend.align(self._builder.root.ptr)
        self._before.restore_trees()
        if kind is not None:
            self._before.restore_fields()
            return
        try:
            self._allocate()
        except BaseException:
            self._before.restore_fields(self._builder)
            raise

    def _check_size(self):
        """Raise CapacityError where the device cannot hold the fields, or loop over one of them."""
        root, (count, what) = self._builder.root.ptr, self.counted
        self.bytes = backend.declared_bytes(root)
        longest = max(math.prod(SNode(root.get_ch(k)).shape) for k in range(root.get_num_ch()))
        share = min(backend.most_bytes() / self.bytes, backend.most_entries() / longest)
        if share < 1.0:
            fits = f"; about {int(share * count)} {what} fit" if count else ""
            raise CapacityError(
                f"this needs {self.bytes / 1e9:.3g} GB and fields of {longest} entries, which this "
                f"device does not take: {self.advice}{fits}"
            )
        if backend.in_host_memory():
            check_memory(self.bytes, self.advice)

    def _allocate(self):
        self._check_size()
        # Taichi takes it off its list of trees that are not finalized, and expects it there.
        impl.get_runtime().initialize_fields_builder(self._builder)
        try:
            self._tree = self._builder.finalize(raise_warning=False)
        except RuntimeError as error:
            # Taichi does not tell how much memory of a card is free.
            raise CapacityError(
                f"this needs {self.bytes / 1e9:.3g} GB, which the device does not give "
                f"({' '.join(str(error).split())}): {self.advice}"
            ) from None
        if lies_here():
            address = _address(self._anchor) - _offset(self._anchor.snode.ptr)[1]
            _base(self._builder.root.ptr)
            _bases[self._builder.root.ptr.id] = address
            # Taichi has written zeros to every page.
            self.clear()

    def clear(self) -> None:
        """Set all bytes to zero; only where it ``lies_here``."""
        ti.sync()
        root = self._builder.root.ptr
        memory = _array_at(_base(root), np.uint8, (root.cell_size_bytes,))
        first, end = _given_back(_base(root), memory)
        memory[:first], memory[end:] = 0, 0

    def destroy(self) -> None:
        """Free the memory; the fields must not be used any more."""
        number = self._builder.root.ptr.id
        _bases.pop(number, None)
        _destroyed.add(number)
        for field in [field for field in _arrays if _layout(field)[0].id == number]:
            del _arrays[field]
        self._tree.destroy()
        self._tree = None


def lies_here() -> bool:
    """Whether memory of trees is read and written in place: on a CPU, where Taichi says where."""
    return backend.is_cpu() and may_use(*_PLACES)


def _given_back(address, memory):
    """Range of the bytes that are zero now, as their pages went back to the system."""
    # Most lists are long and hardly used: pages given back take no memory until they are written.
    page = mmap.PAGESIZE
    first, end = -address % page, (address + len(memory)) // page * page - address
    if len(memory) < _LARGE or not hasattr(mmap, "MADV_DONTNEED"):
        return 0, 0
    memory[first] = 1
    words = [*map(ctypes.c_size_t, (address + first, end - first))]
    advise = ctypes.CDLL(None).madvise
    refused = advise(*words, mmap.MADV_DONTNEED)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        advise(*words, mmap.MADV_HUGEPAGE)
    # Of memory that is shared with others, the system keeps what is in it.
    return (0, 0) if refused or memory[first] else (first, end)


class _Declared:
    """Fields and trees that Taichi holds to be declared and not yet allocated."""

    def __init__(self):
        self._runtime, self._root = impl.get_runtime(), impl._root_fb
        self._trees = dict(self._runtime.unfinalized_fields_builder)
        self._fields = {name: list(getattr(self._runtime, name)) for name in _FIELDS}

    def restore_trees(self) -> None:
        """Forget the trees declared since."""
        if impl.get_runtime() is self._runtime:
            impl._root_fb = self._root
            self._runtime.unfinalized_fields_builder = dict(self._trees)

    def restore_fields(self, tree: Any = None) -> None:
        """Forget the fields declared since, and a tree."""
        if impl.get_runtime() is self._runtime:
            self._runtime.unfinalized_fields_builder.pop(tree, None)
            for name, fields in self._fields.items():
                setattr(self._runtime, name, list(fields))


#: Addresses of the trees of the session by their roots, and the session's program.
_bases: dict = {}
_bases_of = None
#: Roots whose memory has been freed; Taichi still lists them.
_destroyed: set = set()


def _base(root) -> int:
    """Address of a tree of the present session by its root; 0 for one that is no ``FieldTree``."""
    _forget_other_sessions()
    return _bases.get(root.id, 0)


def _forget_other_sessions() -> None:
    """Restart the numbers of roots, as each session does."""
    global _bases_of
    if _bases_of is not impl.get_runtime().prog:
        _bases_of = impl.get_runtime().prog
        _bases.clear()
        _arrays.clear()
        _destroyed.clear()


def in_tree(field: ti.Field) -> bool:
    """Whether a field lies in a ``FieldTree`` that ``lies_here``."""
    return lies_here() and _base(_layout(field)[0]) != 0


def array_of(field: ti.Field) -> np.ndarray | None:
    """Array that lies where a field of a ``FieldTree`` does, on a CPU; else None."""
    _forget_other_sessions()
    array = _arrays.get(field)
    if array is None and in_tree(field):
        root, offset, kind, shape, strides = _layout(field)
        array = _arrays[field] = _array_at(_base(root) + offset, kind, shape, strides)
    return array


#: Where fields lie in their trees, and their arrays, which are asked for thousands of times a run.
_layouts: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()
_arrays: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


def _layout(field):
    """Root of a field's tree, bytes from there to its first entry, type, shape and strides."""
    if field not in _layouts:
        _layouts[field] = _found_layout(field)
    return _layouts[field]


def _found_layout(field):
    first = _first_scalar(field).snode.ptr
    kind = np.dtype(to_numpy_type(field.dtype))
    shape: tuple[int, ...] = tuple(field.shape)
    strides: tuple[int, ...] = ()
    if shape:
        strides = (first.parent.cell_size_bytes,)
        for length in reversed(shape[1:]):
            strides = (strides[0] * length, *strides)
    if isinstance(field, MatrixField):
        entry = (field.n,) if field.ndim == 1 else (field.n, field.m)
        steps = (kind.itemsize,) if field.ndim == 1 else (field.m * kind.itemsize, kind.itemsize)
        shape, strides = shape + entry, strides + steps
    return (*_offset(first), kind, shape, strides)


def values(field: ti.Field, wanted: Any = ...) -> np.ndarray:
    """Copy of entries of a field; wanted: their slice or their numbers, all by default."""
    array = array_of(field)
    if array is None:
        return field.to_numpy()[wanted]
    impl.get_runtime().prog.synchronize()
    return np.array(array[wanted])


def assign(field: ti.Field, array: ArrayLike) -> None:
    """Write an array to the first entries of a field; the others keep their values."""
    array = np.asarray(array)
    if array.ndim == 0 and field.shape:
        array = np.full(values(field).shape, array)
    place = array_of(field)
    if place is None:
        if array.shape[:1] == field.shape[:1]:
            field.from_numpy(array.astype(to_numpy_type(field.dtype)))
            return
        whole = field.to_numpy()
        whole[slice(len(array)) if whole.ndim else ()] = array
        field.from_numpy(whole)
        return
    impl.get_runtime().prog.synchronize()
    place[slice(len(array)) if array.ndim else ()] = array


def available_bytes() -> float:
    """Memory available to a new allocation; infinite where the system does not report it."""
    found = [_free_memory()]
    with contextlib.suppress(OSError, ValueError):
        with (
            open("/sys/fs/cgroup/memory.max") as most,
            open("/sys/fs/cgroup/memory.current") as now,
        ):
            found.append(float(most.read()) - float(now.read()))
    return min(found)


def _free_memory() -> float:
    with contextlib.suppress(OSError, ValueError, StopIteration):
        with open("/proc/meminfo") as lines:
            line = next(line for line in lines if line.startswith("MemAvailable"))
            return 1024.0 * float(line.split()[1])
    with contextlib.suppress(AttributeError, OSError, ValueError):
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return math.inf


def check_memory(needed: float, advice: str) -> None:
    """Raise InputError, which ends with an advice, where the memory needed [bytes] is not free."""
    free = available_bytes()
    if needed > _SHARE * free:
        raise CapacityError(
            f"this needs {needed / 1e9:.3g} GB of memory, of which {free / 1e9:.3g} GB are free: "
            f"{advice}"
        )


def _first_scalar(field):
    if not isinstance(field, MatrixField):
        return field
    return field.get_scalar_field(*((0,) if field.ndim == 1 else (0, 0)))


def _offset(node) -> tuple:
    """Root of the tree of a node, and bytes from the tree's beginning to the node."""
    offset = 0
    while node.parent is not None:
        offset += node.offset_bytes_in_parent_cell
        node = node.parent
    return node, offset


def _address(field) -> int:
    """Address of the first entry of a field of one dimension."""
    found = np.zeros(1, dtype=np.uint64)

    @ti.kernel
    def ask(found: ti.types.ndarray(dtype=ti.u64, ndim=1)):
        for _ in range(1):
            found[0] = ti.get_addr(field, 0)

    ask(found)
    return int(found[0])


def _array_at(address, kind, shape, strides=None) -> np.ndarray:
    kind = np.dtype(kind)
    size = int(np.prod(shape, dtype=np.int64)) * kind.itemsize
    if strides is not None and shape:
        size = sum((n - 1) * step for n, step in zip(shape, strides)) + kind.itemsize
    memory = (ctypes.c_char * size).from_address(address)
    return np.ndarray(shape, kind, memory, strides=strides)


def check_capacity() -> None:
    """Raise InputError when the session has no room for more fields."""
    trees = tree_count()
    if trees > MOST_TREES:
        raise CapacityError(
            f"groups of fields in a Taichi session must stay below {MOST_TREES}, got {trees}: "
            "call runtime.clear() after a few hundred kinds of scenes"
        )


def tree_count() -> int:
    """Field trees of the session whose memory has not been freed."""
    return len(_live_roots()) if impl.get_runtime().prog is not None else 0


def field_bytes() -> int:
    """Bytes of all fields that the session has used so far."""
    return sum(root._cell_size_bytes for root in _live_roots())


def _live_roots() -> list:
    _forget_other_sessions()
    roots = FieldsBuilder._finalized_roots()
    return [root for root in roots if root.ptr.id not in _destroyed]


@ti.func
def raise_to(field: ti.template(), value):
    """Raise a field of no dimension to the largest value of a loop."""
    # Compare first: an atomic for every body costs as much as its rotation.
    if value > field[None]:
        ti.atomic_max(field[None], value)
