"""Engines: a structure is compiled once; a scene in one has the bits of a scene alone."""

import contextlib
import threading
from dataclasses import replace

import numpy as np
import pytest
import taichi as ti
from taichi.lang import impl

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    runtime,
)
from taichi_dem.effects.base import Effect
from taichi_dem.engine.engine import ENGINES
from taichi_dem.kit import allocation
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.physics.rotation import zero3
from taichi_dem.timeline import NEVER
from tests.slow import slow_but

#: Largest steps of a run: bonds break at the left end, and what they held touches.
STEPS = 60


def drawn_scene(random):
    """A bar of some size under a blow; every number in it is drawn."""
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
    left = effects.GasPressure("left", peak=2e9, rise=float(random.uniform(5e-6, 2e-5)))
    listed = [
        *(effects.BondDamping(), effects.Softening(), effects.ShearSlip(), contact),
        *(effects.Friction(), effects.Gravity(tuple(random.normal(size=3) * 10.0)), left),
        effects.PrescribedMotion(
            "right", tuple(random.normal(size=3)), float(random.uniform(0, 9))
        ),
    ]
    speed = float(10.0 ** random.uniform(4, 6))
    return Scene(bar(0.02 * cells[0], 0.05, cells), material, listed, max_speed=speed)


def implicit(random):
    """Solved dashpots with drawn numbers."""
    sweeps = (int(random.integers(1, 4)), int(random.integers(5, 12)))
    return ImplicitDashpots(
        float(random.uniform(1e-7, 4e-7)),
        sweeps,
        float(10.0 ** random.uniform(-4, -1)),
        float(random.uniform(0.5, 1.0)),
        float(random.uniform(4e-7, 1e-5)),
    )


def controlled(random):
    """Steps by what limits them with drawn numbers."""
    control = StepControl(
        safety=float(random.uniform(0.1, 0.5)),
        angle=float(random.uniform(0.01, 0.1)),
        level_jump=int(random.integers(1, 4)),
        ahead=float(random.uniform(1, 3)),
        dashpot_floor=float(random.uniform(5e-9, 2e-8)),
    )
    return Multirate(float(random.uniform(2e-8, 8e-8)), 1e-5, control=control, dashpot="limited")


def held(random):
    """The paper's rule with drawn numbers."""
    return Multirate(float(random.uniform(5e-9, 1e-8)), float(10.0 ** random.uniform(-8, -7)))


def fixed(random):
    """One step for all."""
    return Uniform(float(random.uniform(5e-9, 1e-8)))


KINDS = (implicit, controlled, held, fixed)


def outcome(simulation):
    """Bits of a run: motion, fracture and account."""
    motion = simulation.state.motion()
    broken = simulation.state.broken_tick.to_numpy()
    return [*motion.values(), broken, np.array(list(simulation.energy_balance.account().values()))]


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second))


def run_alone(scene, method, driver="resident"):
    """Bits of a scene on an engine made for it, in a pool of its own."""
    simulation = Simulation(scene, method, driver)
    simulation.advance_to(STEPS)
    return outcome(simulation)


@pytest.mark.parametrize("kind", slow_but(KINDS, fixed), ids=lambda kind: kind.__name__)
def test_other_numbers_compile_nothing_and_leave_no_trace(kind, compilations, compiled_anew):
    """Scenes of one structure, each with all numbers drawn anew, one after the other."""
    drawn = [
        (drawn_scene(np.random.default_rng(k)), kind(np.random.default_rng(k))) for k in (1, 2)
    ]
    second_first = run_alone(*drawn[1])
    assert ENGINES.count == 1 and compilations
    del compilations[:]
    first = run_alone(*drawn[0])
    assert same(run_alone(*drawn[1]), second_first)
    assert compilations == [] and ENGINES.count == 1
    ENGINES._engines = {}
    assert same(run_alone(*drawn[0]), first)


@pytest.mark.parametrize(
    "method",
    slow_but([ImplicitDashpots(2e-7), Uniform(2e-8), Multirate(2e-8)], ImplicitDashpots(2e-7)),
    ids=lambda method: method.name,
)
def test_nothing_is_compiled_in_the_time_of_steps(method, compilations, compiled_anew, monkeypatch):
    """Readings of contacts are compiled between steps, once a bar has broken."""
    torn = effects.PrescribedMotion("right", (2.0, 1.0, 0.0), 900.0)
    laws = [effects.Softening(), effects.ShearSlip(), effects.SphereContact(), effects.Friction()]
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [*laws, effects.Fixed("left"), torn])
    simulation = Simulation(scene, method)
    counts, timed = [], simulation._timed

    @contextlib.contextmanager
    def counted():
        before = len(compilations)
        with timed():
            yield
        counts.append(len(compilations) - before)

    monkeypatch.setattr(simulation, "_timed", counted)
    simulation.start()
    started = len(compilations)
    simulation.advance_to(round(2e-4 / method.dt0))
    assert (simulation.state.broken_tick.to_numpy() != NEVER).any()
    assert len(compilations) > started and set(counts) == {0}
    assert simulation.run_cpu_seconds > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS[:2], ids=lambda kind: kind.__name__)
