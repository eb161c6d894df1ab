"""Whatever is done to a session, in any order, it works with the same bits or refuses in words."""

import subprocess
import sys
from functools import cache, partial

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.mesh.shapes import pair
from tests.processes import users_environment
from tests.scenes import ROOT

pytestmark = pytest.mark.attack

#: Effects by kind of scene; the first two share a structure.
KINDS = ((effects.Gravity(),), (effects.Gravity((9.0, 0.0, 0.0)),), (effects.BondDamping(),))
METHOD = Uniform(1e-8)


@cache
def faulty(hook):
    """An effect that fails while its fields are declared, or filled."""

    def fail(self, given):
        if hook == "declare":
            ti.field(ti.f64, shape=3)
        raise ZeroDivisionError

    return type("Faulty", (effects.Gravity,), {hook: fail})()


def made(kind, driver="resident"):
    """A simulation in which something happens from the first step on."""
    simulation = Simulation(Scene(pair(), CONCRETE, KINDS[kind]), METHOD, driver)
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


class Session:
    """Random operations on the session of this process. stale: simulations that must refuse."""

    def __init__(self, rng):
        self.rng, self.live, self.stale = rng, [], []
        self.driver = str(rng.choice(["resident", "parallel"]))

    def make(self):
        kind = int(self.rng.integers(len(KINDS)))
        self.live.append([kind, 0, made(kind, self.driver)])

    def run(self):
        """Some steps more, which must have the bits of an undisturbed run."""
        if self.live:
            entry = self.live[self.rng.integers(len(self.live))]
            entry[1] += int(self.rng.integers(1, 8))
            entry[2].advance_to(entry[1])
            assert bits(entry[2]) == alone(entry[0], entry[1])

    def fail(self):
        """An effect that fails in one way or another."""
        effect = faulty(self.rng.choice(["declare", "load"]))
        with pytest.raises((InputError, ZeroDivisionError)):
            Simulation(Scene(pair(), CONCRETE, [effect]), METHOD)

    def use_old(self):
        """Each use of a simulation of another session is refused in words."""
        for old in self.stale:
            for use in (partial(old.advance_to, 5), old.report, old.reset):
                with pytest.raises(InputError, match=r"session|given back"):
                    use()

    def end(self):
        """End the session in one of three ways, and begin another."""
        self.stale += [simulation for _, _, simulation in self.live]
        self.live.clear()
        way = self.rng.integers(3)
        if way == 0:
            runtime.clear()
        elif way == 1:
            runtime.stop()
        else:
            ti.init(arch=ti.cpu, default_fp=ti.f32, fast_math=True, log_level=ti.ERROR)
            with pytest.raises(InputError, match="start and stop Taichi by"):
                made(0)
        runtime.start(threads=2)


OPERATIONS = ("make", "run", "fail", "use_old")


def test_any_order_of_operations_works_with_the_same_bits_or_is_refused(seed):
    rng = np.random.default_rng(seed)
    session, first, then = Session(rng), rng.choice(OPERATIONS, 8), rng.choice(OPERATIONS, 6)
    for operation in ("make", "make", *first, "end", "use_old", *then, "make", "run"):
        getattr(session, operation)()


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


def test_an_interrupt_at_any_moment_leaves_the_session_whole(seed):
    line = [sys.executable, "-c", _INTERRUPTED, str(seed)]
    options = {"capture_output": True, "text": True, "timeout": 120}
    done = subprocess.run(line, cwd=ROOT, env=users_environment(PYTHONPATH=ROOT), **options)
    assert done.stdout.splitlines()[-1:] == ["survived"], done.stderr
