"""The phases of a substep in their order, those of the start of a run, and the audit of sleep.

One in 1024 of the bonds is looked at in every substep, by a hash of the number of the substep: no
result decides what is looked at, and nothing that the audit does remains.
"""

import taichi as ti

from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit import backend
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.ordered import Once, Phases, Places
from taichi_dem.kit.products import squared
from taichi_dem.step.advance import Advance
from taichi_dem.step.implicit.bonds import BOND_COLOURS
from taichi_dem.step.implicit.pairs import WIDE
from taichi_dem.step.multirate.lists import Colour
from taichi_dem.step.multirate.schedule import Schedule

#: One bond in so many is looked at; a power of two.
RATE = 1024


@ti.func
def mixed(number):
    """Bits of a counter, mixed, as an unsigned number of 32 bits (Wang's hash)."""
    x = ti.cast(number, ti.u32)
    x = (x ^ ti.u32(61)) ^ (x >> ti.u32(16))
    x *= ti.u32(9)
    x = x ^ (x >> ti.u32(4))
    x *= ti.u32(0x27D4EB2D)
    return x ^ (x >> ti.u32(15))


@ti.data_oriented
class Audit(Places):
    """List of the bonds that are looked at in a substep, and what was found.

    audited, misses: bonds asleep. One is missed where it is opened by more than the share at which
    a body wakes others, or its springs hold more than the energy at the speed that wakes them.
    """

    scratch_fields = ("first",)

    def __init__(self, schedule: Schedule):
        self.tables, self.state = schedule.tables, schedule.state
        self.schedule, self.sleeping = schedule, schedule.sleeping
        self.most = schedule.bonds.most // RATE + 1
        self.first = ti.field(ti.i32, shape=())
        self.audited, self.misses = (ti.field(ti.i64, shape=()) for _ in range(2))

    @ti.func
    def choose(self, one):
        """Choose the bonds of this substep."""
        number = mixed(self.schedule.evaluations[0])
        self.first[None] = ti.cast(number & ti.u32(RATE - 1), ti.i32)

    @ti.func
    def count(self, low):
        """Number of bonds to look at."""
        return (self.tables.bond_count[None] - self.first[None] + (RATE - 1)) // RATE

    @ti.func
    def visit(self, a):
        """Look at one bond."""
        b = self.first[None] + RATE * a
        slots = self.tables.bond_slots[b]
        i, j = slots[0] >> 2, slots[1] >> 2
        if self.state.broken_tick[b] < 0:
            if not self.sleeping.both_awake(i, j):
                ti.atomic_add(self.audited[None], 1)
                if self.sleeping.leaves_out(b, i, j):
                    ti.atomic_add(self.misses[None], 1)


@ti.data_oriented
class Step:
    """Phases of a substep, pairs of an active list and a function of a member.

    A substep begins with the contacts of the present tick, whose bonds are evaluated already, and
    ends with the bonds of the next: between substeps the contact lists can be renewed.

    search: the ``BroadPhase`` that does so, None for a scene without contact. start_phases: those
    of the start of a run before the bonds of the first tick, which the step's kernel evaluates,
    and after them. ended: bits of the parallel driver by which the last substep ended, or 0;
    wanted: sweeps that the next one may need.
    """

    scratch_fields = ("ended", "wanted")

    def __init__(self, advance: Advance, search: BroadPhase | None):
        self.advance, self.schedule, self.search = advance, advance.schedule, search
        self.has_contact = search is not None
        self.state = advance.state
        self.ended, self.wanted = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.audit = Audit(self.schedule) if self.schedule.sleeps else None
        self.parts = self._parts()
        self.phases = self._phases()
        self.start_phases = self._before_bonds(), self._after_bonds()
        self._launch_starts = tuple(Launch(self._start, last) for last in range(2))

    def _before_bonds(self):
        """First levels and full lists."""
        schedule, bodies = self.schedule, self.schedule.bodies.everyone
        phases: Phases = ()
        if schedule.has_limits:
            phases += ((bodies, schedule.limits.refresh),)
        if schedule.sleeps:
            sleeping = schedule.sleeping
            phases += (bodies, sleeping.begin), (bodies, sleeping.begin_beside)
        return (*phases, (bodies, self.first_level), *schedule.start_phases())

    def _after_bonds(self):
        """Bonds that sleep have acted once, and leave the list."""
        return self.schedule.start_end_phases()

    @ti.func
    def first_level(self, i):
        """Choose the first level of body i."""
        self.schedule.choose_level(i, squared(self.state.velocity[i]))

    def _phases(self):
        """All phases of a substep in a row, for one serial kernel."""
        return self.parts[0]

    def _parts(self):
        """The same in parts of which one may be called for again."""
        schedule = self.schedule
        touching = ((schedule.pairs, self.advance.contact),) if self.has_contact else ()
        return (
            (
                *self._retimed(),
                *touching,
                (Once(), schedule.advance_clock),
                *self._rested(),
                *self._moved(),
            ),
        )

    def _moved(self):
        """Phases of the bodies, of the bonds at the next time, and of the audit."""
        schedule, audit = self.schedule, self.audit
        audited = ((Once(), audit.choose), (audit, audit.visit)) if audit is not None else ()
        return (
            (schedule.bodies, self.advance.body),
            *schedule.reordering(),
            (schedule.bonds, self.advance.bond),
            *audited,
        )

    def _rested(self):
        """Phases that find the momentum at which bodies wake others, where some may sleep."""
        if not self.schedule.sleeps:
            return ()
        sleeping = self.schedule.sleeping
        return (sleeping, sleeping.chunk), (Once(), self.schedule.sort_woken)

    @ti.func
    def waits(self, part: ti.template()):
        """1 where a part must not run now, as the part before it is called for once more."""
        return 0

    @ti.func
    def repeats(self, part: ti.template()):
        """1 where a part is called for once more: never here."""
        return 0

    @ti.func
    def sweeps(self):
        """Sweeps of the last substep."""
        return 0

    def _retimed(self):
        """Phases that update rates and wake bodies, where the method requires it."""
        limits = self.schedule.limits
        if limits is None:
            return ()
        phases: Phases = ((limits, limits.refresh_last),)
        if self.schedule.controlled:
            phases = (limits, limits.refresh), (limits, self.advance.wake_up)
        return (*phases, *self.schedule.applying())

    def is_of_start(self, item: object) -> bool:
        """Whether a phase also belongs to the start of a run: that of the bonds does."""
        return item == self.advance.bond

    def start(self, last: int) -> None:
        """Run the phases of the start before the bonds, or the last, after them."""
        self._launch_starts[last]()

    @ti.kernel
    def _start(self, last: ti.template()):
        for members, item in ti.static(self.start_phases[last]):
            for a in range(members.count(0)):
                item(members.pick(a))
                if ti.static(backend.most_rounds() > 0):
                    self.state.check_loops(a + 1)

    @ti.func
    def halted(self):
        """1 when the host must act: a body left its bounds, or a list its room."""
        halt = ti.cast(self.state.bad_body[None] < self.advance.tables.body_count[None], ti.i32)
        if ti.static(self.has_contact):
            halt |= self.search.overflows()
        return halt


