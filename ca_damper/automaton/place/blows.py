"""Impacts of a step: first of grains on grains, then all impacts on the container together."""

import taichi as ti

from ca_damper.automaton.accounting import QUANTUM, quanta
from ca_damper.automaton.cells import OnCells
from ca_damper.automaton.device import HOLDS, PAIRS, WALLS
from ca_damper.automaton.place.contacts import (
    BRUSH,
    END,
    JOIN,
    LINE,
    OBLIQUE,
    GrainContacts,
    chord,
    common_velocity,
    dragged,
    line_of_centres,
    most_drag,
    speed_change,
)
from ca_damper.engine.random_numbers import LINE as LINE_DRAW
from ca_damper.engine.random_numbers import bits, unit
from ca_damper.engine.recorder import EventCounts
from ca_damper.filling import Blows, Recoil


@ti.data_oriented
class Collisions(OnCells):
    """Carry out the collisions of a step; no two of them change the same grain."""

    def __init__(self, contacts: GrainContacts, event_counts: EventCounts, tilted: bool):
        super().__init__(contacts.cells)
        self.contacts, self.resting = contacts, contacts.resting
        self.event_counts, self.tilted = event_counts, tilted
        self.count, self.ends = self.table.field(ti.i32), self.table.field(ti.i32)
        self.approaches = self.table.field(ti.i64)

    @ti.func
    def resolve(self, s, step, shared, motion, pull, pressed):
        """Carry out all but the blows on the container, and note those."""
        count, carried = self.contacts.find_all(s, step, shared, pull, pressed), motion.v - pull
        impulse, kept = ti.cast(0, ti.i64), 0
        for k in range(count):
            if self.contacts.wins(s, k):
                cell, other, kind = self.contacts.read(s, k)
                if kind == END or kind == BRUSH:
                    # Not before all grains that join or leave the heap have done so.
                    self.contacts.write(s, kept, cell, other, kind)
                    kept += 1
                elif kind == JOIN:
                    self.event_counts.note(s, HOLDS)
                    impulse += quanta(carried - self.cells.speed[s, cell])
                    self.resting.join(s, cell)
                else:
                    self.event_counts.note(s, PAIRS)
                    self.meet(s, shared, cell, other, kind, carried)
        self.note_blows(s, kept)
        return impulse

    @ti.func
    def meet(self, s, shared, cell, other, kind, carried):
        """Blow of two grains, of which one may have rested."""
        line = ti.Vector([0.0, 1.0])
        if kind == OBLIQUE:
            width = self.parameters.width[s]
            rise = (self.cells.height(s, other) - self.cells.height(s, cell)) / width
            line = ti.Vector([chord(rise), rise])
        else:
            line = line_of_centres(unit(bits(shared, cell, LINE_DRAW)))
            if ti.static(self.tilted):
                # Grains of a bed lie on one wall, and meet head on.
                if self.cells.across[s, cell] == 0.0 and self.cells.across[s, other] == 0.0:
                    line = ti.Vector([0.0, 1.0])
        self.resting.free(s, cell, carried)
        self.resting.free(s, other, carried)
        relative = self.cells.velocity(s, cell) - self.cells.velocity(s, other)
        change = self.change(s, relative, line)
        if kind == LINE:
            # They cannot pass each other within their column: what is left of the approach is lost.
            change[1] = ti.min(change[1], -0.5 * relative[1])
            self.part(s, cell, other)
        self.cells.accelerate(s, cell, change)
        self.cells.accelerate(s, other, -change)

    @ti.func
    def change(self, s, relative, line):
        """Change of velocity [m/s] of the first of two grains; the second has the opposite."""
        return speed_change(
            relative, line, self.parameters.particle[s], self.parameters.friction[s]
        )

    @ti.func
    def note_blows(self, s, count):
        """Note the blows on the container, the first events of those found."""
        ends, approaches = 0, ti.cast(0, ti.i64)
        for k in range(count):
            cell, _, kind = self.contacts.read(s, k)
            self.event_counts.note(s, WALLS)
            if kind == END:
                ends += 1
                approaches += quanta(self.approach(s, cell))
        self.count[s], self.ends[s], self.approaches[s] = count, ends, approaches

    @ti.func
    def blows(self, s):
        """Blows on the container."""
        mass, sides = self.parameters.mass[s], self.count[s] - self.ends[s]
        approaches = QUANTUM * ti.cast(self.approaches[s], ti.f64)
        impulse = mass * (1.0 + self.parameters.wall[s]) * approaches
        return Blows(impulse, mass * self.ends[s], mass * sides, mass * self.resting.held[s])

    @ti.func
    def recoil(self, s):
        """Recoil of a container on its own."""
        recoil = self.parameters.mass[s] * self.table.recoil[s]
        recoil = recoil / (1.0 + recoil * self.resting.held[s])
        total, share = QUANTUM * ti.cast(self.approaches[s], ti.f64), self.parameters.wall[s]
        after = common_velocity(self.cells.container[s], total, self.ends[s], recoil, share)
        return Recoil(after, (self.count[s] - self.ends[s]) * recoil)

    @ti.func
    def strike_container(self, s, recoil):
        """Carry out the blows on the container; returns the velocity that it gave [quanta]."""
        gained = ti.cast(0, ti.i64)
        for k in range(self.count[s]):
            cell, _, kind = self.contacts.read(s, k)
            if kind == END:
                gained += self.rebound(s, cell, recoil.velocity)
            else:
                gained += self.brush(s, cell, recoil)
        return gained

    @ti.func
    def since(self, s, cell):
        """Time [s] between a blow on floor, heap or ceiling and the end of the step."""
        # Zero if the grain is farther beyond the wall than it can have gone in a step.
        approach = self.cells.speed[s, cell] - self.cells.container[s]
        beyond = self.cells.travelled[s, cell] - self.cells.offset[s]
        result = 0.0
        if beyond * approach > 0.0 and ti.abs(beyond) <= ti.abs(approach) * self.table.dt[s]:
            result = beyond / approach
        return result

    @ti.func
    def approach(self, s, cell):
        """Velocity of a grain seen from the container at the time of the blow [m/s]."""
        later = self.cells.speed[s, cell] - self.cells.container[s]
        gap = later + self.cells.closing[s] * self.since(s, cell)
        # A grain that only just reaches the wall does not part from it backwards.
        return gap if gap * later > 0.0 else 0.0

    @ti.func
    def rebound(self, s, cell, after):
        """Leave floor or ceiling; after: velocity of the container after all blows [m/s]."""
        # The grain has been on its way back since the blow, and its place accounts for that.
        approach, since = self.approach(s, cell), self.since(s, cell)
        share = self.parameters.wall[s]
        gain = after - self.cells.container[s] - (1.0 + share) * approach
        friction = self.parameters.wall_friction[s] * ti.abs(gain)
        self.cells.accelerate(
            s, cell, ti.Vector([-dragged(self.cells.across[s, cell], friction), gain])
        )
        back = share * approach + 0.5 * self.cells.closing[s] * since
        self.cells.travelled[s, cell] = self.cells.offset[s] - back * since
        return quanta(gain)

    @ti.func
    def part(self, s, lower, upper):
        """Put two grains of a column that have met a diameter apart; their centre of mass stays."""
        push = 0.5 * ti.max(0.0, self.cells.overlap(s, lower))
        self.cells.travelled[s, lower] = self.cells.travelled[s, lower] - push
        self.cells.travelled[s, upper] = self.cells.travelled[s, upper] + push

    @ti.func
    def brush(self, s, cell, recoil):
        """Leave a side wall, which drags the grain towards the velocity of the container."""
        velocity = self.cells.across[s, cell]
        slip = self.cells.speed[s, cell] - recoil.velocity
        push = (1.0 + self.parameters.wall[s]) * velocity
        most = ti.min(
            self.parameters.wall_friction[s] * ti.abs(push), most_drag(slip, recoil.share)
        )
        gain = -dragged(slip, most)
        self.cells.accelerate(s, cell, ti.Vector([-push, gain]))
        return quanta(gain)
