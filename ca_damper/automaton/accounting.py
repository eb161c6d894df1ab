"""What acts on the container (Komatsuzaki et al., 6.2, eq. 11: the sum of m (v - v') / dt).

The paper gives the container a force only while particles move. Here that is a landing: the first
blow to a wall after a change of cell. What goes on between a heap and the floor that it lies on is
left out, as it is there, and goes to the impulse balance if there is one.
With static contact everything acts on the container: every blow, every push, and also what the six
directions take from the particles, for it is the container that holds the lattice. So momentum is
kept, and the mean force is the weight.
"""

import taichi as ti

from ca_damper.automaton.impulse_balance import EJECTIONS, REST, quanta


@ti.data_oriented
class Landings:
    """Blows of particles that came from another cell, and pushes by the walls if ``pushes``.

    arrived: 1 for a particle that changed its cell since it last met a wall, shape
    (scenes, cells + 1); meaningless in cells without a particle.
    """

    def __init__(self, lattice, scenes, impulse_balance, pushes):
        self.lattice, self.impulse_balance, self.pushes = lattice, impulse_balance, pushes
        self.needs_lattice_impulse = impulse_balance.active
        self.arrived = ti.field(ti.i8, shape=(scenes, lattice.cells + 1))

    @ti.func
    def clear(self, s):
        """Nobody has moved yet."""
        self.impulse_balance.clear(s)
        for cell in range(self.lattice.cells + 1):
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
        """What counts [quanta] of a particle's gain of velocity along x by a blow [m/s]."""
        result = ti.cast(0, ti.i64)
        if self.arrived[s, cell] == 1:
            result = quanta(gain)
        else:
            self.impulse_balance.add(s, REST, gain)
        self.arrived[s, cell] = ti.cast(0, ti.i8)
        return result

    @ti.func
    def push(self, s, gain):
        """What counts of a gain by a push."""
        result = ti.cast(0, ti.i64)
        if ti.static(self.pushes):
            result = quanta(gain)
        else:
            self.impulse_balance.add(s, EJECTIONS, gain)
        return result

    @ti.func
    def lattice_impulse(self, s, item: ti.template(), gain):
        """What counts of a gain that the lattice is the cause of: nothing."""
        self.impulse_balance.add(s, item, gain)
        return ti.cast(0, ti.i64)


@ti.data_oriented
class AllImpulses:
    """All gains of velocity but by gravity act on the container; nothing is remembered."""

    needs_lattice_impulse = True

    @ti.func
    def clear(self, s):
        """Nothing to clear."""

    @ti.func
    def moved(self, s, origin, target):
        """Nothing to follow."""

    @ti.func
    def arrive(self, s, cell):
        """Nothing to note."""

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """What counts [quanta] of a particle's gain of velocity along x by a blow [m/s]."""
        return quanta(gain)

    @ti.func
    def push(self, s, gain):
        """What counts of a gain by a push."""
        return quanta(gain)

    @ti.func
    def lattice_impulse(self, s, item: ti.template(), gain):
        """What counts of a gain that the lattice is the cause of."""
        return quanta(gain)
