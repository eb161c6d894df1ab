"""Runs and costs of a step with other effects, in processes of their own (``cost_of_effects.py``).

Times of whole runs do not tell what an effect costs: runs with other effects take other ways, and
no machine is equally fast for long. Here a run is stopped at some times, its states are put into
scenes with other effects, and all of them take a few steps from each state, by turns.
"""

import time
from dataclasses import asdict, replace
from functools import partial

import numpy as np
import taichi as ti

import taichi_dem as dem
from _blast import EFFECTS
from ca_damper import Automaton, Batch, Oscillator, SceneTable, Spheres
from ca_damper.automaton.lattice import DOWN, HELD, UP
from taichi_dem.demo import figures_of_certificate
from taichi_dem.kit.allocation import assign, field_bytes, values
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.timing import on_device, paired_timing, seconds_of
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.physics.bond import unit_arm, unit_opening
from taichi_dem.step.advance import Advance
from taichi_dem.step.bond import motion_of
from taichi_dem.step.drivers import Resident
from taichi_dem.step.phases import Step

FILLINGS = {"spheres": Spheres, "automaton": partial(Automaton, rules="paper")}
#: Pressure of the blast, and one at which no bond of the block reaches its envelope [Pa].
PEAK, WEAK = 575e6, 5.75e6
#: Effects in the order in which they are listed; the load is always there.
ORDER = ("bond_damping", "softening", "shear_slip", "body_contact", "sticking_friction")
#: Contacts in place of that of bodies: their states are those of an own run.
REPLACING = ("sphere_contact", "surface_contact")
_UNDAMPED = replace(dem.CONCRETE, normal_damping=0.0, shear_damping=0.0)
#: Scenes whose shortest list of effects that serves is known: material, peak [Pa], the list.
KNOWN_LISTS = {
    "blast": (dem.CONCRETE, PEAK, ORDER),
    "weak pulse": (dem.CONCRETE, WEAK, ("bond_damping",)),
    "weak pulse, no damping": (_UNDAMPED, WEAK, ()),
    "blast, no friction": (replace(dem.CONCRETE, friction=0.0), PEAK, ORDER[:-1]),
}
#: Substeps after a state is restored that are not timed: its data come to the cache.
WARM = 2


def scene_of(names, material=dem.CONCRETE, peak=PEAK):
    """The paper's block under gas of some peak pressure [Pa], with effects by name, or "auto"."""
    mesh, gas = dem.read_mesh(dem.PAPER_BLOCK), EFFECTS["gas_pressure"](peak=peak)
    if names == "auto":
        return dem.Scene(mesh, material, "auto", loads=[gas])
    return dem.Scene(mesh, material, [gas, *(EFFECTS[name]() for name in names)])


def blast(names, until, step, ulps=0):
    """A run of the paper's block with some effects, and what it took.

    ulps: by which the peak of the gas pressure differs; nobody would notice but a chaotic run.
    """
    scene, started = scene_of(names, peak=PEAK + ulps * np.spacing(PEAK)), time.process_time()
    try:
        result = dem.simulate(scene, method=dem.ImplicitDashpots(step), until=until, samples=25)
    except dem.SimulationDiverged as error:
        return {"failed": str(error)}
    report = result.report
    return {
        "before_first_step_s": time.process_time() - started - report.run_cpu_seconds,
        "run_s": report.run_cpu_seconds,
        "steps": report.substeps,
        "memory_MB": 1e-6 * field_bytes(),
        "hole_mm": float(result.series["hole_radial_displacement_mm"][-1]),
        "broken_faces": report.broken_faces,
    }


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


def damper(filling, options, table, transient):
    """A response curve, and what it took; table: arguments of ``batch_of``."""
    started = time.process_time()
    batch = batch_of(filling, options, **table)
    ready = time.process_time()
    try:
        measured = batch.run(transient, table["measured_cycles"])
    except dem.SimulationDiverged as error:
        return {"failed": str(error)}
    return {
        "before_first_step_s": ready - started,
        "run_s": time.process_time() - ready,
        "steps": batch.report().scene_steps,
        "memory_MB": 1e-6 * field_bytes(),
        "rms_mm": (1e3 * measured.rms).reshape(len(table["seeds"]), -1).tolist(),
    }


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


def paired_costs(frozen, states, **timing):
    """Costs of a step by name of frozen scenes, from so many states: dicts of ``PairedTiming``."""
    works = {name: one.seconds for name, one in frozen.items()}
    found = paired_timing(works, np.ones(states), **timing)
    return {name: asdict(cost) for name, cost in found.items()}


