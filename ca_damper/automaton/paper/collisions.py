"""Collisions of particles with each other and with walls (Komatsuzaki et al., 5.3 and 5.4)."""

import taichi as ti

from ca_damper.automaton.cells import OnCells
from ca_damper.automaton.conflict_resolution import rank
from ca_damper.automaton.device import HOLDS, PAIRS, WALLS
from ca_damper.automaton.lattice import DIRECTIONS, EMPTY, WALL, mirrored, turned_back
from ca_damper.automaton.paper.transport import PaperTransport
from ca_damper.engine.random_numbers import DEFLECT, EVENT, bits, unit
from ca_damper.filling import Recoil

NOTHING, JOIN, FLOOR, SIDE, PAIR = range(5)
_CELL_BITS = 16


@ti.func
def speed_after_pair(speed, other, restitution):
    """Speed [m/s] of the particle that hits, eq. (9); ``other`` is that of the equal it meets."""
    # Signed along the direction of the particle that hits; with the two exchanged, the speed of the
    # one that is hit: their sum is conserved.
    return 0.5 * ((speed + other) - restitution * (speed - other))


@ti.func
def speed_after_wall(speed, wall, restitution):
    """Speed [m/s] of a particle that meets a wall of speed ``wall`` and great mass, eq. (10)."""
    return wall - restitution * (speed - wall)


@ti.func
def deflected(direction, draw):
    """Way back from ``direction``: straight for half of the draws in [0, 1), oblique else (5.3)."""
    back = turned_back(direction)
    if draw >= 0.75:
        back = (back + 1) % DIRECTIONS
    elif draw >= 0.5:
        back = (back + DIRECTIONS - 1) % DIRECTIONS
    return back


