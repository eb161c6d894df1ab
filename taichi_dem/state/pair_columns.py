"""Columns of the pair store: data of effects and methods for a pair, or for two of its spheres."""

from typing import Any

import taichi as ti

from taichi_dem.kit.errors import InputError


@ti.data_oriented
class Columns:
    """Columns of one length, by name; zero when an entry comes into use."""

    def __init__(self, entries: int):
        self.entries = entries
        self.by_name: dict[str, ti.Field] = {}
        self.members: tuple[ti.Field, ...] = ()

    def __len__(self):
        return len(self.members)

    def declare(self, name: str, kind: Any, width: int = 0) -> ti.Field:
        """Field of a new column; width: components, 0 for a number.

        Raises InputError for a name that is in use.
        """
        if name in self.by_name:
            raise InputError(f"a column of the pair store must have a new name, got {name!r}")
        if width:
            column = ti.Vector.field(width, kind, shape=self.entries)
        else:
            column = ti.field(kind, shape=self.entries)
        self.by_name[name] = column
        self.members += (column,)
        return column

    @ti.func
    def clear(self, k):
        """Set all columns of entry k to zero."""
        for column in ti.static(self.members):
            column[k] = 0

    @ti.func
    def copy(self, source, k):
        """Copy an entry of all columns to entry k."""
        for column in ti.static(self.members):
            column[k] = column[source]
