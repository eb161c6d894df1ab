"""Engines: a structure is compiled once; a scene in one has the bits of a scene alone."""

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Scene,
    Simulation,
    Uniform,
    effects,
)
from taichi_dem.engine import ENGINES
from taichi_dem.kit.allocation import FieldTree, assign, values
from taichi_dem.kit.taichi_patches.addresses import LARGE
from taichi_dem.kit.taichi_patches.names import are_on
from taichi_dem.kit.types import vec3
from taichi_dem.mesh.shapes import bar, single
from tests.processes import chosen_arch
from tests.scenes import struck_bar
from tests.structures import filled

#: Largest steps of a run: bonds break at the left end, and what they held touches.
STEPS = 60


def drawn(seed):
    """A bar of some size under a blow, and solved dashpots; every number in them is drawn."""
    random = np.random.default_rng(seed)
    cells = tuple(int(n) for n in random.integers(1, 5, 3))
    material = replace(
        CONCRETE,
        density=float(random.uniform(1e3, 4e3)),
        contact_damping=float(10.0 ** random.uniform(5, 6.5)),
        friction=float(random.uniform(0.1, 0.9)),
        tensile_strength=float(random.uniform(2e6, 6e6)),
    )
    contact = effects.SphereContact(
        divisions=int(random.integers(3, 6)),
        outer_faces=bool(random.integers(2)),
        skin=float(10.0 ** random.uniform(-3, -1)),
    )
    gas = effects.GasPressure("left", peak=2e9, rise=float(random.uniform(5e-6, 2e-5)))
    laws = effects.BondDamping(), effects.Softening(), effects.ShearSlip()
    listed = [*laws, contact, effects.Friction(), gas]
    speed = float(10.0 ** random.uniform(4, 6))
    scene = Scene(bar(0.02 * cells[0], 0.05, cells), material, listed, max_speed=speed)
    method = ImplicitDashpots(
        float(random.uniform(1e-7, 4e-7)),
        (int(random.integers(1, 4)), int(random.integers(5, 12))),
        float(10.0 ** random.uniform(-4, -1)),
        float(random.uniform(0.5, 1.0)),
        float(random.uniform(4e-7, 1e-5)),
    )
    return scene, method


def outcome(simulation):
    """Bits of a run: motion, fracture and account."""
    motion = simulation.state.motion()
    broken = simulation.values(simulation.state.broken_tick)
    return [*motion.values(), broken, np.array(list(simulation.energy_balance.account().values()))]


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second))


def ran(scene, method):
    """A run to its end."""
    simulation = Simulation(scene, method, "resident")
    simulation.advance_to(STEPS)
    return simulation


@pytest.fixture(scope="module")
def alone():
    """Bits of two scenes of one structure, one after the other; that is compiled from here on."""
    return [outcome(ran(*drawn(seed))) for seed in (1, 2)]


def test_other_numbers_compile_nothing_and_leave_no_trace(alone, compilations):
    """Scenes of one structure, each with all numbers drawn anew, one after the other."""
    engines = ENGINES.count
    assert same(outcome(ran(*drawn(1))), alone[0])
    assert same(outcome(ran(*drawn(2))), alone[1])
    assert compilations == [] and ENGINES.count == engines


def test_two_live_simulations_have_an_engine_each_and_the_bits_of_each_alone():
    """Of bars under a blow with and without dashpots, in turns of twelve steps."""
    given = [(struck_bar(damping), Uniform(2e-8)) for damping in (True, False)]
    alone = [outcome(ran(*one)) for one in given]
    together = [Simulation(*one, "resident") for one in given]
    assert together[0].engine is not together[1].engine
    for step in range(0, STEPS + 1, 12):
        for simulation in together:
            simulation.advance_to(step)
    assert not same(*alone)
    assert all(same(outcome(one), bits) for one, bits in zip(together, alone))


def test_reset_begins_again_with_another_scene_and_compiles_nothing(alone, compilations):
    scene, method = drawn(1)
    simulation = ran(*drawn(2))
    simulation.reset(scene, method)
    assert simulation.time_s == 0.0 and simulation.searches == 0
    simulation.advance_to(STEPS)
    assert same(outcome(simulation), alone[0]) and compilations == []
    with pytest.raises(InputError, match="reset must have a scene"):
        simulation.reset(replace(scene, effects=scene.effects[1:]))
    assert same(outcome(simulation), alone[0])


def falling():
    """A body at rest."""
    return Simulation(Scene(single(), CONCRETE, filled("bonds", group="base")), Uniform())


def test_an_engine_goes_on_to_the_next_when_its_simulation_is_gone_or_closed():
    first = falling()
    engine, count = first.engine, ENGINES.count
    del first
    second = falling()
    assert second.engine is engine
    second.close()
    third = falling()
    assert third.engine is engine and ENGINES.count == count
    for call in (lambda: second.time_s, lambda: second.advance_to(1), second.close):
        with pytest.raises(InputError, match="this simulation has been closed"):
            call()


@pytest.mark.skipif(chosen_arch() != "cpu" or not are_on(), reason="it clears by a kernel")
def test_cleared_memory_is_zero_to_the_last_byte():
    """That of a list so long that its pages are given back, and of one that begins in a page."""
    for count in (1000, LARGE // 8 + 1000):
        tree = FieldTree()
        with tree:
            first, last = ti.field(ti.i32, shape=3), ti.field(ti.f64, shape=count)
        for _ in range(2):
            assign(first, 7)
            assign(last, np.arange(1.0, count + 1.0))
            tree.clear()
            assert not values(first).any() and not values(last).any()
        tree.destroy()


@ti.data_oriented
class Careless(effects.Load):
    """A load whose kernel reads a number of the host, which the compiler takes as a constant."""

    def __init__(self, push):
        self.push = push

    @ti.func
    def wrench(self, i, motion):
        """A force along x."""
        force = vec3(0.0)
        force[0] = self.push * self.tables.mass[i]
        return force, vec3(0.0)


def test_a_number_that_a_kernel_read_as_a_constant_is_never_another_scenes():
    """v = push t, whoever compiled first, and where two began before any compiled.

    The later ones run in engines in which other scenes have run, and begin without their data.
    """
    before, speeds = ENGINES.count, []
    for pushes in ((1.0, 2.0), (2.0,)):
        scenes = [Scene(single(), CONCRETE, [Careless(push)]) for push in pushes]
        for simulation in [Simulation(scene, Uniform()) for scene in scenes]:
            simulation.advance_to(100)
            speeds.append(simulation.motion()["velocity"][0, 0] / 1e-6)
        del simulation
    assert speeds == pytest.approx([1.0, 2.0, 2.0], rel=1e-12)
    assert ENGINES.count == before + 2