@ti.data_oriented
class PaperCollisions(OnCells):
    """Judge and carry out the events of a step."""

    def __init__(self, transport: PaperTransport, both: bool):
        super().__init__(transport.cells)
        self.transport, self.both = transport, both
        self.resting, self.accumulator = transport.resting, transport.accumulator
        self.accounting, self.event_counts = transport.accounting, transport.event_counts
        self.events = self.table.field(ti.i32, "cells")
        self.other = self.table.field(ti.f64, "cells")
        self.ranks = self.table.field(ti.i64, "cells")

    @ti.func
    def resolve(self, s, step, shared, motion, pull, pressed):
        """All events of a step; returns velocity along x from counted impacts [quanta]."""
        impulse = ti.cast(0, ti.i64)
        for k in range(self.find_events(s, step, shared, motion.v, pull, pressed)):
            cell, event = (
                self.events[s, k] & ((1 << _CELL_BITS) - 1),
                self.events[s, k] >> _CELL_BITS,
            )
            if self.wins(s, cell, event, self.ranks[s, k]):
                impulse += self.carry_out(s, shared, cell, event, self.other[s, k], motion.v, pull)
        return impulse

    @ti.func
    def recoil(self, s):
        """None: blows count as if the container had a great mass."""
        return Recoil(0.0, 0.0)

    @ti.func
    def strike_container(self, s, recoil):
        """All blows have been carried out."""
        return ti.cast(0, ti.i64)

    @ti.func
    def find_events(self, s, step, shared, velocity, pull, pressed):
        """Find those of the touching particles to which something happens; returns their number."""
        events = 0
        for k in range(self.transport.touching_count[s]):
            cell = self.transport.touching[s, k]
            event, other = self.find_event(s, cell, velocity, pull, pressed)
            if event != NOTHING:
                self.events[s, events] = cell | (event << _CELL_BITS)
                self.other[s, events] = other
                ranked = rank(step, shared, cell, EVENT)
                self.ranks[s, events] = ranked
                self.claim(s, cell, event, ranked)
                events += 1
        return events

    @ti.func
    def find_event(self, s, cell, velocity, pull, pressed):
        """Event of a particle, and the speed of its obstacle."""
        kind = self.cells.at(s, cell)
        ahead = self.lattice.cell_ahead(s, cell, kind)
        met = self.cells.at(s, ahead)
        event, other = PAIR, self.cells.speed[s, ahead] * self.lattice.cosine[met, kind]
        if met >= WALL:
            event, other = FLOOR, velocity * self.lattice.upward(kind)
            if met == WALL and self.lattice.in_side_wall(s, ahead):
                event, other = SIDE, 0.0
        if self.cells.speed[s, cell] <= other or met == EMPTY:
            event = NOTHING
        if self.resting.caught(s, cell, velocity):
            event, other = FLOOR, velocity
        if self.resting.joins(s, cell, velocity, pull, pressed):
            event = JOIN
        return event, other

    @ti.func
    def claim(self, s, cell, event, ranked):
        """Claim the particles that an event changes."""
        if ti.static(self.both):
            self.conflicts.claim(s, cell, ranked)
            if event == PAIR:
                self.conflicts.claim(
                    s, self.lattice.cell_ahead(s, cell, self.cells.at(s, cell)), ranked
                )

    @ti.func
    def wins(self, s, cell, event, ranked):
        """Whether the event takes place; where each particle updates itself only, it does."""
        result = True
        if ti.static(self.both):
            result = self.conflicts.holds(s, cell, ranked)
            if event == PAIR and result:
                ahead = self.lattice.cell_ahead(s, cell, self.cells.at(s, cell))
                result = self.conflicts.holds(s, ahead, ranked)
        return result

    @ti.func
    def carry_out(self, s, shared, cell, event, other, velocity, pull):
        """Carry out an event; returns the counted gain of velocity along x [quanta]."""
        before = self.cells.vertical_speed(s, cell)
        impulse = ti.cast(0, ti.i64)
        if event == PAIR:
            self.event_counts.note(s, PAIRS)
            impulse = self.accounting.lattice_impulse(self.collide(s, shared, cell, other))
        elif event == JOIN:
            # The container carries the particle over this whole step, its weight with it.
            self.event_counts.note(s, HOLDS)
            impulse = self.accounting.wall_impulse(s, cell, velocity - before - pull)
            self.resting.hold(s, cell)
        else:
            self.event_counts.note(s, WALLS)
            self.rebound(s, cell, event, other)
            gain = self.cells.vertical_speed(s, cell) - before
            impulse = self.accounting.wall_impulse(s, cell, gain)
        return impulse

    @ti.func
    def rebound(self, s, cell, event, wall):
        """Meet a wall or the heap: side walls mirror, all else sends straight back (5.4)."""
        kind = self.cells.at(s, cell)
        speed = speed_after_wall(self.cells.speed[s, cell], wall, self.parameters.wall[s])
        back = turned_back(kind)
        if event == SIDE:
            back = mirrored(kind)
        after = back if speed < 0.0 else kind
        # Side walls do not move; the place of the others is that of the floor.
        place = 0.0 if event == SIDE else self.cells.offset[s]
        travelled = self.accumulator.after_wall(self.cells.travelled[s, cell], kind, after, place)
        self.cells.put(s, cell, after, abs(speed), travelled)

    @ti.func
    def collide(self, s, shared, cell, other):
        """Collide two particles along the line from ``cell`` to the one ahead (eq. 9)."""
        line = self.cells.at(s, cell)
        speed = self.cells.speed[s, cell]
        restitution = self.parameters.particle[s]
        ahead = self.lattice.cell_ahead(s, cell, line)
        before = self.cells.vertical_speed(s, cell) + self.cells.vertical_speed(s, ahead)
        self.go_on(s, shared, cell, line, speed_after_pair(speed, other, restitution))
        if ti.static(self.both):
            self.go_on(s, shared, ahead, line, speed_after_pair(other, speed, restitution))
        after = self.cells.vertical_speed(s, cell) + self.cells.vertical_speed(s, ahead)
        return after - before

    @ti.func
    def go_on(self, s, shared, cell, line, speed):
        """Set a particle's speed along a line; one that came along it is deflected if sent back."""
        # One that came from aside leaves along the line, which keeps the momentum in it.
        kind = self.cells.at(s, cell)
        after = line if speed >= 0.0 else turned_back(line)
        if turned_back(after) == kind:
            after = deflected(kind, unit(bits(shared, cell, DEFLECT)))
        travelled = self.accumulator.turned(self.cells.travelled[s, cell], kind, after)
        self.cells.put(s, cell, after, abs(speed), travelled)
