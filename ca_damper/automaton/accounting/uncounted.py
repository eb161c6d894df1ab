"""Accounting that counts no impulse: the base of the others."""

from typing import Any, ClassVar

import taichi as ti

from ca_damper.automaton.impulse_balance import EJECTIONS, REST
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Uncounted:
    """No impulse acts on the container; each goes to the impulse balance, if there is one."""

    labels: ClassVar[tuple[str, str]] = ("ca_uncounted", "ca_uncounted_static")
    effects: ClassVar[tuple[str, ...]] = ()
    static_contact: ClassVar[bool] = False
    counts_all: ClassVar[bool] = False

    def __init__(self, table: SceneFields, lattice: Any, impulse_balance: Any):
        self.impulse_balance = impulse_balance

    @property
    def needs_lattice_impulse(self) -> bool:
        """Whether impulses of the lattice are counted or balanced."""
        return self.counts_all or self.impulse_balance.active

    @ti.func
    def clear(self, s):
        """Reset the balance of scene s."""
        self.impulse_balance.clear(s)

    @ti.func
    def moved(self, s, origin, target):
        """Nothing to follow."""

    @ti.func
    def arrive(self, s, cell):
        """Nothing to note."""

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Leave out an impact on a wall or the floor."""
        self.impulse_balance.add(s, REST, gain)
        return ti.cast(0, ti.i64)

    @ti.func
    def push(self, s, gain):
        """Leave out a push by a wall."""
        self.impulse_balance.add(s, EJECTIONS, gain)
        return ti.cast(0, ti.i64)

    @ti.func
    def lattice_impulse(self, s, item: ti.template(), gain):
        """Leave out a gain that the lattice causes."""
        self.impulse_balance.add(s, item, gain)
        return ti.cast(0, ti.i64)
