"""Costs of a step with other effects, from the same states (``cost_of_effects.py``).

Times of whole runs do not tell what an effect costs: runs with other effects take other ways, and
no machine is equally fast for long. Here a run is stopped at some times, its states are put into
scenes with other effects, and all of them take a few steps from each state, by turns.
"""

from functools import partial

import numpy as np
from scipy.stats import quantile_test

import taichi_dem as dem
from _blast import EFFECTS
from ca_damper import Automaton, Batch, Oscillator, SceneTable, Spheres
from ca_damper.automaton.lattice import DOWN, HELD, UP
from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.study import on_device, seconds_of

FILLINGS = {"spheres": Spheres, "automaton": partial(Automaton, rules="paper")}
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


def batch_of(filling, options, particles, step, ratios, seeds, measured_cycles):
    """Scenes of the paper's oscillator; ratios: of frequencies to its natural one, each seed."""
    oscillator = Oscillator()
    frequency, seed = np.meshgrid(np.array(ratios) * oscillator.natural_frequency, seeds)
    scenes = particles, seed.ravel(), step, frequency.ravel(), oscillator.base_amplitude
    job = {"measured_cycles": measured_cycles, "if_diverged": "raise"}
    batch = Batch(FILLINGS[filling](**options), SceneTable(*scenes), **job)
    batch.start("rigid")
    batch.advance(0)
    return batch


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
        lists = () if self.simulation.model.has_contact else ("schedule.pairs.",)
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


class FrozenBatch:
    """Scenes of a damper in states of a batch with other options; steps are timed from each."""

    #: Fields with numbers of the filling's options, and the share of the steps that is not timed.
    OWN, WARM = ("device.pair_contacts.", "device.wall_contacts.", "device.parameters."), 0.2

    def __init__(self, filling, options, table):
        self.batch = batch_of(filling, options, **table)
        self.memory = FieldMemory(self.batch.engine)
        # Places in the engine's list of fields differ with the options, their order does not.
        fields = self.memory.fields
        for k, name in enumerate([name for name in fields if name.startswith("table.made.")]):
            fields[f"table.in_order.{k}"] = fields.pop(name)

    def states_of_run(self, count, transient, measured):
        """States of the run, at phases spread over the cycle: arrays by name of the field."""
        found, gap = [], measured // count + 1.0 / count
        for k in range(count):
            whole = self.batch.steps_per_cycle * (gap if k else transient)
            self.batch.advance(whole.astype(int))
            found.append(self.memory.read())
        return found

    def freeze(self, states, substeps):
        """Take over states, and the steps to go from each."""
        own, self.substeps, self.states = self.memory.read(), substeps, []
        taken = {name for name in own if not name.startswith(self.OWN)}
        for state in states:
            self.memory.write({**own, **{name: state[name] for name in taken & state.keys()}})
            if "device.resting.held" in state and not self.batch.device.resting.rests:
                release(self.batch.device)
            coupling = self.batch.engine.coupling
            begin = coupling.read_status()[0]
            goal = begin + substeps
            coupling.aim(np.stack([begin, goal, goal, np.arange(self.batch.count)]))
            self.states.append(self.memory.read())

    def seconds(self, state):
        """Seconds of a step of a scene from a state."""
        self.memory.write(self.states[state])
        advance = self.batch.engine.coupling.advance
        advance(self.WARM)
        return seconds_of(advance, 1.0) / ((1.0 - self.WARM) * self.substeps * self.batch.count)


def release(device):
    """Let go of held particles where they are, as ``StaticContact.release`` does."""
    fields = device.cells.kind, device.cells.speed, device.cells.travelled
    kind, speed, travelled = arrays = [values(field) for field in fields]
    scene, cell = np.nonzero(kind == HELD)
    velocity, offset = values(device.velocity)[scene], values(device.cells.offset)[scene]
    rising = velocity > 0.0
    kind[scene, cell] = np.where(rising, UP, DOWN)
    speed[scene, cell] = np.abs(velocity)
    travelled[scene, cell] = np.where(rising, offset, -offset)
    for field, array in zip(fields, arrays):
        assign(field, array)
    device.resting.held.fill(0)


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


def costs_of_damper(filling, scenes, table, transient, states, substeps, rounds):
    """Costs of options of a filling by name, the first as it is, whose run the states are of."""
    frozen = {name: FrozenBatch(filling, own, table) for name, own in scenes.items()}
    first = next(iter(frozen.values()))
    found = first.states_of_run(states, transient, table["measured_cycles"])
    for one in frozen.values():
        one.freeze(found, substeps)
    return paired_costs(frozen, states, rounds)
