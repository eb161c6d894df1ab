"""Two ways to run the same phases: substeps in one serial kernel, or a loop a phase."""

import time
from typing import Any

import taichi as ti

from taichi_dem.kit import backend, runtime
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.ordered import tasks
from taichi_dem.state.timeline import MACRO_TICKS
from taichi_dem.step.phases import Step

#: The parallel driver is called for about this long [s] between two checks of divergence, progress
#: and Ctrl-C.
CALL_SECONDS = 0.2
#: The resident one is kept near this long [s]: its kernel cannot be interrupted.
_KERNEL_SECONDS = 0.1
_MAX_SUBSTEPS = 1 << 24
#: How a parallel substep ended, as bits: at the end or a halt; a search is requested; the device
#: has ended a loop too early; more sweeps are needed.
_HALTED, _SEARCH, _CUT_SHORT, _UNSOLVED = 1, 2, 4, 8
_ENDS = 15
#: Substeps that a GPU is given at a time.
QUEUED = 16
#: Reason why the resident driver cannot run, for a sentence.
CPU_ONLY = "runs on a CPU only"
#: Bonds from which on several threads gain more than the launches of the phases cost: two made
#: steps of 11,500 bonds 1.7 times as fast.
PARALLEL_FROM = 10_000


@ti.data_oriented
class Resident:
    """Many substeps in one serial kernel: the choice for small systems on a CPU."""

    name = "resident"

    def __init__(self, step: Step):
        self.step = step
        self._launch_steps, self._launch_search = Launch(self._steps), Launch(self._search)

    def begin(self) -> None:
        """Run the phases of the start; compiles the kernel."""
        # Calls are short first, as the cost of a step is not known yet.
        self.substeps = 4
        self.step.start(0)
        self._launch_steps(1, 0, 1)
        self.step.start(1)

    def follow(self, other: "Resident") -> None:
        """Go on in place of another one."""
        self.substeps = other.substeps

    def prepare(self) -> None:
        """Make a requested search, without a step."""
        self.few(0, 0)

    def few(self, end_tick: int, substeps: int) -> int:
        """Advance some substeps, or to a tick or the next halt; how many."""
        done = 0
        while True:
            ending = self._launch_steps(0, end_tick, substeps - done)
            if ending >= 0:
                return done + ending
            done += -1 - ending
            self._launch_search()

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, or for about _KERNEL_SECONDS."""
        start = time.perf_counter()
        done = self.few(end_tick, self.substeps)
        seconds = max(time.perf_counter() - start, 1e-5)
        if done == self.substeps:
            grown = int(done * _KERNEL_SECONDS / seconds)
            # A step of 100,000 bodies takes as long as a whole call should.
            self.substeps = max(1, min(4 * self.substeps, grown, _MAX_SUBSTEPS))

    @ti.kernel
    def _steps(self, begin: ti.i32, end_tick: ti.i64, substeps: ti.i32) -> ti.i32:
        # Returns the substeps done, or -1 less them where a search is called for. At the start the
        # phases that always run do so alone: what takes longest to compile is compiled once.
        done = 0
        low = ti.static(self.step.schedule.low)
        ti.loop_config(serialize=True)
        for s in range(substeps + 1):
            if ti.static(self.step.has_contact):
                if begin == 0 and self.step.search.is_requested() == 1:
                    done = -1 - done
                    break
            finished = self.step.state.tick[None] >= end_tick or self.step.halted() == 1
            if s == substeps or (finished and begin == 0):
                break
            for group in ti.static(self.step.groups):
                if ti.static(group.sweeps):
                    while self.step.solver.unsolved[None] == 1:
                        for members, item, _ in ti.static(group.phases):
                            for a in range(members.count(low[None])):
                                item(members.pick(a))
                else:
                    for members, item, always in ti.static(group.phases):
                        count = members.count(low[None])
                        if ti.static(not always):
                            count *= 1 - begin
                        for a in range(count):
                            item(members.pick(a))
            done = s + 1
        return done

    @ti.kernel
    def _search(self):
        # A kernel of its own, as the time to compile grows faster than a kernel.
        ti.loop_config(serialize=True)
        for _ in range(1):
            while self.step.search.is_requested() == 1:
                for members, item in ti.static(self.step.search.phases):
                    for a in range(members.count(0)):
                        item(members.pick(a))


@ti.data_oriented
class Parallel:
    """A phase a parallel loop: for large systems and for GPUs."""

    name = "parallel"
    scratch_fields = ("ended", "wanted")

    def __init__(self, step: Step):
        self.step, self.on_gpu, self.state = step, not backend.is_cpu(), 0
        self.queued = QUEUED if self.on_gpu else 1
        # As many as the steps before have needed; none is known at the start.
        self.sweeps = 0
        self.ended, self.wanted = (ti.field(ti.i32, shape=()) for _ in range(2))
        bodies = step.state.position.shape[0]
        self.tasks = tuple(tasks(group.loops(), bodies) for group in step.groups)
        self._groups = tuple(Launch(self._run, number) for number in range(len(step.groups)))

    def begin(self) -> None:
        """Run the phases of the start; compiles their kernels."""
        self.step.start(0)
        self._groups[-1](0, 0, 1)
        self.step.start(1)

    def follow(self, other: "Parallel") -> None:
        """Go on in place of another one."""
        self.sweeps = other.sweeps

    def prepare(self) -> None:
        """Make a requested search, without a step; compiles the kernels."""
        for launch in self._groups:
            launch(0, 0, 0)
        if self.step.has_contact:
            self.step.search.renew()

    def few(self, end_tick: int, substeps: int) -> None:
        """Advance some substeps, or to a tick or the next halt."""
        self.state = _HALTED
        for _ in range(substeps):
            if self._substeps(end_tick, 1):
                break

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, or for about CALL_SECONDS."""
        start, self.state, count = time.perf_counter(), _HALTED, 1
        if self.queued > 1:
            # At least as many substeps are left as largest steps: all of them do something.
            left = (end_tick - int(values(self.step.state.tick))) // MACRO_TICKS
            known = self.sweeps > 0 or len(self._groups) == 1
            count = max(1, min(left, self.queued if known else 1))
        while not self._substeps(end_tick, count):
            if time.perf_counter() - start > CALL_SECONDS:
                break
            # Those queued behind a substep that asked for a search have done nothing.
            count = max(1, count // 2) if self.state & _SEARCH else min(2 * count, self.queued)

    def _substeps(self, end_tick, count):
        """Run some substeps, or to a search that is requested; nonzero at the end or a halt."""
        if self.state:
            assign(self.ended, 0)
        for _ in range(count - 1):
            self._substep(end_tick).queue(end_tick, 1, 1)
        self._take(self._substep(end_tick)(end_tick, 1, 1))
        if self.state & _UNSOLVED:
            self._finish_sweeps(end_tick)
        if self.state & _CUT_SHORT:
            raise backend.cut_short("of this scene", "a smaller mesh")
        lacks_room = bool(self.state & _SEARCH) and not self.step.search.renew()
        return self.state & ~_SEARCH | lacks_room * _HALTED

    def _substep(self, end_tick):
        """Queue all groups of a substep but the last one, which is returned."""
        *earlier, last = self._groups
        for group, launch in zip(self.step.groups, earlier):
            if self.on_gpu:
                for _ in range(max(1, self.sweeps) if group.sweeps else 1):
                    launch.queue(end_tick, 1, 1)
            else:
                while launch(end_tick, 1, 1):
                    pass
        return last

    def _finish_sweeps(self, end_tick):
        """Go on with a substep in which more sweeps are needed than were queued."""
        assign(self.ended, 0)
        while self._groups[1](end_tick, 1, 1):
            pass
        self._take(self._groups[-1](end_tick, 1, 1))

    def _take(self, ending):
        """Take over how the last substep ended, and how many sweeps the next one may need."""
        self.state, self.sweeps = ending & _ENDS, ending // (_ENDS + 1)

    @ti.kernel
    def _run(self, number: ti.template(), end_tick: ti.i64, rest: ti.i32, first: ti.i32) -> ti.i32:
        # first, rest: 1 to run the phases that always run, and all others; 0 and 0 compile only.
        low = ti.static(self.step.schedule.low)
        for serial, phases in ti.static(self.tasks[number]):
            active, item, always = ti.static(phases[0])
            if ti.static(serial):
                ti.loop_config(serialize=True)
                for _ in range(self._share(number, False, rest, first)):
                    for members, each, _always in ti.static(phases):
                        for a in range(members.count(low[None])):
                            each(members.pick(a))
            elif ti.static(self.on_gpu):
                # The length of a loop is a task of its own there, and starts 131,072 threads.
                for a in range(ti.static(active.most)):
                    if a < self._share(number, always, rest, first) * active.count(low[None]):
                        item(active.pick(a))
                        self.step.state.check_loops(rest + first)
            else:
                count = self._share(number, always, rest, first) * active.count(low[None])
                for a in range(count):
                    item(active.pick(a))
        return self._ended(number, end_tick, rest)

    @ti.func
    def _share(self, number: ti.template(), always: ti.template(), rest, first):
        """1 where a phase is to run; a start runs those that always run without the rest."""
        share = rest
        if self.ended[None] != 0 or self._waits(number) == 1:
            share = 0
        if ti.static(always):
            share = first * (share + 1 - rest)
        return share

    @ti.func
    def _waits(self, number: ti.template()):
        """1 for sweeps once all dashpots are solved, and for what follows until they are."""
        wait = 0
        if ti.static(self.step.groups[number].sweeps):
            wait = 1 - self.step.solver.unsolved[None]
        elif ti.static(self.step.groups[number].follows):
            wait = self.step.solver.unsolved[None]
        return wait

    @ti.func
    def _ended(self, number: ti.template(), end_tick, rest):
        """Whether sweeps are repeated; of the last group how the substep ended, which it notes."""
        ending = 0
        if ti.static(self.step.groups[number].sweeps):
            ending = self.step.solver.unsolved[None]
        if ti.static(number == len(self.step.groups) - 1):
            if rest == 1 and self.ended[None] == 0:
                ending = ti.cast(self.step.state.tick[None] >= end_tick, ti.i32)
                ending |= self.step.halted()
                if ti.static(self.step.has_contact):
                    ending |= _SEARCH * self.step.search.is_requested()
                if ti.static(backend.most_rounds() > 0):
                    ending |= _CUT_SHORT * self.step.state.cut_short[None]
                if self._waits(number) == 1:
                    ending = _UNSOLVED
                self.ended[None] = ending
                # As many sweeps as this substep has made, or one fewer than were wanted before it.
                wanted = self.wanted[None] - 1
                if ti.static(self.step.solves):
                    wanted = ti.max(wanted, self.step.solver.sweeps[None])
                else:
                    wanted = ti.max(wanted, 0)
                self.wanted[None] = wanted
            ending = self.ended[None] + (_ENDS + 1) * self.wanted[None]
        return ending


#: Drivers by name.
DRIVERS: dict[str, Any] = {driver.name: driver for driver in (Resident, Parallel)}


def driver_name(name: str, bond_count: int) -> str:
    """Name of the driver for a scene of so many bonds; name: of the one asked for, or "auto"."""
    settings: Any = runtime.settings()
    if name == "auto":
        small = settings.threads == 1 or bond_count < PARALLEL_FROM
        return "resident" if settings.arch == "cpu" and small else "parallel"
    if name == "resident" and settings.arch != "cpu":
        raise InputError(f"driver 'resident' {CPU_ONLY}: use 'parallel' with arch 'cuda'")
    return name
