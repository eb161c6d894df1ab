"""Transport by the rules of place: free flight, the lattice, and changes of cell."""

import taichi as ti

from ca_damper.automaton.accounting import quanta
from ca_damper.automaton.cells import OnCells
from ca_damper.automaton.conflict_resolution import rank_in_phase
from ca_damper.automaton.lattice import EMPTY, UP
from ca_damper.automaton.place.contacts import dragged, most_drag
from ca_damper.automaton.place.grains import GrainCells
from ca_damper.engine.random_numbers import HOP, bits, unit

#: Phases of a step after that of the blows, by rising rank.
_ACROSS, _ALONG = 1, 2
_NOWHERE = -1


@ti.data_oriented
class Transport(OnCells):
    """Grains keep their places in the room when the lattice steps, and fly under full gravity."""

    def __init__(self, grains: GrainCells, tilted: bool):
        super().__init__(grains)
        self.tilted, self.traversal = tilted, grains.traversal
        self.movers = self.table.field(ti.i16, "cells")
        self.targets = self.table.field(ti.i16, "cells")

    @ti.func
    def follow(self, s, step, motion):
        """Number the cells anew when the lattice steps; no grain moves in the room."""
        # A grain whose new cell is taken keeps its cell and stands farther off its centre.
        width = self.parameters.width[s]
        direction = self.cells.step_along(s, step, motion, width)
        if direction != 0:
            for column in range(self.lattice.size.columns[s]):
                for k in range(self.lattice.size.rows[s]):
                    cell = self.lattice.cell_from(s, column, k, direction)
                    if self.cells.at(s, cell) == UP:
                        travelled = self.cells.travelled[s, cell]
                        if self.cells.at(s, cell - direction) == EMPTY:
                            self.cells.relocate(s, cell, cell - direction, travelled)
                        else:
                            self.cells.travelled[s, cell] = travelled - width * direction
            self.traversal.sort(s, self.cells)
        return ti.cast(0, ti.i64)

    @ti.func
    def fly_all(self, s, motion, pull):
        """One step of all grains under way and of the container, exact for constant gravity."""
        dt, gained = self.table.dt[s], ti.cast(0, ti.i64)
        after = motion.v + motion.a * dt
        for k in range(self.traversal.begin(s), self.traversal.end(s)):
            cell = self.traversal.cell(s, k)
            if self.cells.at(s, cell) == UP:
                speed = self.cells.speed[s, cell] - pull
                if ti.static(self.tilted):
                    drag = self.fall(s, cell, speed - after)
                    speed -= drag
                    gained -= quanta(drag)
                self.cells.speed[s, cell] = speed
                self.cells.travelled[s, cell] = (
                    self.cells.travelled[s, cell] + (speed + 0.5 * pull) * dt
                )
        self.cells.offset[s] = self.cells.offset[s] + (motion.v + 0.5 * motion.a * dt) * dt
        self.cells.container[s] = after
        self.cells.closing[s] = motion.a + self.parameters.gravity[s]
        return gained

    @ti.func
    def fall(self, s, cell, slip):
        """Fall across the columns, or lie on what stands there; returns the drag of that [m/s]."""
        # A grain that lies presses on the bed that the container carries: all layers are dragged as
        # one body.
        result, sideways = 0.0, self.parameters.sideways[s]
        across, pull = self.cells.across[s, cell], ti.abs(sideways)
        direction = 1 if sideways > 0.0 else -1
        slow = across * direction >= 0.0 and across * across < 2.0 * pull * self.parameters.width[s]
        if slow and self.free_place(s, cell, direction) == _NOWHERE:
            self.cells.across[s, cell] = 0.0
            push = pull * self.table.dt[s] + ti.abs(across)
            share = self.parameters.mass[s] * self.table.recoil[s] * self.table.particles[s]
            most = ti.min(self.parameters.wall_friction[s] * push, most_drag(slip, share))
            result = dragged(slip, most)
        else:
            self.cells.across[s, cell] = across + sideways * self.table.dt[s]
        return result

    @ti.func
    def move_all(self, s, step, shared):
        """Changes of cell, first across the columns, then along them."""
        self.hop_all(s, step, shared, self.table.dt[s])
        self.climb_all(s, step, shared)

    @ti.func
    def hop_all(self, s, step, shared, dt):
        """Move grains to neighbouring columns."""
        # Equally likely anywhere in its column, a grain leaves it in a step with probability |u| dt
        # / d.
        count = 0
        for k in range(self.traversal.begin(s), self.traversal.end(s)):
            cell = self.traversal.cell(s, k)
            velocity = self.cells.across[s, cell]
            if velocity != 0.0:
                share = ti.abs(velocity) * dt / self.parameters.width[s]
                if unit(bits(shared, cell, HOP)) < share:
                    target = self.free_place(s, cell, 1 if velocity > 0.0 else -1)
                    if target != _NOWHERE:
                        ranked = rank_in_phase(step, shared, _ACROSS, cell, 0)
                        for near in range(target - 1, target + 2):
                            self.conflicts.claim(s, near, ranked)
                        count = self.note(s, count, cell, target)
        for k in range(count):
            cell, target = ti.cast(self.movers[s, k], ti.i32), ti.cast(self.targets[s, k], ti.i32)
            ranked = rank_in_phase(step, shared, _ACROSS, cell, 0)
            alone = True
            for near in range(target - 1, target + 2):
                alone = alone and self.conflicts.holds(s, near, ranked)
            if alone:
                width = self.parameters.width[s]
                centre = self.lattice.height_of(s, target) * width
                self.cells.relocate(s, cell, target, self.cells.height(s, cell) - centre)

    @ti.func
    def note(self, s, count, cell, target):
        """Note a change that is claimed; returns the number of them."""
        self.movers[s, count] = ti.cast(cell, ti.i16)
        self.targets[s, count] = ti.cast(target, ti.i16)
        return count + 1

    @ti.func
    def free_place(self, s, cell, direction):
        """Cell at a grain's height in the next column (way 1: right), if there is room."""
        width, result = self.parameters.width[s], _NOWHERE
        base = self.lattice.column_beside(s, cell, direction)
        if not self.lattice.in_side_wall(s, base):
            height = self.cells.height(s, cell)
            row = self.lattice.nearest_row(s, base, height / width)
            target = base + 1 + row
            room = self.cells.at(s, target) == EMPTY
            for near in range(target - 1, target + 2):
                if self.cells.is_grain(s, near):
                    room = room and ti.abs(self.cells.height(s, near) - height) >= width
            # Over the floor of that column, and below its ceiling.
            over = height - self.lattice.height_of(s, base + 1) * width - self.cells.offset[s]
            if room and 0.0 <= over <= (self.lattice.size.rows[s] - 1) * width:
                result = target
        return result

    @ti.func
    def climb_all(self, s, step, shared):
        """Move grains that are nearer to the next cell of their column into it."""
        count, width = 0, self.parameters.width[s]
        for k in range(self.traversal.begin(s), self.traversal.end(s)):
            cell = self.traversal.cell(s, k)
            away = self.cells.travelled[s, cell]
            # A product first: a division of every grain takes longer than the rest.
            if ti.abs(away) > 0.5 * width and ti.abs(away / width) > 0.5:
                target = cell + (1 if away > 0.0 else -1)
                if self.cells.at(s, target) == EMPTY:
                    ranked = rank_in_phase(step, shared, _ALONG, cell, 0)
                    self.conflicts.claim(s, target, ranked)
                    count = self.note(s, count, cell, target)
        for k in range(count):
            cell, target = ti.cast(self.movers[s, k], ti.i32), ti.cast(self.targets[s, k], ti.i32)
            ranked = rank_in_phase(step, shared, _ALONG, cell, 0)
            if self.conflicts.holds(s, target, ranked):
                shift = width * (target - cell)
                self.cells.relocate(s, cell, target, self.cells.travelled[s, cell] - shift)
