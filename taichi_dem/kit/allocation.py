"""Field trees: fields declared in one block, allocated together, read and written in place.

Taichi crashes beyond 512 field trees a session and never frees one by itself.
"""

import contextlib
import math
import os
import weakref
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike
from taichi._snode.fields_builder import FieldsBuilder
from taichi.lang import impl
from taichi.lang.snode import SNode
from taichi.lang.util import to_numpy_type

from taichi_dem.kit import backend
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.taichi_patches import addresses
from taichi_dem.kit.taichi_patches.addresses import array_of, lies_here

#: Trees beyond which no new one is begun; a few more complete those begun.
MOST_TREES = 480
#: Share of the free memory that a tree may take.
_SHARE = 0.9
#: Taichi's lists of fields without a place.
_FIELDS = ("global_vars", "grad_vars", "dual_vars", "matrix_fields")
#: Numbers of the trees whose memory has been freed, by session; Taichi still lists them.
_destroyed: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


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
            addresses.remember(self._builder.root.ptr, self._anchor)
            # Taichi has written zeros to every page.
            self.clear()

    def clear(self) -> None:
        """Set all bytes to zero; only where it ``lies_here``."""
        ti.sync()
        addresses.clear(self._builder.root.ptr)

    def destroy(self) -> None:
        """Free the memory; the fields must not be used any more."""
        addresses.forget(self._builder.root.ptr)
        _destroyed.setdefault(impl.get_runtime(), set()).add(self._builder.root.ptr.id)
        self._tree.destroy()
        self._tree = None


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

    def restore_fields(self, tree: object = None) -> None:
        """Forget the fields declared since, and a tree."""
        if impl.get_runtime() is self._runtime:
            self._runtime.unfinalized_fields_builder.pop(tree, None)
            for name, fields in self._fields.items():
                setattr(self._runtime, name, list(fields))


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
    limits = [_free_memory()]
    with contextlib.suppress(OSError, ValueError):
        with (
            open("/sys/fs/cgroup/memory.max") as most,
            open("/sys/fs/cgroup/memory.current") as now,
        ):
            limits.append(float(most.read()) - float(now.read()))
    return min(limits)


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
    gone = _destroyed.get(impl.get_runtime(), ())
    return [root for root in FieldsBuilder._finalized_roots() if root.ptr.id not in gone]


@ti.func
def raise_to(field: ti.template(), value):
    """Raise a field of no dimension to the largest value of a loop."""
    # Compare first: an atomic for every body costs as much as its rotation.
    if value > field[None]:
        ti.atomic_max(field[None], value)