def costs_of_blast(scenes, lists, certified, until, step, states, substeps, **timing):
    """Costs by group, all in one process: scenes by their effects, lists beside the best one.

    scenes: arguments of ``blast`` of their own. certified: end [s] of the run with effects="auto"
    whose certificate is a third entry.
    """
    method, times = dem.ImplicitDashpots(step), [until * (k + 0.5) / states for k in range(states)]

    def from_runs(candidates, alike):
        """Costs of scenes; alike: of each the one from whose states it begins."""
        begun = {
            name: FrozenScene(candidates[name], method).states_of_run(times)
            for name in set(alike.values())
        }
        frozen = {
            name: FrozenScene(scene, method, begun[alike[name]], substeps)
            for name, scene in candidates.items()
        }
        return paired_costs(frozen, states, **timing)

    first, costs = next(iter(scenes)), {}
    named = {scene: own["names"] for scene, own in scenes.items()}
    alike = {scene: scene if {*names} & {*REPLACING} else first for scene, names in named.items()}
    blasts = from_runs({scene: scene_of(names) for scene, names in named.items()}, alike)
    for scene in lists:
        material, peak, best = KNOWN_LISTS[scene]
        listed = {"best list": best, "auto": "auto", "all effects": ORDER}
        candidates = {name: scene_of(names, material, peak) for name, names in listed.items()}
        costs[scene] = from_runs(candidates, {name: name for name in listed})
    run = dem.simulate(scene_of("auto"), until=certified, method=method, samples=1)
    told = figures_of_certificate(run.certificate)
    return {"blast": blasts, "lists": costs, "certificate": told}


def costs_of_damper(filling, scenes, table, transient, states, substeps, **timing):
    """Costs of options of a filling by scene, the first as it is, whose run the states are of."""
    frozen = {name: FrozenBatch(filling, table=table, **own) for name, own in scenes.items()}
    first = next(iter(frozen.values()))
    found = first.states_of_run(states, transient, table["measured_cycles"])
    for one in frozen.values():
        one.freeze(found, substeps)
    return {filling: paired_costs(frozen, states, **timing)}


def absent(substeps, repeats):
    """CPU seconds of some substeps of an elastic block in motion: "composed" and "by_hand"."""
    runs = {"composed": _elastic(None), "by_hand": _elastic(ByHand)}
    seconds, order = {name: [] for name in runs}, np.random.default_rng(2)
    for _ in range(repeats):
        for name in order.permutation([*runs]):
            seconds[name].append(seconds_of(runs[name], substeps))
    return seconds


def _elastic(stripped):
    """A function that takes an elastic block, its bodies shaken, some substeps on."""
    scene = dem.Scene(dem.read_mesh(dem.PAPER_BLOCK), dem.CONCRETE, [])
    simulation = dem.Simulation(scene, dem.Uniform(1e-8), "resident")
    centre = simulation.model.centre
    velocity = np.random.default_rng(1).normal(size=centre.shape)
    simulation.state.set_motion(centre, velocity=velocity)
    simulation.start()
    driver = simulation.driver
    if stripped is not None:
        driver = Resident(Step(stripped(simulation.engine.schedule), None))
    driver.prepare()
    return lambda substeps: driver.few(1 << 60, substeps)


@ti.data_oriented
class ByHand(Advance):
    """Elastic bonds with nothing left in that an effect could hook into."""

    @ti.func
    def bond(self, b):
        """Elastic traction of three units, given to both bodies."""
        if self.state.broken_tick[b] < 0:
            slots, motion = self.tables.bond_slots[b], motion_of(self, b)
            k, force, torque = self.tables.bond_stiffness[b], vec3(0.0), vec3(0.0)
            for q in range(3):
                u = 3 * b + q
                arm = unit_arm(motion, self.tables.vertex_slave[u])
                opening = unit_opening(motion, arm, self.tables.vertex_master[u])
                traction = vec3(k[0] * opening[0], k[1] * opening[1], k[1] * opening[2])
                # What would have acted is watched in every scene.
                sheared = vec2(traction[1], traction[2]).norm_sqr()
                self.state.note_passed(self.tables.bond_pair[b], b, traction[0], sheared)
                force += traction
                torque += arm.cross(traction)
            weight = self.tables.unit_area[b] * self.schedule.pair_step(
                slots[0] >> 2, slots[1] >> 2
            )
            self._pull_together(slots, motion, force * weight, torque * weight)
