"""The step of a coupled scene, and the loop over all scenes: one thread a scene or group."""

import math

import numpy as np
import taichi as ti

from ca_damper.engine.container import Container
from ca_damper.filling import Action, Motion
from ca_damper.report import measures
from ca_damper.scenes.clock import CycleClock
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import assign

#: Status of a scene whose container has no finite motion any more, and of one whose loops the
#: device has ended too early (``backend``); fillings use codes above zero.
LOST, CUT_SHORT = -1, -2
# Beyond any motion that means something: squared [m^2] + [m^2/s^2].
_FAR = 1e12
_CHECK_EVERY = 64
SUM_COUNT = len(measures.SUMS)
#: Largest and smallest displacement [m] of a cycle that has not begun.
_NO_EXTREMES = [-math.inf, math.inf]
# A parallel loop on a CPU gives each thread at least this many iterations, so there a scene takes
# that many and uses one. On a GPU every iteration has a thread of its own.
_CPU_BLOCK = 512

_F64 = ti.types.ndarray(dtype=ti.f64, ndim=2)


@ti.data_oriented
class MomentumAccount:
    """Expected momentum of the fillings: the initial one, less that given away."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.expected, self.late, self.exchanged = (table.field(ti.f64) for _ in range(3))

    @ti.func
    def begin(self, s, momentum, late):
        """Start the account after the first step, from the present momentum of the filling."""
        self.expected[s], self.late[s], self.exchanged[s] = momentum + late, late, 0.0

    @ti.func
    def add(self, s, force, late):
        """Book a step with a mean force [N] on the container."""
        dt = self.table.dt[s]
        self.expected[s] = (
            self.expected[s] - (force + self.table.particles[s] * self.table.weight[s]) * dt
        )
        self.exchanged[s] = self.exchanged[s] + ti.abs(force) * dt
        self.late[s] = late

    def error(self, momentum: np.ndarray) -> float:
        """Error of momentum relative to the momentum exchanged, of the worst scene."""
        late, expected, exchanged = map(
            self.table.in_use, (self.late, self.expected, self.exchanged)
        )
        missing = np.abs(momentum + late - expected)
        share = missing / np.where(exchanged > 0.0, exchanged, np.inf)
        return float(np.fmax.reduce(share))


@ti.data_oriented
class Coupling:
    """Fillings, container and clock of all scenes, tied together."""

    def __init__(
        self,
        table: SceneFields,
        clock: CycleClock,
        container: Container,
        device: object,
        account: MomentumAccount,
        recorder: object,
    ):
        self.table, self.clock, self.container, self.device = table, clock, container, device
        self.account, self.recorder = account, recorder
        self.padding = _CPU_BLOCK if backend.is_cpu() else 1
        for name in ("order", "step", "begin", "goal", "measure_from", "cycle", "status"):
            setattr(self, name, table.field(ti.i32))
        self.attempts, self.force = table.field(ti.i64), table.field(ti.f64)
        self.sums, self.extremes = table.vector(SUM_COUNT, ti.f64), table.vector(2, ti.f64)
        self.record = table.field(ti.f64, "cycles", len(measures.COLUMNS))
        self.before = table.vector(3, ti.f64)
        # Boxes on one structure resolve their impacts together.
        self.wait = container.is_group and hasattr(device, "find_blows")

    @ti.kernel
    def start(self, initial: _F64):
        """Begin at step 0: particles at their start, the container at initial[s] = (x, v)."""
        for t in range(self.padding * self.table.scenes[None]):
            if t % self.padding == 0:
                first = t // self.padding
                if first == self.container.first(first):
                    for s in range(first, first + self.container.scenes()):
                        self._start_container(s, initial[s, 0], initial[s, 1])
                    self.container.complete_start(first)
                    for s in range(first, first + self.container.scenes()):
                        self._start_filling(s)

    @ti.func
    def _start_container(self, s, x, v):
        self.step[s], self.attempts[s], self.force[s] = 0, 0, 0.0
        self.clock.start(s)
        self.container.start(s, x, v)

    @ti.func
    def _start_filling(self, s):
        self.table.recoil[s] = self.container.recoil(s)
        self.device.reset(s)
        self.status[s] = self.device.divergence_code(s)

    @ti.kernel
    def renew(self):
        """Note that the base changed its motion, at the end of a cycle."""
        for s in range(self.table.scenes[None]):
            self.container.renew(s)

    def aim(self, plan: np.ndarray) -> None:
        """Set from plan[:, s]: step to begin at, to end at, to measure from; and the k-th scene."""
        count = plan.shape[1]
        for field, row in zip((self.begin, self.goal, self.measure_from, self.order), plan):
            assign(field, row)
        assign(self.cycle, np.zeros(count))
        assign(self.sums, np.zeros((count, SUM_COUNT)))
        assign(self.extremes, np.tile(_NO_EXTREMES, (count, 1)))

    @ti.kernel
    def advance(self, share: ti.f64):
        """Step every group to a share of the steps from its begin to its goal."""
        for t in range(self.padding * (self.table.scenes[None] // self.container.scenes())):
            if t % self.padding == 0:
                self._advance_scene(self.order[t // self.padding], share)

    @ti.func
    def _advance_scene(self, s, share):
        begin, span = self.begin[s], self.goal[s] - self.begin[s]
        target = begin + ti.cast(ti.floor(share * span), ti.i32)
        while self.step[s] < target and self._is_sound(s):
            self._advance_step(s)
        if ti.static(backend.most_rounds() > 0):
            if backend.loops_have_ended(self.table.scenes[None]):
                self.status[s] = CUT_SHORT

    @ti.func
    def _is_sound(self, first):
        sound = True
        for k in range(self.container.scenes()):
            if self.status[first + k] != 0:
                sound = False
        return sound

    @ti.func
    def _advance_step(self, first):
        """The order of a step: fillings, container, clock, measures, divergence."""
        # From 0, as the compiler then knows that a scene of its own takes one round.
        for k in range(self.container.scenes()):
            s = first + k
            motion = self.container.motion(s)
            self.before[s] = ti.Vector([motion.x, motion.v, motion.a])
            self._record(s, motion)
        self._set_actions(first)
        attempts = self.container.advance(first)
        for k in range(self.container.scenes()):
            s = first + k
            action = Action(self.container.impulse[s], self.container.carried[s])
            self._book(s, self._motion_before(s), action, attempts if k == 0 else 0)

    @ti.func
    def _motion_before(self, s):
        """Motion at the beginning of the step."""
        before = self.before[s]
        return Motion(before[0], before[1], before[2])

    @ti.func
    def _set_actions(self, first):
        """Actions of the fillings on the container; scenes without a box have none."""
        if ti.static(self.wait):
            for k in range(self.container.boxes()):
                s = first + k
                blows = self.device.find_blows(s, self.step[s], self._motion_before(s))
                self.container.set_blows(s, blows)
            self.container.resolve(first)
        for k in range(self.container.boxes()):
            s, action = first + k, Action(0.0, 0.0)
            if ti.static(self.wait):
                recoil = self.container.recoil_of(s)
                action = self.device.carry_out(s, self.step[s], self._motion_before(s), recoil)
            else:
                action = self.device.advance(s, self.step[s], self._motion_before(s))
            self.container.set_action(s, action)

    @ti.func
    def _record(self, s, before):
        since = self.step[s] - self.begin[s]
        self.recorder.note(s, since, before, self.force[s], self._present)

    @ti.func
    def _present(self, s, motion):
        y, energy, momentum = self.container.base(s), self.device.energy(s), self.device.momentum(s)
        return motion.x, motion.v, motion.a, y, self.force[s], energy, momentum

    @ti.func
    def _book(self, s, before, action, attempts):
        """Enter a step that filling and container have taken: clock, measures, divergence."""
        step, now, middle = self.step[s], self.clock.circle[s], self.clock.middle(s)
        full = self.clock.tick(s)
        after = self.container.motion(s)
        self.force[s] = self._force(s, action, after.v - before.v)
        self._enter(s, step, action.carried * (after.v - before.v))
        if step >= self.measure_from[s]:
            self._measure(s, before, now, middle)
            if full:
                self._write_cycle(s)
        self.step[s], self.attempts[s] = step + 1, self.attempts[s] + attempts
        if step % _CHECK_EVERY == 0 or full:
            self.status[s] = self.device.divergence_code(s)
        if attempts < 0 or not after.x * after.x + after.v * after.v < _FAR:
            self.status[s] = LOST

    @ti.func
    def _force(self, s, action, speed_gain):
        """Mean force [N] of the filling on the container over a step with a gain in speed [m/s]."""
        dt = self.table.dt[s]
        return action.impulse / dt - action.carried * (self.table.gravity[s] + speed_gain / dt)

    @ti.func
    def _enter(self, s, step, late):
        """Enter a step in the account; late: momentum gain of the carried mass in it [kg m/s]."""
        if step > 0:
            self.account.add(s, self.force[s], late)
        else:
            self.account.begin(s, self.device.momentum(s), late)

    @ti.func
    def _clear(self, s):
        self.sums[s] = ti.Vector.zero(ti.f64, SUM_COUNT)
        self.extremes[s] = ti.Vector(_NO_EXTREMES)

    @ti.func
    def _measure(self, s, motion, now, middle):
        """Add the sums of ``measures.SUMS``; the force of a step belongs to its middle."""
        # Not by +=, which would be an atomic sum here.
        x, v, f = motion.x, motion.v, self.force[s]
        sine, cosine, fs, fc = now[0], now[1], f * middle[0], f * middle[1]
        more = ti.Vector([x, x * x, x * cosine, x * sine, v * cosine, v * sine, f, fc, fs])
        self.sums[s] = self.sums[s] + more
        bounds = self.extremes[s]
        self.extremes[s] = ti.Vector([ti.max(bounds[0], x), ti.min(bounds[1], x)])

    @ti.func
    def _write_cycle(self, s):
        c = self.cycle[s]
        for k in ti.static(range(SUM_COUNT)):
            self.record[s, c, k] = self.sums[s][k]
        self.record[s, c, SUM_COUNT] = self.extremes[s][0]
        self.record[s, c, SUM_COUNT + 1] = self.extremes[s][1]
        self.record[s, c, SUM_COUNT + 2] = self.device.energy(s)
        self.cycle[s] = c + 1
        self._clear(s)

    @ti.kernel
    def sample(self, values: _F64):
        """Fill values[k, s] with the quantities of ``measures.SAMPLE``."""
        for s in range(self.table.scenes[None]):
            present = self._present(s, self.container.motion(s))
            for k in ti.static(range(len(measures.SAMPLE))):
                values[k, s] = present[k]

    def read_status(self) -> np.ndarray:
        """Step, position in the cycle, and status of all scenes, (3, scenes)."""
        fields = self.step, self.clock.position, self.status
        return np.stack([self.table.in_use(field) for field in fields])

    def read(self, cycles: int) -> np.ndarray:
        """The first cycles of the record, (scenes, cycles, columns)."""
        return self.table.in_use(self.record)[:, :cycles]
