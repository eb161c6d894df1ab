"""The lattice steps along with the container by whole cells."""

from typing import Any

import taichi as ti


@ti.data_oriented
class Staircase:
    """Displacement of the container, rounded to whole cells; ``advance`` says what a step does."""

    def __init__(self, components: Any):
        self.cells, self.lattice = components.cells, components.lattice
        self.parameters = components.parameters

    @ti.func
    def follow(self, s, step, motion):
        """Take the staircase along; returns counted gain of velocity along x [quanta]."""
        width = self.parameters.width[None]
        stair = ti.cast(ti.floor(motion.x / width + 0.5), ti.i32)
        way = 0
        if step == 0:
            self.cells.stair[s] = stair
        elif stair > self.cells.stair[s]:
            way = 1
        elif stair < self.cells.stair[s]:
            way = -1
        self.cells.stair[s] = self.cells.stair[s] + way
        self.cells.offset[s] = motion.x - width * self.cells.stair[s]
        impulse = ti.cast(0, ti.i64)
        if way != 0:
            impulse = self.advance(s, way, motion.v)
        return impulse
