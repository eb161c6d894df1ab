"""Costs of a step with other effects, from the same states (``cost_of_effects.py``).

Times of whole runs do not tell what an effect costs: runs with other effects take other ways, and
no machine is equally fast for long. Here a run is stopped at some times, its states are put into
scenes with other effects, and all of them take a few steps from each state, by turns.
"""

import numpy as np
from scipy.stats import quantile_test

import taichi_dem as dem
from _blast import EFFECTS
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import on_device, seconds_of

#: Pressure of the blast [Pa].
PEAK = 575e6
#: Effects in the order in which they are listed; the load is always there.
ORDER = ("bond_damping", "softening", "shear_slip", "body_contact", "sticking_friction")
#: Contacts in place of that of bodies: their states are those of an own run.
REPLACING = ("sphere_contact", "surface_contact")
#: Substeps after a state is restored that are not timed: its data come to the cache.
WARM = 2


def scene_of(names, peak=PEAK):
    """The paper's block under gas of some peak pressure [Pa], with effects by name, or "auto"."""
    mesh, gas = dem.read_mesh(dem.PAPER_BLOCK), EFFECTS["gas_pressure"](peak=peak)
    if names == "auto":
        return dem.Scene(mesh, dem.CONCRETE, "auto", loads=[gas])
    return dem.Scene(mesh, dem.CONCRETE, [gas, *(EFFECTS[name]() for name in names)])


class FrozenScene:
    """A scene in states of runs, from each of which its substeps are timed again and again.

    states: of runs of the same mesh, with the scene's contact law if it has one, as what is near
    has to be known; other fields that the run lacks begin at zero. substeps: that are timed.
    """

    #: Fields that hold numbers of the scene.
    OWN = ("state.limits", "state.max_speed2", ".law")

    def __init__(self, scene, method, states=(), substeps=12):
        driver = "parallel" if on_device() else "resident"
        self.simulation, self.substeps = dem.Simulation(scene, method, driver), substeps
        self.simulation.driver.prepare()
        self.memory = FieldMemory(self.simulation.engine)
        own = self.memory.read()
        # Lists of pairs have room for none in a scene without contact.
        lists = () if self.simulation.model.has_contact else ("schedule.lists.pairs.",)
        taken = {name for name in own if not name.endswith(self.OWN) and not name.startswith(lists)}
        self.states = [{**own, **{k: one[k] for k in taken & one.keys()}} for one in states]

    def states_of_run(self, times):
        """States of its run at times [s], rounded to whole largest steps: arrays by field."""
        found = []
        for at in times:
            self.simulation.advance_to(round(at / self.simulation.method.dt0))
            found.append(self.memory.read())
        return found

    def seconds(self, state):
        """Seconds of a substep from a state."""
        self.memory.write(self.states[state])
        self._step(WARM)
        return seconds_of(self._step, self.substeps) / self.substeps

    def _step(self, substeps):
        self.simulation.driver.few(1 << 60, substeps)


def paired_costs(frozen, states, rounds):
    """Time of a step over that of the first of frozen scenes: median and 95 % interval, by name.

    Of so many rounds. One times every scene from every state, all in random order, so that a busy
    moment of the machine falls on no scene alone. Nothing is assumed of how times are distributed.
    """
    scenes, random = [*frozen.values()], np.random.default_rng(1)
    seconds = np.empty((rounds, len(scenes), states))
    for one in seconds:
        for turn in random.permutation(one.size):
            scene, state = divmod(int(turn), states)
            one[scene, state] = scenes[scene].seconds(state)
    means, found = seconds.mean(axis=2), {}
    for name, own in zip(frozen, means.T):
        ratio = own / means[:, 0]
        low, high = quantile_test(ratio, p=0.5).confidence_interval(0.95)
        found[name] = low, np.median(ratio), high
    return found


def costs_of_blast(scenes, until, step, states, substeps, rounds):
    """Costs of scenes of the blast by name, as of ``paired_costs``; scenes: names of effects."""
    method, times = dem.ImplicitDashpots(step), [until * (k + 0.5) / states for k in range(states)]
    made = {name: scene_of(effects) for name, effects in scenes.items()}
    first = next(iter(scenes))
    alike = {name: name if {*own} & {*REPLACING} else first for name, own in scenes.items()}
    begun = {
        name: FrozenScene(made[name], method).states_of_run(times) for name in set(alike.values())
    }
    frozen = {
        name: FrozenScene(scene, method, begun[alike[name]], substeps)
        for name, scene in made.items()
    }
    return paired_costs(frozen, states, rounds)
