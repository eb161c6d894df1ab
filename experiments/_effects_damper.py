"""Costs of a step of the damper with other options, from the same states (``cost_of_effects.py``).

The function ``damper_costs`` is called in a process of its own, where all candidates are alive at
once, each in an engine of its own.
"""

from dataclasses import asdict

import numpy as np

from _effects_runs import damper_batch
from ca_damper.automaton.lattice import DOWN, HELD, UP
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study.paired_timing import paired_timing
from taichi_dem.kit.study.timing import seconds_of


def damper_costs(filling, scenes, table, states, cycles, substeps, **timing):
    """Costs of options of a filling by scene, the first as it is.

    table: arguments of ``damper_batch``. cycles: of the run before its first state, and then.
    """
    frozen = {name: FrozenBatch(filling, options, table) for name, options in scenes.items()}
    found = next(iter(frozen.values())).states_of_run(states, cycles)
    for one in frozen.values():
        one.freeze(found, substeps)
    works = {name: one.seconds for name, one in frozen.items()}
    costs = paired_timing(works, np.ones(states), **timing)
    return {name: asdict(cost) for name, cost in costs.items()}


class FrozenBatch:
    """Scenes of a damper in some states, from each of which steps are timed again and again."""

    #: Fields with numbers of the filling's options.
    OWN = ("device.pair_contacts.", "device.wall_contacts.", "device.parameters.")
    #: Share of the steps that are not timed: the state comes to the cache.
    WARM = 0.2

    def __init__(self, filling, options, table):
        self.batch = damper_batch(filling, options, **table)
        self.batch.start("rigid")
        self.batch.advance(0)
        self.memory = FieldMemory(self.batch.engine)

    def states_of_run(self, count, cycles):
        """States of the run, at phases spread over the cycle: arrays by name of the field."""
        before, measured = cycles
        found, gap = [], measured // count + 1.0 / count
        for k in range(count):
            whole = self.batch.steps_per_cycle * (gap if k else before)
            self.batch.advance(whole.astype(int))
            found.append(self.memory.read())
        return found

    def freeze(self, states, substeps):
        """Take over states of a batch with other options, and the steps to go from each."""
        own, self.substeps, self.states = self.memory.read(), substeps, []
        kept = {name for name in own if name.startswith(self.OWN)}
        for state in states:
            arrays = {**own, **{name: state[name] for name in own.keys() & state.keys() - kept}}
            self.memory.write(arrays)
            if "device.resting.held" in state and not self.batch.device.resting.rests:
                release(self.batch.device)
            self._aim()
            self.states.append(self.memory.read())
            self.seconds(len(self.states) - 1)
            self._check()

    def seconds(self, state):
        """Seconds of a step of a scene from a state."""
        self.memory.write(self.states[state])
        advance = self.batch.engine.coupling.advance
        advance(self.WARM)
        return seconds_of(advance, 1.0) / ((1.0 - self.WARM) * self.substeps * self.batch.count)

    def _aim(self):
        """Set the steps to go from the present ones, without measuring."""
        begin = self._seen()[0]
        goal = begin + self.substeps
        plan = np.stack([begin, goal, goal, np.arange(self.batch.count)])
        self.batch.engine.coupling.aim(plan)

    def _seen(self):
        return self.batch.engine.coupling.read_status()

    def _check(self):
        if self._seen()[2].any():
            raise InputError("a damper must bear its steps from every state, one diverged")


def release(device):
    """Let go of held particles where they are, as ``StaticContact.release`` does."""
    cells = device.cells
    kind, speed, travelled = fields = [
        values(f) for f in (cells.kind, cells.speed, cells.travelled)
    ]
    scene, cell = np.nonzero(kind == HELD)
    velocity, offset = values(device.velocity)[scene], values(cells.offset)[scene]
    rising = velocity > 0.0
    kind[scene, cell] = np.where(rising, UP, DOWN)
    speed[scene, cell] = np.abs(velocity)
    travelled[scene, cell] = np.where(rising, offset, -offset)
    for field, array in zip((cells.kind, cells.speed, cells.travelled), fields):
        assign(field, array)
    device.resting.held.fill(0)
