"""Transport: free flight and the change of cell (Komatsuzaki et al., 5.2)."""

from typing import Any

import taichi as ti

from ca_damper.automaton.conflict_resolution import rank
from ca_damper.automaton.lattice import DOWN, EMPTY
from ca_damper.engine.random_numbers import MOVE
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class Transport:
    """Free flight: speeds, distances, and particles that meet an obstacle or may change cells.

    crossing: cells of particles that may change their cell, shape (scenes, cells).
    """

    def __init__(self, table: SceneFields, components: Any):
        self.cells, self.lattice = components.cells, components.lattice
        self.conflict_resolution = components.conflict_resolution
        self.accumulator, self.resting = components.accumulator, components.resting
        self.accounting, self.parameters = components.accounting, components.parameters
        self.crossing = table.field(ti.i16, "cells")

    @ti.func
    def fly_all(self, s, dt, pull, contacts: ti.template()):
        """One step of all particles.

        Returns the numbers of particles that touch something, may move on, and fly obliquely.
        """
        contact_count, crossing_count, oblique = 0, 0, 0
        for k in range(self.cells.traversal.begin(), self.cells.traversal.end(s)):
            cell = self.cells.traversal.cell(s, k)
            touches, free, upward = self.fly(s, cell, dt, pull)
            if touches:
                contacts[s, contact_count] = cell
                contact_count += 1
            if free:
                self.crossing[s, crossing_count] = ti.cast(cell, ti.i16)
                crossing_count += 1
            if ti.static(self.accounting.needs_lattice_impulse):
                if upward * upward == 0.25:
                    oblique += 1
        return contact_count, crossing_count, oblique

    @ti.func
    def fly(self, s, cell, dt, pull):
        """Advance the content of a cell by a step.

        Gravity acts by its projection. A particle that has risen as far as it can turns straight
        down. Empty cells and walls go the same way: their speed and their pull are zero.
        Returns whether it touches something, whether it may move on, and the vertical part of the
        direction in which gravity found it.
        """
        kind = self.cells.at(s, cell)
        upward = self.lattice.upward(kind)
        speed = self.cells.speed[s, cell] - pull * upward
        travelled = self.cells.travelled[s, cell]
        if speed < 0.0:
            # Of an oblique flight only the vertical part is left: momentum along x is kept.
            speed = -speed * upward
            travelled = self.accumulator.turned(travelled, kind, DOWN)
            kind = DOWN
            self.cells.kind[s, cell] = ti.cast(DOWN, ti.i8)
        travelled += speed * dt
        due = travelled >= self.parameters.width[None]
        blocked = self.cells.at(s, self.lattice.cell_ahead(cell, kind)) != EMPTY
        if blocked and due:
            # No particle gets deeper into another than where the next step frees it.
            travelled = self.parameters.width[None]
        self.cells.speed[s, cell] = speed
        self.cells.travelled[s, cell] = travelled
        touches = blocked or self.resting.noticed(s, cell, kind)
        return touches, due and not blocked, upward

    @ti.func
    def move_all(self, s, step, shared, crossing_count):
        """Move particles to their new cells, one claimant for each cell."""
        claimants = 0
        for k in range(crossing_count):
            cell = ti.cast(self.crossing[s, k], ti.i32)
            # A collision may have turned it since.
            if self.cells.travelled[s, cell] >= self.parameters.width[None]:
                target = self.lattice.cell_ahead(cell, self.cells.at(s, cell))
                if self.cells.at(s, target) == EMPTY:
                    self.conflict_resolution.claim(s, target, rank(step, shared, cell, MOVE))
                    self.crossing[s, claimants] = ti.cast(cell, ti.i16)
                    claimants += 1
        for k in range(claimants):
            cell = ti.cast(self.crossing[s, k], ti.i32)
            target = self.lattice.cell_ahead(cell, self.cells.at(s, cell))
            if self.conflict_resolution.holds(s, target, rank(step, shared, cell, MOVE)):
                left = self.cells.travelled[s, cell] - self.parameters.width[None]
                self.cells.relocate(s, cell, target, left)
                self.accounting.arrive(s, target)
