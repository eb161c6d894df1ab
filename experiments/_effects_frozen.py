"""Cost of a substep of several blasts from the same states, timed by turns.

Times of whole runs do not tell what an effect costs: runs with other effects take other ways, and
no machine is equally fast for long. Here a run is stopped at some times, its states are put into
scenes with other effects, and all of them take a few substeps from each state, again and again in
random order.
"""

from dataclasses import asdict

import numpy as np

from taichi_dem import InputError, Simulation
from taichi_dem.kit.allocation import values
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study.paired_timing import paired_timing
from taichi_dem.kit.study.timing import on_device, seconds_of

#: Substeps after a state is restored that are not timed: its data come to the cache.
WARM = 2
_END = 1 << 60
#: Fields that hold numbers of the scene, beside the parameters of its effects.
_OWN = ("state.limits", "state.max_speed2")


def states_of_run(scene, method, times):
    """States of a run at times [s], rounded to whole largest steps: arrays by name of the field."""
    simulation = Simulation(scene, method, _driver())
    found = []
    for time in times:
        simulation.advance_to(round(time / method.dt0))
        found.append(_memory(simulation).read())
    return found


class FrozenScene:
    """A scene in some states, from each of which its substeps can be timed again and again.

    states: of runs of the same mesh, with the scene's contact law if it has one, as what is near
    has to be known; other fields that the run lacks begin at zero. substeps: that are timed.
    """

    def __init__(self, scene, method, states, substeps=12):
        self.simulation, self.substeps = Simulation(scene, method, _driver()), substeps
        self.simulation.driver.prepare()
        self.memory = _memory(self.simulation)
        self.states = [self._placed(state) for state in states]
        # Sweeps, searches and pairs in a substep, a row a state.
        self.counts = np.array([self._counted(k) for k in range(len(states))])

    def seconds(self, state):
        """Seconds of a substep from a state."""
        self._restore(state)
        return seconds_of(self._step, self.substeps) / self.substeps

    def _restore(self, state):
        self.memory.write(self.states[state])
        self._step(WARM)

    def _step(self, substeps):
        self.simulation.driver.few(_END, substeps)

    def _placed(self, state):
        """Arrays of all fields with a run's state in them."""
        arrays, touches = self.memory.read(), self.simulation.model.has_contact
        for name in arrays.keys() & state.keys():
            # Lists of pairs have room for none in a scene without contact.
            lists = name.startswith("schedule.pairs.") and not touches
            if not (lists or name in _OWN or name.endswith(".law")):
                arrays[name] = state[name]
        return arrays

    def _counted(self, state):
        self._restore(state)
        before = self._counters()
        self._step(self.substeps)
        found = self._counters() - before
        if found[0] != self.substeps:
            raise InputError(
                f"a scene must take {self.substeps} substeps from every state, took {found[0]}: "
                "ask for fewer"
            )
        return found[1:] / self.substeps

    def _counters(self):
        simulation = self.simulation
        evaluations = values(simulation.schedule.evaluations)
        counts = evaluations[0], simulation.sweeps(), simulation.searches, evaluations[3]
        return np.array(counts, dtype=np.int64)


def paired_costs(candidates, states, method, substeps, **timing):
    """Numbers of the cost of a substep by candidate: its timing, sweeps, searches and pairs.

    candidates: scenes of one mesh by name. states: of each by name, equally many of
    ``states_of_run``. timing: as of ``paired_timing``.
    """
    frozen = {
        name: FrozenScene(scene, method, states[name], substeps)
        for name, scene in candidates.items()
    }
    works = {name: one.seconds for name, one in frozen.items()}
    count = len(next(iter(states.values())))
    means = {name: one.counts.mean(axis=0).tolist() for name, one in frozen.items()}
    return {
        name: {**asdict(cost), **dict(zip(("sweeps", "searches", "pairs"), means[name]))}
        for name, cost in paired_timing(works, np.ones(count), **timing).items()
    }


def _driver():
    return "parallel" if on_device() else "resident"


def _memory(simulation):
    return FieldMemory(simulation.engine)
