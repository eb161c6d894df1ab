"""Grains at rest on the floor, or on a grain that rests."""

from typing import Any

import taichi as ti

from ca_damper.automaton.lattice import HELD, UP
from ca_damper.automaton.static_contact import StaticContact
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Heap(StaticContact):
    """Grains that the container carries.

    rests: whether there is static contact at all.
    """

    def __init__(self, table: SceneFields, grains: Any, parameters: Any, rests: bool):
        self.cells, self.parameters, self.rests = grains, parameters, rests
        self.held = table.field(ti.i32)

    @ti.func
    def takes(self, approach, pull, pressed):
        """Whether a grain that meets floor or heap at a speed [m/s] stays; pull: g dt [m/s]."""
        result = False
        if ti.static(self.rests):
            result = pressed and approach < self.parameters.threshold[None] * pull
        return result

    @ti.func
    def join(self, s, cell):
        """Hold a grain from now on."""
        self.cells.across.velocity[s, cell] = 0.0
        self.hold(s, cell)

    @ti.func
    def free(self, s, cell, velocity):
        """Let a grain go with a velocity along x [m/s], if it is held."""
        if self.cells.at(s, cell) == HELD:
            self.cells.put(s, cell, UP, velocity, self.cells.offset[s])
            self.held[s] = self.held[s] - 1

    @ti.func
    def release_all(self, s, velocity):
        """Release the heap where it is, with the velocity of the container [m/s]."""
        if self.held[s] > 0:
            for k in range(self.cells.traversal.begin(), self.cells.traversal.end(s)):
                self.free(s, self.cells.traversal.cell(s, k), velocity)
