"""Distance travelled after a turn: four readings of a rule that the paper leaves open.

The paper says that the distance is summed up to a cell's width (eq. 8), but not how a turn changes
the sum. ``signed`` takes the sum for a position: the distance along the new direction is the
component of the old one, so that a turn straight back changes its sign, and a wall sets it to the
wall's position, which is zero while the container does not move. ``signed_through_walls`` leaves
walls out, ``reset`` starts from zero at every turn, and ``kept`` keeps the sum.
"""

import taichi as ti

from ca_damper.automaton.lattice import Lattice

READINGS = ("signed", "signed_through_walls", "reset", "kept")


@ti.data_oriented
class Accumulator:
    """One of the readings."""

    def __init__(self, reading: str, lattice: Lattice):
        self.reading, self.lattice = reading, lattice

    @ti.func
    def turned(self, travelled, old, new):
        """Distance travelled [m] after a turn from direction old to new."""
        result = travelled
        if ti.static(self.reading.startswith("signed")):
            result = travelled * self.lattice.cosine[old, new]
        elif ti.static(self.reading == "reset"):
            if old != new:
                result = 0.0
        return result

    @ti.func
    def after_wall(self, travelled, old, new, place):
        """Distance travelled [m] after meeting a wall that stands ``place`` [m] above its cells."""
        result = self.at_wall(new, place)
        if ti.static(self.reading != "signed"):
            result = self.turned(travelled, old, new)
        return result

    @ti.func
    def at_wall(self, kind, place):
        """Distance travelled [m] of a particle that leaves a wall."""
        result = 0.0
        if ti.static(self.reading == "signed"):
            result = place * self.lattice.upward(kind)
        return result

    @ti.func
    def distance_to_wall(self, travelled, kind, way, width):
        """Distance travelled [m] of a particle ahead of a wall that pushes its cell along.

        A particle that flies straight (up for way 1, down for -1) keeps its place in the room.
        """
        result = 0.0
        if ti.static(self.reading == "signed"):
            if self.lattice.upward(kind) * way == 1.0:
                result = max(travelled - width, -width)
        return result
