"""Taichi crashes beyond 512 field trees a session, so allocation is batched.

A group is what is declared between two uses of any field. A model that wrote each field as soon as
it was made would take twenty groups, and the thirtieth model of a notebook would end it.
"""

import contextlib

import taichi as ti
from taichi._snode.fields_builder import FieldsBuilder
from taichi.lang import impl

from taichi_dem.kit.errors import InputError

#: Groups after which nothing new is begun; what has begun needs some more.
MOST_GROUPS = 480

_waiting = None


@contextlib.contextmanager
def batch_allocation():
    """Hold back what is given to ``defer_fill`` until the end of the block, in its order.

    Blocks may nest; the outermost counts. Raises InputError when the session has no room left.
    """
    global _waiting
    if _waiting is not None:
        yield
        return
    check_capacity()
    _waiting = []
    try:
        yield
        loads = _waiting
    finally:
        _waiting = None
    for load, arguments in loads:
        load(*arguments)


def defer_fill(load, *arguments):
    """Call load(*arguments), which uses fields: now, or at the end of ``batch_allocation``."""
    if _waiting is None:
        load(*arguments)
    else:
        _waiting.append((load, arguments))


def check_capacity():
    """Raise InputError when the session has no room for more fields."""
    program = impl.get_runtime().prog
    groups = program.get_snode_tree_size() if program is not None else 0
    if groups > MOST_GROUPS:
        raise InputError(
            f"groups of fields in a Taichi session must stay below {MOST_GROUPS}, got {groups}: "
            "call runtime.stop() and runtime.start() after some hundred simulations"
        )


def field_bytes():
    """Bytes of all fields that the session has used so far."""
    return sum(root._cell_size_bytes for root in FieldsBuilder._finalized_roots())


@ti.func
def raise_to(field: ti.template(), value):
    """Let a field of no dimension hold the largest of the values that a loop gives it."""
    # Ask first: an atomic for every body costs as much as its rotation.
    if value > field[None]:
        ti.atomic_max(field[None], value)
