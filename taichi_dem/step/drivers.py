"""Two ways to run the same phases: many substeps in one serial kernel, or a parallel loop a phase.

Both read one tuple of phases, so that the order of a step is written once. They give the same bits:
every item writes its own slots, and every sum has a fixed order.
"""

import time
from typing import Optional

import taichi as ti

from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit.allocation import values
from taichi_dem.step.advance import Advance
from taichi_dem.step.audit import Audit
from taichi_dem.step.begin import Begin, Phases, SolvedBegin
from taichi_dem.step.implicit.bonds import BOND_COLOURS
from taichi_dem.step.implicit.pairs import COLOURS
from taichi_dem.step.multirate.lists import Colour, Once
from taichi_dem.step.multirate.schedule import Schedule
from taichi_dem.step.multirate.wake_up import Chunks

#: The parallel driver is called for about this long [s] between two checks of divergence, progress
#: and Ctrl-C.
CALL_SECONDS = 0.2
#: The resident one is kept near this long [s]: its kernel cannot be interrupted.
_KERNEL_SECONDS = 0.1
_MAX_SUBSTEPS = 1 << 24
#: Bit that a parallel substep sets in its result when a search is requested.
_SEARCH = 2


@ti.data_oriented
class Step:
    """Phases of a substep, pairs of an active list and a function of a member.

    A substep begins with the contacts of the present tick, whose bonds are evaluated already, and
    ends with the bonds of the next: between substeps the contact lists can be renewed.

    search: the ``BroadPhase`` that does so, None for a scene without contact. start_phases: those
    of the start of a run before its bonds, and after them.
    """

    begin: type[Begin] = Begin

    def __init__(self, advance: Advance, schedule: Schedule, search: Optional[BroadPhase]):
        self.advance, self.schedule, self.search = advance, schedule, search
        self.has_contact = search is not None
        self.state = advance.state
        self.audit = Audit(advance) if schedule.sleeps else None
        self.parts = self._parts()
        self.phases = self._phases()
        begin = self.begin(advance)
        self.start_phases = begin.before(), begin.after()

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
            (Once(), schedule.reorder),
            (schedule.bonds, self.advance.bond),
            *audited,
        )

    def _rested(self):
        """Phases that find the momentum at which bodies wake others, where some may sleep."""
        if not self.schedule.sleeps:
            return ()
        chunks = Chunks(self.schedule)
        return (chunks, self.schedule.sleeping.chunk), (Once(), chunks.end)

    def repeats(self, part: int) -> bool:
        """Whether a part of the phases is called for once more: never here."""
        return False

    def _retimed(self):
        """Phases that update rates and wake bodies, where the method requires it."""
        limits = self.schedule.limits
        if limits is None:
            return ()
        phases: Phases = ((limits, limits.refresh),)
        if self.schedule.controlled:
            phases += ((limits, self.advance.wake_up),)
        return (*phases, (Once(), self.schedule.apply_changes))

    def is_of_start(self, item: object) -> bool:
        """Whether a phase also belongs to the start of a run: that of the bonds does."""
        return item == self.advance.bond

    @ti.kernel
    def start(self, last: ti.template()):
        """Run the phases of the start before the bonds, or the last, after them."""
        for members, item in ti.static(self.start_phases[last]):
            for a in range(members.count(0)):
                item(members.pick(a))

    @ti.func
    def halted(self):
        """1 when the host must act: a body left its bounds, or a list its room."""
        halt = ti.cast(self.state.bad_body[None] < self.advance.tables.body_count[None], ti.i32)
        if ti.static(self.has_contact):
            halt |= self.search.overflows()
        return halt


@ti.data_oriented
class SolvedStep(Step):
    """The phases of a substep in which all dashpots are solved together."""

    begin = SolvedBegin

    def _phases(self):
        before, _, after = self.parts
        return (*before, (Once(), self.advance.solver.solve), *after)

    def _parts(self):
        advance, schedule, solver = self.advance, self.schedule, self.advance.solver
        before: Phases = ()
        after: Phases = ()
        if self.has_contact:
            before = (schedule.pairs, solver.pairs.begin), (Once(), solver.pairs.sort)
            after = ((schedule.pairs, solver.pairs.book),)
        before += (Once(), schedule.advance_clock), *self._rested(), (Once(), solver.begin)
        before += ((schedule.bodies, advance.predict),)
        return (before, self._sweep(solver), (*after, *self._moved()))

    def _sweep(self, solver):
        """One sweep, colour by colour."""
        phases: Phases = ()
        if solver.has_bonds:
            first = solver.bonds.colour_first
            phases += tuple((Colour(first, c), solver.bonds_of) for c in range(BOND_COLOURS))
        if self.has_contact:
            first = solver.pairs.colour_first
            phases += tuple((Colour(first, c), solver.pair) for c in range(COLOURS))
            phases += ((Once(), solver.last_pairs),)
        if solver.has_ground:
            phases += ((self.schedule.bodies, solver.joined),)
        return (*phases, (Once(), solver.check_convergence))

    def repeats(self, part: int) -> bool:
        """Whether a part, the sweep, is called for once more."""
        return part == 1 and values(self.advance.solver.unsolved) == 1


