"""Contents of the cells of every scene, and moves from one cell to another."""

from typing import Any

import taichi as ti

from ca_damper.automaton.lattice import EMPTY
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Cells:
    """State of all cells; fields of shape (scenes, cells + 1), a scene's cells together in memory.

    kind: direction of a particle, or EMPTY, WALL, HELD. speed: along that direction, >= 0 [m/s].
    travelled: part of the way to the next cell [m], negative while short of the own cell's centre.
    Speed and way are zero in cells without a particle under way.
    stair: displacement of the container in whole cells, (scenes,); offset: what is left of it [m].
    Velocities are those of the room, not of the container.
    """

    def __init__(self, table: SceneFields, lattice: Any, traversal: Any, follower: Any):
        self.lattice, self.traversal = lattice, traversal
        self.followers = (traversal, follower)
        self.kind = table.field(ti.i8, "cells")
        self.speed = table.field(ti.f64, "cells")
        self.travelled = table.field(ti.f64, "cells")
        self.stair = table.field(ti.i32)
        self.offset = table.field(ti.f64)

    @ti.func
    def clear(self, s):
        """Walls and nothing else."""
        for cell in range(self.lattice.cell_count() + 1):
            self.put(s, cell, ti.cast(self.lattice.blank[cell], ti.i32), 0.0, 0.0)

    @ti.func
    def at(self, s, cell):
        """Kind of the content of a cell, as i32."""
        return ti.cast(self.kind[s, cell], ti.i32)

    @ti.func
    def put(self, s, cell, kind, speed, travelled):
        """Set the content of a cell."""
        self.kind[s, cell] = ti.cast(kind, ti.i8)
        self.speed[s, cell] = speed
        self.travelled[s, cell] = travelled

    @ti.func
    def relocate(self, s, origin, target, travelled):
        """Move the content of a cell to another, empty one."""
        self.put(s, target, self.at(s, origin), self.speed[s, origin], travelled)
        self.put(s, origin, EMPTY, 0.0, 0.0)
        for follower in ti.static(self.followers):
            follower.moved(s, origin, target)

    @ti.func
    def vertical_speed(self, s, cell):
        """Velocity along x of a particle under way [m/s]; 0 in every other cell."""
        return self.speed[s, cell] * self.lattice.upward(self.at(s, cell))
