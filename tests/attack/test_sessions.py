"""Sessions: whatever is done to one, in any order, it works with the same bits or refuses."""

import copy
import pickle
import signal
import subprocess
import sys
import threading
from functools import cache, partial

import numpy as np
import pytest
import taichi as ti

from ca_damper import Batch, SceneTable
from ca_damper.fixed_mass import RigidMass
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime, simulate
from taichi_dem.engine.engine import ENGINES
from taichi_dem.kit import allocation
from taichi_dem.mesh.shapes import pair
from tests import arch
from tests.processes import users_environment
from tests.scenes import ROOT

ATTACKS = "sessions: failures, interrupts, old objects, threads, forks"

#: Effects by kind of scene; the first two share a structure.
KINDS = ((effects.Gravity(),), (effects.Gravity((9.0, 0.0, 0.0)),), (effects.BondDamping(),))
METHOD = Uniform(1e-8)


class Unready(effects.Gravity):
    """Fails while its fields are declared."""

    def declare(self, capacity):
        ti.field(ti.f64, shape=3)
        raise ZeroDivisionError


class Placeless(effects.Gravity):
    """Declares a field that has no place."""

    def declare(self, capacity):
        self.lost = ti.field(ti.f64)


class Hasty(effects.Gravity):
    """Uses a field before all are declared."""

    def declare(self, capacity):
        self.early = ti.field(ti.f64, shape=3)
        self.early[0] = 1.0


class Unloadable(effects.Gravity):
    """Fails while its fields are filled."""

    def load(self, model):
        raise ZeroDivisionError


class Wordy(effects.Gravity):
    """Has a number that is none."""

    def numbers(self, material):
        return (0.0, "down", 0.0)


FAULTY = (Unready, Placeless, Hasty, Unloadable, Wordy)


@pytest.fixture(autouse=True)
def session_started():
    """Each begins with a session, whatever the one before has left."""
    runtime.start(arch.chosen(), threads=2)


def scene(kind):
    return Scene(pair(), CONCRETE, KINDS[kind])


def made(kind, driver="resident"):
    """A simulation in which something happens from the first step on."""
    simulation = Simulation(scene(kind), METHOD, driver)
    centre, turn = simulation.model.centre, [[1.0, 0.0, 0.0, 0.0]]
    simulation.state.set_motion(centre, turn, [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]])
    return simulation


def bits(simulation):
    return b"".join(array.tobytes() for array in simulation.state.motion().values())


@cache
def alone(kind, step):
    """Bits of a simulation that nothing disturbs."""
    simulation = made(kind)
    simulation.advance_to(step)
    return bits(simulation)


def raising(call, error):
    """A listener of progress that raises at one of its calls."""
    calls = iter(range(call))

    def listen(progress):
        if next(calls, None) is None:
            raise error

    return listen