class Driver:
    """One way to run the phases of a ``Step``; all ways give the same bits."""

    name: str

    def __init__(self, step: Step):
        self.step = step
        self.load()

    def load(self) -> None:
        """Begin with another scene."""

    def begin(self) -> None:
        """Run the phases of the start; compiles their kernels."""

    def prepare(self) -> None:
        """Make a requested search, without a step; compiles the kernels."""

    def few(self, end_tick: int, substeps: int) -> None:
        """Advance some substeps, or to a tick or the next halt."""

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, or for about the time of a call."""


@ti.data_oriented
class Resident(Driver):
    """Many substeps in one serial kernel: the choice for small systems on a CPU."""

    name = "resident"

    def load(self) -> None:
        """Begin with short calls, as the cost of a step is not known yet."""
        self.substeps = 4

    def begin(self) -> None:
        """Run the phases of the start; compiles the kernel."""
        self.step.start(0)
        self._run(1, 0, 1)
        self.step.start(1)

    def prepare(self) -> None:
        """Make a requested search, without a step."""
        self._run(0, 0, 0)

    def few(self, end_tick: int, substeps: int) -> None:
        """Advance some substeps, or to a tick or the next halt."""
        self._run(0, end_tick, substeps)

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, or for about _KERNEL_SECONDS."""
        start = time.perf_counter()
        done = self._run(0, end_tick, self.substeps)
        seconds = max(time.perf_counter() - start, 1e-5)
        if done == self.substeps:
            grown = int(done * _KERNEL_SECONDS / seconds)
            # A step of 100,000 bodies takes as long as a whole call should.
            self.substeps = max(1, min(4 * self.substeps, grown, _MAX_SUBSTEPS))

    @ti.kernel
    def _run(self, begin: ti.i32, end_tick: ti.i64, substeps: ti.i32) -> ti.i32:
        # At the start the bonds act alone: what takes longest to compile is compiled once.
        done = 0
        low = ti.static(self.step.schedule.low)
        ti.loop_config(serialize=True)
        for s in range(substeps + 1):
            if ti.static(self.step.has_contact):
                while begin == 0 and self.step.search.is_requested() == 1:
                    for count, item in ti.static(self.step.search.phases):
                        for a in range(count()):
                            item(a)
            finished = self.step.state.tick[None] >= end_tick or self.step.halted() == 1
            if s == substeps or (finished and begin == 0):
                break
            for members, item in ti.static(self.step.phases):
                count = members.count(low[None])
                if ti.static(not self.step.is_of_start(item)):
                    count *= 1 - begin
                for a in range(count):
                    item(members.pick(a))
            done = s + 1
        return done


@ti.data_oriented
class Parallel(Driver):
    """One substep a kernel, every phase a parallel loop: for large systems and for GPUs."""

    name = "parallel"

    def begin(self) -> None:
        """Run the phases of the start; compiles their kernels."""
        self.step.start(0)
        self._run(len(self.step.parts) - 1, 0, 0, 1)
        self.step.start(1)

    def prepare(self) -> None:
        """Make a requested search, without a step; compiles the kernels."""
        for part in range(len(self.step.parts)):
            self._run(part, 0, 0, 0)
        if self.step.has_contact:
            self.step.search.renew()

    def few(self, end_tick: int, substeps: int) -> None:
        """Advance some substeps, or to a tick or the next halt."""
        for _ in range(substeps):
            if self._substep(end_tick):
                break

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, or for about CALL_SECONDS."""
        start = time.perf_counter()
        while self._substep(end_tick) == 0 and time.perf_counter() - start < CALL_SECONDS:
            pass

    def _substep(self, end_tick):
        """Run all parts of a substep, and a requested search; nonzero at the end or a halt."""
        state = 0
        for part in range(len(self.step.parts)):
            state = self._run(part, end_tick, 1, 1)
            while self.step.repeats(part):
                state = self._run(part, end_tick, 1, 1)
        if state & _SEARCH:
            self.step.search.renew()
        return state & ~_SEARCH

    @ti.kernel
    def _run(self, part: ti.template(), end_tick: ti.i64, rest: ti.i32, bonds: ti.i32) -> ti.i32:
        # bonds, rest: 1 to run the phase of the bonds, and all others; 0 and 0 compile the kernel.
        low = ti.static(self.step.schedule.low)
        for active, item in ti.static(self.step.parts[part]):
            share = rest
            if ti.static(self.step.is_of_start(item)):
                share = bonds
            for a in range(share * active.count(low[None])):
                item(active.pick(a))
        finished = ti.cast(self.step.state.tick[None] >= end_tick, ti.i32)
        finished |= self.step.halted()
        if ti.static(self.step.has_contact):
            finished |= _SEARCH * self.step.search.is_requested()
        return finished


#: Drivers by name.
DRIVERS: dict[str, type[Driver]] = {driver.name: driver for driver in (Resident, Parallel)}