@ti.data_oriented
class SolvedStep(Step):
    """The phases of a substep in which all dashpots are solved together.

    A run begins with their first guesses.
    """

    def _before_bonds(self):
        phases: Phases = (
            *super()._before_bonds(),
            (self.schedule.bodies.everyone, self.advance.update_inertia),
        )
        if self.advance.solver.has_bonds:
            phases += ((self.schedule.bonds.everyone, self.advance.solver.bonds.first),)
        return phases

    def _after_bonds(self):
        return (*super()._after_bonds(), (self.schedule.bonds.everyone, self.undo))

    @ti.func
    def undo(self, b):
        """Book no heat of bond b, whose evaluation booked a step before the start."""
        if ti.static(self.advance.has_dashpot):
            self.state.bond_drag[b] = 0.0 * self.state.bond_drag[b]
        if ti.static(not self.advance.tables.bond.is_null):
            self.state.bond_heat[b] = 0.0 * self.state.bond_heat[b]
        if ti.static(self.schedule.sleeps and self.advance.solver.has_bonds):
            if self.schedule.bonds.key[b] < 0:
                self.advance.solver.bonds.end(b)

    def _phases(self):
        before, _, after = self.parts
        return (*before, (Once(), self.advance.solver.solve), *after)

    def _parts(self):
        advance, schedule, solver = self.advance, self.schedule, self.advance.solver
        before: Phases = ()
        after: Phases = ()
        if self.has_contact:
            before = (schedule.pairs, solver.pairs.begin), *solver.pairs.phases
            after = ((schedule.pairs, solver.pairs.book),)
        before += (Once(), schedule.advance_clock), *self._rested(), (Once(), solver.begin)
        before += ((schedule.bodies, advance.predict),)
        return (before, self._sweep(solver), (*after, *self._moved()))

    def _sweep(self, solver):
        """One sweep, colour by colour."""
        phases: Phases = ()
        if solver.has_bonds:
            first, most = solver.bonds.colour_first, solver.bonds.groups
            colours = (Colour(first, c, most) for c in range(BOND_COLOURS))
            phases += tuple((colour, solver.bonds.visit) for colour in colours)
        if self.has_contact:
            first, most = solver.pairs.colour_first, self.schedule.pairs.most
            colours = (Colour(first, c, most) for c in range(WIDE))
            phases += tuple((colour, solver.pairs.visit) for colour in colours)
            phases += ((Once(), solver.pairs.visit_last),)
        if solver.has_ground:
            phases += ((self.schedule.bodies, solver.ground.visit),)
        return (*phases, (Once(), solver.check_convergence))

    @ti.func
    def sweeps(self):
        """Sweeps of the last substep."""
        return self.advance.solver.sweeps[None]

    @ti.func
    def waits(self, part: ti.template()):
        """1 for a sweep once all dashpots are solved, and for what follows until they are."""
        unsolved, wait = self.advance.solver.unsolved[None], 0
        if ti.static(part == 1):
            wait = 1 - unsolved
        elif ti.static(part == 2):
            wait = unsolved
        return wait

    @ti.func
    def repeats(self, part: ti.template()):
        """1 where another sweep is called for."""
        again = 0
        if ti.static(part == 1):
            again = self.advance.solver.unsolved[None]
        return again
