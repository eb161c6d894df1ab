"""Forces on the container (Komatsuzaki et al., 6.2, eq. 11: the sum of m (v - v') / dt)."""

from typing import Any, ClassVar

import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields

#: Unit of sums of velocities [m/s]; 2^-40 leaves room for 8 million m/s in an i64.
QUANTUM = 2.0**-40


@ti.func
def quanta(velocity):
    """A velocity [m/s] as a whole number of quanta."""
    return ti.cast(ti.floor(velocity / QUANTUM + 0.5), ti.i64)


@ti.data_oriented
class Uncounted:
    """No impulse acts on the container: the base of the others.

    labels: of an automaton without and with static contact. effects: counted beside "landing", in
    words. The ti.funcs with a ``gain`` [m/s] return the part that counts [quanta].
    """

    labels: ClassVar[tuple[str, str]] = ("ca_uncounted", "ca_uncounted_static")
    effects: ClassVar[tuple[str, ...]] = ()
    static_contact: ClassVar[bool] = False
    counts_all: ClassVar[bool] = False

    def __init__(self, table: SceneFields, lattice: Any):
        """Allocate its fields, with ``table.field``."""

    @ti.func
    def clear(self, s):
        """Reset scene s."""

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle from one cell to another."""

    @ti.func
    def arrive(self, s, cell):
        """Note that a particle has flown into a cell."""

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Book the gain of a particle that meets a wall or comes to rest on the floor."""
        return ti.cast(0, ti.i64)

    @ti.func
    def push(self, s, gain):
        """Book the gain of a particle that a wall pushes along."""
        return ti.cast(0, ti.i64)

    @ti.func
    def lattice_impulse(self, gain):
        """Book a gain that the six directions of the lattice cause; only where all counts."""
        return quanta(gain) if ti.static(self.counts_all) else ti.cast(0, ti.i64)


@ti.data_oriented
class AllImpulses(Uncounted):
    """Every impact and push counts, and so do losses to the six directions of the lattice."""

    labels: ClassVar[tuple[str, str]] = ("ca_all", "ca_static")
    effects: ClassVar[tuple[str, ...]] = ("ejection",)
    static_contact: ClassVar[bool] = True
    counts_all: ClassVar[bool] = True

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count an impact [quanta]."""
        return quanta(gain)

    @ti.func
    def push(self, s, gain):
        """Count a push [quanta]."""
        return quanta(gain)


@ti.data_oriented
class Landings(Uncounted):
    """Impacts of particles that came from another cell, as in the paper (6.2)."""

    labels: ClassVar[tuple[str, str]] = ("ca_landing", "ca_landing_static")

    def __init__(self, table: SceneFields, lattice: Any):
        self.lattice, self.arrived = lattice, table.field(ti.i8, "cells")

    @ti.func
    def clear(self, s):
        """No particle has moved yet."""
        for cell in range(self.lattice.size.cells[s] + 1):
            self.arrived[s, cell] = ti.cast(0, ti.i8)

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle to another cell."""
        self.arrived[s, target] = self.arrived[s, origin]

    @ti.func
    def arrive(self, s, cell):
        """Note that a particle has flown into a cell."""
        self.arrived[s, cell] = ti.cast(1, ti.i8)

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count an impact [quanta] if the particle has changed its cell since the last."""
        result = ti.cast(0, ti.i64)
        if self.arrived[s, cell] == 1:
            result = quanta(gain)
        self.arrived[s, cell] = ti.cast(0, ti.i8)
        return result


@ti.data_oriented
class LandingsAndPushes(Landings):
    """Landings, and pushes by the walls: closest to the paper's Fig. 11."""

    labels: ClassVar[tuple[str, str]] = ("ca_ejection", "ca_ejection_static")
    effects: ClassVar[tuple[str, ...]] = ("ejection",)

    @ti.func
    def push(self, s, gain):
        """Count a push [quanta]."""
        return quanta(gain)


#: Accountings by the word that an ``Automaton`` takes.
ACCOUNTINGS: dict[str, type[Uncounted]] = {
    "landing": Landings,
    "landing+ejection": LandingsAndPushes,
    "all": AllImpulses,
}
