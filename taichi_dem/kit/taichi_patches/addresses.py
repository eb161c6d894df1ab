"""Where fields lie, so that they are read, written and cleared in place on a CPU."""

import ctypes
import math
import mmap
import weakref

import numpy as np
import taichi as ti
from taichi.lang import impl
from taichi.lang.matrix import MatrixField
from taichi.lang.util import to_numpy_type

from taichi_dem.kit import backend
from taichi_dem.kit.taichi_patches.names import are_on

#: Bytes of a tree from which on giving its pages back is faster than to overwrite them.
LARGE = 2**23

#: Addresses of the trees of the session by their roots, and the session's program.
_bases: dict = {}
_bases_of = None
#: Where fields lie in their trees, and their arrays, which are asked for thousands of times a run.
_layouts: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()
_arrays: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


def lies_here() -> bool:
    """Whether memory of trees is read and written in place: on a CPU."""
    return backend.is_cpu() and are_on()


def remember(root: object, anchor: ti.Field) -> None:
    """Find the address of a tree by one of its fields, of one dimension."""
    address = _address(anchor) - _offset(anchor.snode.ptr)[1]
    _forget_other_sessions()
    _bases[root.id] = address


def forget(root: object) -> None:
    """Let go of a tree, whose memory is about to be freed."""
    _bases.pop(root.id, None)
    for field in [field for field in _arrays if _layout(field)[0].id == root.id]:
        del _arrays[field]


def clear(root: object) -> None:
    """Set all bytes of a tree to zero."""
    memory = _array_at(_base(root), np.dtype(np.uint8), (root.cell_size_bytes,), (1,))
    first, end = _given_back(_base(root), memory)
    memory[:first], memory[end:] = 0, 0


def _given_back(address, memory):
    """Range of the bytes that are zero now, as their pages went back to the system."""
    # Most lists are long and hardly used: pages given back take no memory until they are written.
    page = mmap.PAGESIZE
    first, end = -address % page, (address + len(memory)) // page * page - address
    if len(memory) < LARGE or not hasattr(mmap, "MADV_DONTNEED"):
        return 0, 0
    memory[first] = 1
    words = [*map(ctypes.c_size_t, (address + first, end - first))]
    advise = ctypes.CDLL(None).madvise
    refused = advise(*words, mmap.MADV_DONTNEED)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        advise(*words, mmap.MADV_HUGEPAGE)
    # Of memory that is shared with others, the system keeps what is in it.
    return (0, 0) if refused or memory[first] else (first, end)


def _base(root):
    """Address of a tree of the present session by its root; 0 for one that is no ``FieldTree``."""
    _forget_other_sessions()
    return _bases.get(root.id, 0)


def _forget_other_sessions():
    """Restart the numbers of roots, as each session does."""
    global _bases_of
    if _bases_of is not impl.get_runtime().prog:
        _bases_of = impl.get_runtime().prog
        _bases.clear()
        _arrays.clear()


def array_of(field: ti.Field) -> np.ndarray | None:
    """Array that lies where a field of a ``FieldTree`` does, on a CPU; else None."""
    _forget_other_sessions()
    array = _arrays.get(field)
    if array is None and lies_here() and _base(_layout(field)[0]):
        root, offset, kind, shape, strides = _layout(field)
        array = _arrays[field] = _array_at(_base(root) + offset, kind, shape, strides)
    return array


def _layout(field):
    """Root of a field's tree, bytes from there to its first entry, type, shape and strides."""
    if field not in _layouts:
        _layouts[field] = _found_layout(field)
    return _layouts[field]


def _found_layout(field):
    kind, entry, first = np.dtype(to_numpy_type(field.dtype)), (), field
    if isinstance(field, MatrixField):
        entry = (field.n, field.m)[: field.ndim]
        first = field.get_scalar_field(*(0,) * field.ndim)
    node = first.snode.ptr
    outer = _strides(field.shape, node.parent.cell_size_bytes)
    strides = outer + _strides(entry, kind.itemsize)
    return (*_offset(node), kind, (*field.shape, *entry), strides)


def _strides(shape, size):
    """Bytes from an entry to the next along each axis; size: of an entry [bytes]."""
    return tuple(size * math.prod(shape[k + 1 :]) for k in range(len(shape)))


def _offset(node):
    """Root of the tree of a node, and bytes from the tree's beginning to the node."""
    offset = 0
    while node.parent is not None:
        offset += node.offset_bytes_in_parent_cell
        node = node.parent
    return node, offset


def _address(field):
    """Address of the first entry of a field of one dimension."""
    address = np.zeros(1, dtype=np.uint64)

    @ti.kernel
    def ask(address: ti.types.ndarray(dtype=ti.u64, ndim=1)):
        for _ in range(1):
            address[0] = ti.get_addr(field, 0)

    ask(address)
    return int(address[0])


def _array_at(address, kind, shape, strides):
    size = sum((n - 1) * step for n, step in zip(shape, strides)) + kind.itemsize
    memory = (ctypes.c_char * size).from_address(address)
    return np.ndarray(shape, kind, memory, strides=strides)
