"""Columns of the pair store: data of effects and methods for a pair, or for two of its spheres."""

from typing import Any

import taichi as ti

from taichi_dem.kit.errors import InputError


@ti.data_oriented
class Column:
    """One number or vector an entry; zero when the entry comes into use.

    width: components, 0 for a number.
    """

    def __init__(self, kind: Any, width: int, entries: int):
        self.kind, self.width = kind, width
        if width:
            self.field = ti.Vector.field(width, kind, shape=entries)
        else:
            self.field = ti.field(kind, shape=entries)

    @ti.func
    def clear(self, k):
        """Set entry k to zero."""
        if ti.static(self.width > 0):
            self.field[k] = ti.Vector.zero(self.kind, self.width)
        else:
            self.field[k] = 0

    @ti.func
    def copy(self, source, k):
        """Copy an entry to entry k."""
        self.field[k] = self.field[source]


@ti.data_oriented
class Columns:
    """Columns of one length, by name."""

    def __init__(self, entries: int):
        self.entries = entries
        self.by_name: dict[str, ti.Field] = {}
        self.members: tuple[Column, ...] = ()

    def __len__(self):
        return len(self.members)

    def declare(self, name: str, kind: Any, width: int = 0) -> ti.Field:
        """Field of a new column. Raises InputError for a name that is in use."""
        if name in self.by_name:
            raise InputError(f"a column of the pair store must have a new name, got {name!r}")
        column = Column(kind, width, self.entries)
        self.by_name[name] = column.field
        self.members += (column,)
        return column.field

    @ti.func
    def clear(self, k):
        """Set all columns of entry k to zero."""
        for column in ti.static(self.members):
            column.clear(k)

    @ti.func
    def copy(self, source, k):
        """Copy an entry of all columns to entry k."""
        for column in ti.static(self.members):
            column.copy(source, k)