def test_two_live_simulations_have_the_bits_of_each_alone(kind):
    drawn = [
        (drawn_scene(np.random.default_rng(k)), kind(np.random.default_rng(k))) for k in (3, 4)
    ]
    alone = [run_alone(*one) for one in drawn]
    engines, together = ENGINES.count, [Simulation(*one, "resident") for one in drawn]
    for step in range(0, STEPS + 1, 12):
        for simulation in together:
            simulation.advance_to(step)
    assert all(same(outcome(one), bits) for one, bits in zip(together, alone))
    assert ENGINES.count == engines


def test_a_view_keeps_to_its_simulation():
    """Also one that was taken before another simulation came to the engine."""
    first, second = (Simulation(Scene(single(), CONCRETE), Uniform()) for _ in range(2))
    states, still = (first.state, second.state), [[1.0, 0.0, 0.0, 0.0]]
    for k, state in enumerate(states):
        state.set_motion([[k, 0.0, 0.0]], still)
    assert [state.position.to_numpy()[0, 0] for state in states] == [0.0, 1.0]
    field = states[0].position
    assert states[1].position.to_numpy()[0, 0] == 1.0 and field.to_numpy()[0, 0] == 0.0


def test_reset_begins_again_with_another_scene_and_compiles_nothing(compilations):
    random = np.random.default_rng(7)
    scene, method = drawn_scene(random), implicit(random)
    wanted = run_alone(scene, method)
    simulation = Simulation(drawn_scene(random), implicit(random), "resident")
    simulation.advance_to(STEPS)
    del compilations[:]
    simulation.reset(scene, method)
    assert simulation.time_s == 0.0 and simulation.searches == 0
    simulation.advance_to(STEPS)
    assert same(outcome(simulation), wanted) and compilations == []
    for other in (
        replace(scene, effects=scene.effects[1:]),
        replace(scene, mesh=bar(9, 1, (900, 1, 1))),
    ):
        with pytest.raises(InputError, match="reset must have a scene"):
            simulation.reset(other)
    with pytest.raises(InputError, match="reset must have a scene"):
        simulation.reset(method=Uniform())
    assert same(outcome(simulation), wanted)


@ti.data_oriented
class Careless(Effect):
    """A load whose kernel reads a number of the host, which the compiler takes as a constant."""

    role = "load"
    name = "careless"

    def __init__(self, push):
        self.push = push

    @ti.func
    def acts_on(self, i):
        """Every body."""
        return 1

    @ti.func
    def wrench(self, i, motion):
        """A force along x."""
        force = zero3()
        force[0] = self.push * self.tables.mass[i]
        return force, zero3()


def test_a_number_that_a_kernel_read_as_a_constant_is_never_another_scenes(compiled_anew):
    """v = push t, whoever compiled first, and also where two began before any compiled."""
    waiting = [
        Simulation(Scene(single(), CONCRETE, [Careless(push)]), Uniform()) for push in (1.0, 2.0)
    ]
    later = [
        Simulation(Scene(single(), CONCRETE, [Careless(push)]), Uniform()) for push in (2.0, 5.0)
    ]
    speeds = []
    for simulation in (*waiting, *later):
        simulation.advance_to(100)
        speeds.append(simulation.motion()["velocity"][0, 0] / 1e-6)
    assert speeds == pytest.approx([1.0, 2.0, 2.0, 5.0], rel=1e-12)
    assert ENGINES.count == 3


def test_clear_gives_memory_back_and_refuses_what_was_made_before():
    before = allocation.field_bytes()
    simulation = Simulation(Scene(bar(1.0, 0.1, (400, 1, 1)), CONCRETE), Uniform())
    simulation.start()
    assert allocation.field_bytes() > before
    assert impl.get_runtime().get_num_compiled_functions() > 0
    runtime.clear()
    assert ENGINES.count == 0
    # Taichi frees no kernel while its program lives.
    assert impl.get_runtime().get_num_compiled_functions() == 0
    for call in (lambda: simulation.advance_to(1), simulation.report, simulation.reset):
        with pytest.raises(InputError, match=r"simulation has been given back by runtime.clear"):
            call()
    again = Simulation(Scene(single(), CONCRETE), Uniform())
    again.advance_to(1)
    assert again.time_s == 1e-8


def test_another_thread_is_refused_in_words():
    simulation, said = Simulation(Scene(single(), CONCRETE), Uniform()), []

    def work():
        calls = (lambda: simulation.advance_to(1), lambda: simulation.state.position.to_numpy())
        for call in (
            *calls,
            lambda: Simulation(Scene(single(), CONCRETE), Uniform()),
            runtime.clear,
        ):
            try:
                call()
            except InputError as error:
                said.append(str(error))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert len(said) == 4
    assert all("on the thread that called runtime.start()" in sentence for sentence in said)
    simulation.advance_to(1)


def test_a_scene_too_large_for_memory_is_refused_with_its_need(monkeypatch, compiled_anew):
    trees = allocation.tree_count()
    monkeypatch.setattr(allocation, "available_bytes", lambda: 1e5)
    with pytest.raises(
        InputError, match=r"needs [0-9.]+ GB of memory, of which 0.0001 GB are free"
    ):
        Simulation(Scene(single(), CONCRETE), Uniform())
    assert allocation.tree_count() == trees
    monkeypatch.undo()
    Simulation(Scene(single(), CONCRETE), Uniform()).advance_to(1)
