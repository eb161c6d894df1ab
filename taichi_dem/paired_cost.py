"""Cost of a substep of several scenes from the same states, timed by turns.

Times of whole runs do not tell what an effect costs: runs with other effects take other ways, and
no machine is equally fast for long. Here a run is stopped at some times, its states are put into
scenes with other effects, and all of them take a few substeps from each state, again and again in
random order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from taichi_dem.kit.allocation import values
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.display import by_fields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study.paired_timing import PairedTiming, paired_timing
from taichi_dem.kit.study.timing import on_device, seconds_of
from taichi_dem.kit.uncopied import Uncopied
from taichi_dem.methods import Method
from taichi_dem.scene import Scene
from taichi_dem.simulation import Simulation

#: Substeps after a state is restored that are not timed: its data come to the cache.
WARM = 2
_END = 1 << 60
#: Fields that hold numbers of the scene, beside the parameters of its effects.
_OWN = ("state.limits", "state.max_speed2")


@dataclass(frozen=True)
class RunState:
    """State of a run at a time [s].

    contact: its contact law in words, "" without. arrays: all fields that change, by name.
    """

    time_s: float
    contact: str
    arrays: dict[str, np.ndarray]

    def __repr__(self):
        return by_fields(self)


@dataclass(frozen=True)
class StepCost:
    """Cost of a substep: its timing, and mean numbers of sweeps, searches and pairs in it."""

    timing: PairedTiming
    sweeps: float
    searches: float
    pairs: float


#: States for all candidates, or by the name of each.
States = Union[Sequence[RunState], Mapping[str, Sequence[RunState]]]


def states_of_run(scene: Scene, method: Method, times: Sequence[float]) -> list[RunState]:
    """States of a run at times [s], rounded to whole largest steps."""
    simulation = Simulation(scene, method, _driver())
    found = []
    for time in times:
        simulation.advance_to(round(time / method.dt0))
        arrays = FieldMemory(simulation.engine).read()
        found.append(RunState(simulation.time_s, _contact(simulation), arrays))
    return found


class FrozenScene(Uncopied):
    """A scene in some states, from each of which its substeps can be timed again and again.

    states: of runs of the same mesh, with the scene's contact law if it has one, as what is near
    has to be known; other fields that the run lacks begin at zero. substeps: that are timed.
    Raises InputError for states of another mesh or contact law, and where the scene cannot take so
    many substeps from one of them.
    """

    def __init__(
        self, scene: Scene, method: Method, states: Sequence[RunState], substeps: int = 12
    ):
        self.simulation, self.substeps = Simulation(scene, method, _driver()), substeps
        self.simulation.driver.prepare()
        self.memory = FieldMemory(self.simulation.engine)
        self.states = [self._placed(state) for state in states]
        self.counts = np.array([self._counted(k) for k in range(len(states))])

    def seconds(self, state: int) -> float:
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
        own, arrays = _contact(self.simulation), self.memory.read()
        if own not in ("", state.contact):
            raise InputError(
                f"states must be of a run with contact law {own}, got {state.contact or 'none'}: "
                "take those of the scene's own run"
            )
        for name in arrays.keys() & state.arrays.keys():
            # Lists of pairs have room for none in a scene without contact.
            lists = name.startswith("schedule.pairs.") and not own
            if not (lists or name in _OWN or name.endswith(".law")):
                arrays[name] = state.arrays[name]
        odd = self.memory.misfit(arrays)
        if odd:
            raise InputError(f"states must be of a run of the same mesh, got another size of {odd}")
        return arrays

    def _counted(self, state):
        """Sweeps, searches and pairs in a substep from a state."""
        self._restore(state)
        before, tick = self._counters(), int(values(self.simulation.state.tick))
        self._step(self.substeps)
        found = self._counters() - before
        if found[0] != self.substeps:
            raise InputError(
                f"a scene must take {self.substeps} substeps from every state, took {found[0]} "
                f"from tick {tick} on: leave out the state, or ask for fewer"
            )
        return found[1:] / self.substeps

    def _counters(self):
        simulation = self.simulation
        evaluations = values(simulation.schedule.evaluations)
        counts = evaluations[0], simulation.sweeps(), simulation.searches, evaluations[3]
        return np.array(counts, dtype=np.int64)


def paired_cost(
    candidates: Mapping[str, Scene],
    states: States,
    method: Method,
    *,
    shares: Optional[Sequence[float]] = None,
    substeps: int = 12,
    **timing: Any,
) -> dict[str, StepCost]:
    """Cost of a substep of candidates by name, in units of the first one's.

    candidates: scenes of one mesh, two or more. states: of ``states_of_run``, for all of them, or
    by name where each begins from states of its own. shares: of the run's substeps that a state
    stands for, equal by default. substeps: timed from each state. timing: as of ``paired_timing``.
    """
    own = states if isinstance(states, Mapping) else dict.fromkeys(candidates, states)
    if set(own) != set(candidates):
        raise InputError(f"states must be of {sorted(candidates)}, got those of {sorted(own)}")
    if len({len(of) for of in own.values()}) > 1:
        raise InputError("states must be as many for each candidate, got different numbers")
    frozen = {
        name: FrozenScene(scene, method, own[name], substeps) for name, scene in candidates.items()
    }
    count = len(next(iter(own.values())))
    weights = [1.0] * count if shares is None else shares
    works = {name: one.seconds for name, one in frozen.items()}
    found = paired_timing(works, weights, **timing)
    means = {name: np.average(one.counts, 0, weights) for name, one in frozen.items()}
    return {name: StepCost(found[name], *map(float, means[name])) for name in found}


def _driver():
    return "parallel" if on_device() else "resident"


def _contact(simulation):
    """Contact law of a simulation with its parameters, in words; "" without."""
    if not simulation.model.has_contact:
        return ""
    law = next(effect for effect in simulation.scene.effects if effect.role == "contact")
    return f"{law.name} {identity_of(vars(law))}"
