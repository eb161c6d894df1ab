"""Forces on the container (Komatsuzaki et al., 6.2, eq. 11: the sum of m (v - v') / dt)."""

import taichi as ti

from ca_damper.automaton.lattice import Lattice

#: Accountings, and the label of an automaton with each, without and with static contact.
ACCOUNTINGS = {
    "landing": ("ca_landing", "ca_landing_static"),
    "landing+ejection": ("ca_ejection", "ca_ejection_static"),
    "all": ("ca_all", "ca_static"),
}
#: Unit of sums of velocities [m/s]; 2^-40 leaves room for 8 million m/s in an i64.
QUANTUM = 2.0**-40


@ti.func
def quanta(velocity):
    """A velocity [m/s] as a whole number of quanta."""
    return ti.cast(ti.floor(velocity / QUANTUM + 0.5), ti.i64)


@ti.data_oriented
class Accounting:
    """Which gains in velocity [m/s] of the particles act on the container [quanta].

    ``landing``: impacts of particles that came from another cell, as in the paper (6.2).
    ``landing+ejection``: pushes by the walls too, closest to the paper's Fig. 11. ``all``: every
    impact and push, and losses to the six directions of the lattice.
    """

    def __init__(self, word: str, lattice: Lattice):
        self.lattice = lattice
        self.counts_pushes, self.counts_all = word != "landing", word == "all"
        if not self.counts_all:
            self.arrived = lattice.table.field(ti.i8, "cells")

    @ti.func
    def clear(self, s):
        """No particle has moved yet."""
        if ti.static(not self.counts_all):
            for cell in range(self.lattice.size.cells[s] + 1):
                self.arrived[s, cell] = ti.cast(0, ti.i8)

    @ti.func
    def moved(self, s, origin, target):
        """Follow a particle to another cell."""
        if ti.static(not self.counts_all):
            self.arrived[s, target] = self.arrived[s, origin]

    @ti.func
    def arrive(self, s, cell):
        """Note that a particle has flown into a cell."""
        if ti.static(not self.counts_all):
            self.arrived[s, cell] = ti.cast(1, ti.i8)

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count the gain of a particle that meets a wall or comes to rest on the floor."""
        result = quanta(gain)
        if ti.static(not self.counts_all):
            # Once after each change of cell.
            if self.arrived[s, cell] == 0:
                result = ti.cast(0, ti.i64)
            self.arrived[s, cell] = ti.cast(0, ti.i8)
        return result

    @ti.func
    def push(self, s, gain):
        """Count the gain of a particle that a wall pushes along."""
        return quanta(gain) if ti.static(self.counts_pushes) else ti.cast(0, ti.i64)

    @ti.func
    def lattice_impulse(self, gain):
        """Count a gain that the six directions of the lattice cause."""
        return quanta(gain) if ti.static(self.counts_all) else ti.cast(0, ti.i64)