class Session:
    """Random operations on the session of this process. stale: simulations that must refuse."""

    def __init__(self, rng):
        self.rng, self.live, self.stale = rng, [], []
        # To compile takes most of the time of an attack.
        self.kinds = (0, 1) if rng.random() < 0.7 else (0, 2)
        self.driver = str(rng.choice(["resident", "parallel"]))
        ends = (runtime.clear, self._restart, self._start_behind_the_back)
        self.ends = [ends[rng.integers(3)]]

    def make(self):
        kind = int(self.rng.choice(self.kinds))
        self.live.append([kind, 0, made(kind, self.driver)])

    def run(self):
        """Some steps more, which must have the bits of an undisturbed run."""
        if self.live:
            entry = self.live[self.rng.integers(len(self.live))]
            entry[1] += int(self.rng.integers(1, 8))
            entry[2].advance_to(entry[1])
            assert bits(entry[2]) == alone(entry[0], entry[1])

    def reset(self):
        """To the start, where nothing moves yet but by gravity."""
        if self.live:
            kind, _, simulation = self.live.pop(self.rng.integers(len(self.live)))
            simulation.reset(scene(kind))
            assert simulation.time_s == 0.0 and not simulation.state.velocity.to_numpy().any()

    def fail(self):
        """An effect that fails in one way or another."""
        faulty = FAULTY[self.rng.integers(len(FAULTY))]
        with pytest.raises((InputError, ZeroDivisionError)):
            Simulation(Scene(pair(), CONCRETE, [faulty()]), METHOD)

    def interrupt(self):
        """An exception in a callback, also while kernels are compiled and fields made."""
        error = [KeyboardInterrupt, ZeroDivisionError][self.rng.integers(2)]
        listener = raising(int(self.rng.integers(12)), error)
        kind = int(self.rng.choice(self.kinds))
        try:
            simulate(scene(kind), method=METHOD, until=5e-8, progress=listener)
        except error:
            pass

    def use_old(self):
        """Each use of a simulation of another session is refused in words."""
        for simulation in self.stale:
            for use in (
                partial(simulation.advance_to, 5),
                simulation.report,
                simulation.reset,
                lambda simulation=simulation: simulation.state.motion(),
                lambda simulation=simulation: simulation.state.position[0],
                lambda simulation=simulation: simulation.time_s,
            ):
                with pytest.raises(InputError, match=r"session|given back"):
                    use()
            assert repr(simulation)

    def copy(self):
        """A simulation is no value."""
        for way in (copy.copy, copy.deepcopy, pickle.dumps):
            for _, _, simulation in self.live:
                with pytest.raises(InputError, match="cannot be copied"):
                    way(simulation)

    def use_elsewhere(self):
        """Another thread is refused, and this one not disturbed."""
        for _, _, simulation in self.live:
            for use in (partial(simulation.advance_to, 9), partial(made, 0), runtime.stop):
                assert "on the thread that called" in str(in_thread(use))

    def end(self):
        """End the session, once, and begin another."""
        if self.ends:
            self.stale += [simulation for _, _, simulation in self.live]
            self.live.clear()
            self.ends.pop()()

    def _restart(self):
        runtime.stop()
        runtime.start(arch.chosen(), threads=2)

    def _start_behind_the_back(self):
        ti.init(arch=ti.cpu, default_fp=ti.f32, fast_math=True, log_level=ti.ERROR)
        with pytest.raises(InputError, match="start and stop Taichi by"):
            made(0)
        self.use_old()
        runtime.start(arch.chosen(), threads=2)


def in_thread(use):
    """The InputError that a call ends with on another thread."""
    found = []

    def call():
        try:
            use()
        except InputError as error:
            found.append(error)

    thread = threading.Thread(target=call)
    thread.start()
    thread.join()
    return found[0] if found else None


OPERATIONS = ("make", "run", "reset", "fail", "interrupt", "use_old", "copy", "use_elsewhere")


def test_any_order_of_operations_works_with_the_same_bits_or_is_refused(seed):
    rng = np.random.default_rng(seed)
    session = Session(rng)
    for operation in (
        "make",
        "make",
        *rng.choice(OPERATIONS, 8),
        "end",
        *rng.choice(OPERATIONS, 6),
    ):
        getattr(session, operation)()
    session.make()
    session.run()


def cycles_of(batch, **options):
    return batch.run(3, 2, **options).record.tobytes()


def test_a_batch_that_was_interrupted_begins_again_to_the_same_bits(seed):
    rng = np.random.default_rng(seed)
    table = SceneTable(particles=3, seed=[1, 2], dt=1e-3, base_amplitude=1e-3)
    batch, other = (Batch(RigidMass(), table, measured_cycles=2) for _ in range(2))
    batch.start()
    undisturbed = cycles_of(batch)
    batch.start()
    with pytest.raises(ZeroDivisionError):
        cycles_of(batch, progress=raising(0, ZeroDivisionError))
    with pytest.raises(InputError, match="cannot be copied"):
        (copy.copy, copy.deepcopy, pickle.dumps)[rng.integers(3)](batch)
    with pytest.raises(InputError, match="no state yet"):
        cycles_of(other)
    batch.start()
    assert cycles_of(batch) == undisturbed
    assert "on the thread that called" in str(in_thread(batch.start))


_INTERRUPTED = """
import signal, sys
import numpy as np
from tests.attack.test_sessions import KINDS, alone, bits, made
from taichi_dem import runtime

def interrupt(*_):
    raise KeyboardInterrupt

rng = np.random.default_rng(int(sys.argv[1]))
runtime.start(threads=2)
signal.signal(signal.SIGALRM, interrupt)
for kind in rng.permutation(len(KINDS))[:2].tolist():
    signal.setitimer(signal.ITIMER_REAL, float(rng.uniform(0.001, rng.choice([0.03, 0.3, 1.0]))))
    try:
        simulation = made(kind, str(rng.choice(["resident", "parallel"])))
        simulation.advance_to(20)
        undisturbed = bits(simulation) == alone(kind, 20)
    except KeyboardInterrupt:
        undisturbed = True
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    assert undisturbed
    again = made(kind)
    again.advance_to(20)
    assert bits(again) == alone(kind, 20)
    alone.cache_clear()
print("survived")
"""


