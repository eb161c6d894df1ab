"""Which blows act on the container (Komatsuzaki et al., 6.2, eq. 11: the sum of m (v - v') / dt).

The paper gives the container a force only while particles move. Here that is a landing: the first
blow to a wall after a change of cell. What goes on between a heap and the floor that it lies on is
left out, as it is there, unless there is static contact: then every blow counts.
"""

import taichi as ti


@ti.data_oriented
class Landings:
    """Blows of particles that came from another cell, and pushes by the walls if ``pushes``.

    arrived: 1 for a particle that changed its cell since it last met a wall, shape
    (scenes, cells + 1); meaningless in cells without a particle.
    """

    def __init__(self, lattice, scenes, pushes):
        self.lattice, self.pushes = lattice, pushes
        self.arrived = ti.field(ti.i8, shape=(scenes, lattice.cells + 1))

    @ti.func
    def clear(self, s):
        """Nobody has moved yet."""
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
    def counts(self, s, cell):
        """Whether the blow of a particle counts; the next one will not."""
        result = self.arrived[s, cell] == 1
        self.arrived[s, cell] = ti.cast(0, ti.i8)
        return result


@ti.data_oriented
class EveryBlow:
    """All blows and all pushes act on the container; nothing is remembered."""

    pushes = True

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
    def counts(self, s, cell):
        """Every blow counts."""
        return True
