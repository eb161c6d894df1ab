"""What a step consists of: phases, each a list of members and what is done with each of them."""

from enum import Enum, auto
from typing import Any, NamedTuple

import taichi as ti

from taichi_dem.contact.search import BroadPhase
from taichi_dem.kit import backend
from taichi_dem.kit.launch import Launch
from taichi_dem.kit.products import squared
from taichi_dem.step.body import BodyLoads, BodyStep
from taichi_dem.step.bond import BondForces
from taichi_dem.step.multirate.schedule import Schedule


class When(Enum):
    """When a phase runs. A start ends with the phases ALWAYS, then STARTED."""

    START = auto()
    STEP = auto()
    SWEEP = auto()
    ALWAYS = auto()
    STARTED = auto()


START, STEP, SWEEP, ALWAYS, STARTED = When


class Absent:
    """Stands for a part that a scene lacks: phases that name it are left out."""

    def __getattr__(self, name: str) -> "Absent":
        return self


ABSENT: Any = Absent()


def given(present: bool, part: object) -> Any:
    """A part where it is present, else ABSENT."""
    return part if present else ABSENT


class Phase(NamedTuple):
    """A list of members, what is done with each, and whether a start runs it too."""

    members: Any
    item: Any
    always: bool


class Group(NamedTuple):
    """Phases in a row. sweeps: they are repeated until solved; follows: they wait until then."""

    phases: tuple[Phase, ...]
    sweeps: bool = False
    follows: bool = False

    def loops(self) -> tuple[Phase, ...]:
        """A phase for each loop of a parallel driver."""
        each = ((phase, phase.members.loops(phase.item)) for phase in self.phases)
        return tuple(Phase(*loop, phase.always) for phase, loops in each for loop in loops)


def of_time(rows: tuple, *times: When) -> tuple[Phase, ...]:
    """The present phases of some times; a row is (when, members, item) or (when, phases)."""
    chosen: list[Phase] = []
    for when, *rest in rows:
        if when in times and not any(part is ABSENT for part in rest):
            phases = rest[0] if len(rest) == 1 else (rest,)
            chosen += (Phase(*phase, when is ALWAYS) for phase in phases)
    return tuple(chosen)


def groups_of(rows: tuple) -> tuple[Group, ...]:
    """Groups of the phases of a step: all, or those before, in and after its sweeps."""
    swept = [place for place, (when, *_) in enumerate(rows) if when is SWEEP]
    if not swept:
        return (Group(of_time(rows, STEP, ALWAYS)),)
    before, after = rows[: swept[0]], rows[swept[-1] + 1 :]
    sweep = Group(of_time(rows, SWEEP), sweeps=True)
    return Group(of_time(before, STEP)), sweep, Group(of_time(after, STEP, ALWAYS), follows=True)


@ti.data_oriented
class Step:
    """Base of steps: what drivers ask of one.

    search: the ``BroadPhase`` that renews contact lists between substeps, None without contact.
    solver: what its sweeps solve, None for a step without any; solves: whether there is one.
    staggered: whether velocities are half a step behind positions, as the leapfrog's are.
    """

    solver: Any = None
    solves = False
    staggered = True

    def __init__(self, schedule: Schedule, search: BroadPhase | None):
        self.schedule, self.search = schedule, search
        self.tables, self.state = schedule.tables, schedule.state
        self.has_contact = search is not None
        self.motion, self.loads = BodyStep(schedule), BodyLoads(schedule)
        self.bonds = BondForces(schedule)

    def phases(self) -> tuple:
        """The phases in order, rows (when, members, item)."""
        raise NotImplementedError

    def arrange(self) -> None:
        """Sort the phases by when they run."""
        rows = self.phases()
        self.groups = groups_of(rows)
        self.of_start = of_time(rows, START), of_time(rows, STARTED)
        self._launch_starts = tuple(Launch(self._start, last) for last in range(2))

    def start(self, last: int) -> None:
        """Run the phases of the start before those that always run, or the last, after them."""
        if self.of_start[last]:
            self._launch_starts[last]()

    @ti.kernel
    def _start(self, last: ti.template()):
        for members, item, _ in ti.static(self.of_start[last]):
            for a in range(members.count(0)):
                item(members.pick(a))
                if ti.static(backend.most_rounds() > 0):
                    self.state.check_loops(a + 1)

    @ti.func
    def first_level(self, i):
        """Choose the first level of body i."""
        self.schedule.choose_level(i, squared(self.state.velocity[i]))

    @ti.func
    def halted(self):
        """1 when the host must act: a body left its bounds, or a list its room."""
        halt = ti.cast(self.state.bad_body[None] < self.tables.body_count[None], ti.i32)
        if ti.static(self.has_contact):
            halt |= self.search.overflows()
        return halt