def run_apart(text, *arguments):
    """Run a program in a process of its own; returns it as it ended."""
    command = [sys.executable, "-c", text, *map(str, arguments)]
    environment = users_environment(PYTHONPATH=str(ROOT))
    options = {"capture_output": True, "text": True, "timeout": 120}
    return subprocess.run(command, cwd=ROOT, env=environment, **options)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer that interrupts")
def test_an_interrupt_at_any_moment_leaves_the_session_whole(seed):
    done = run_apart(_INTERRUPTED, seed)
    assert done.stdout.splitlines()[-1:] == ["survived"], done.stderr


_FORKED = """
import multiprocessing, os, sys
from tests.attack.test_sessions import made
from taichi_dem import InputError, runtime

def used():
    try:
        made(0).advance_to(1)
    except InputError as error:
        return str(error)

if __name__ == "__main__":
    runtime.start(threads=2)
    made(0).advance_to(1)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        print(pool.apply_async(used).get(60))
    child = os.fork()
    if child == 0:
        for call in (runtime.start, runtime.stop, runtime.clear):
            try:
                call()
            except InputError as error:
                print(error, flush=True)
        sys.exit(5)
    print(os.WEXITSTATUS(os.waitpid(child, 0)[1]))
    made(0).advance_to(1)
    print("survived")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="forks")
def test_a_fork_is_refused_in_words_and_ends():
    done = run_apart(_FORKED)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("[Taichi]")]
    assert lines[-2:] == ["5", "survived"], done.stderr
    assert len(lines) == 6 and all("before this process was forked" in line for line in lines[:4])


def test_a_simulation_cut_short_refuses_to_go_on_until_it_is_reset(monkeypatch):
    simulation = made(1)
    simulation.advance_to(3)
    driver = type(simulation.driver._part())

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(driver, "run", interrupted)
        with pytest.raises(KeyboardInterrupt):
            simulation.advance_to(5)
    with pytest.raises(InputError, match="was interrupted while it stepped"):
        simulation.advance_to(6)
    simulation.reset()
    simulation.advance_to(6)
    fresh = Simulation(scene(1), METHOD)
    fresh.advance_to(6)
    assert bits(simulation) == bits(fresh)


def test_two_hundred_simulations_take_the_memory_of_one():
    made(0).advance_to(1)
    trees, size = allocation.tree_count(), allocation.field_bytes()
    for number in range(200):
        made(number % 2).advance_to(1)
    assert allocation.tree_count() <= trees + 1
    assert allocation.field_bytes() <= 2 * max(size, 1)


@ti.data_oriented
class Frozen(effects.Gravity):
    """Has a number that its kernel reads from the host, so that each value is compiled anew."""

    def __init__(self, factor):
        super().__init__()
        self.factor = factor

    @ti.func
    def wrench(self, i, motion):
        force, torque = effects.Gravity.wrench(self, i, motion)
        return self.factor * force, torque


def test_idle_engines_make_way_where_taichi_has_no_room_for_another(monkeypatch):
    monkeypatch.setattr(allocation, "MOST_TREES", allocation.tree_count() + 1)
    used = [made(0)]
    for number in range(2):
        simulation = Simulation(Scene(pair(), CONCRETE, [Frozen(float(number))]), METHOD)
        simulation.advance_to(2)
        # Gravity alone, over two steps from rest.
        speed = simulation.motion()["velocity"][:, 1]
        np.testing.assert_allclose(speed, -9.81 * number * 2e-8, rtol=1e-12, atol=1e-25)
    used[0].advance_to(3)
    assert bits(used[0]) == alone(0, 3)


def test_a_lack_of_memory_is_one_sentence_and_frees_what_is_idle(monkeypatch):
    runtime.clear()
    kept = made(0)
    Simulation(scene(2), METHOD)
    assert ENGINES.count == 2
    larger = Scene(pair(), CONCRETE, [effects.Softening()])
    with monkeypatch.context() as patched:
        patched.setattr(allocation, "available_bytes", lambda: 1000.0)
        with pytest.raises(InputError, match=r"needs .* GB of memory.*: take a smaller mesh"):
            Simulation(larger, METHOD)
    assert ENGINES.count == 1
    Simulation(larger, METHOD).advance_to(3)
    kept.advance_to(3)
    assert bits(kept) == alone(0, 3)
