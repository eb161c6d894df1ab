"""Whatever is done to a session, in any order, it works with the same bits or refuses in words."""

import signal
from functools import cache, partial

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.mesh.shapes import pair

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
        effect = faulty(self.rng.choice(["declare", "upload"]))
        with pytest.raises((InputError, ZeroDivisionError)):
            Simulation(Scene(pair(), CONCRETE, [effect]), METHOD)

    def interrupt(self):
        """A run of its own that an interrupt ends at any moment, or never."""
        kind, longest = self.rng.integers(len(KINDS)), self.rng.choice([0.03, 0.3, 1.0])
        signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, self.rng.uniform(0.001, longest))
        try:
            simulation = made(int(kind), self.driver)
            simulation.advance_to(20)
        except KeyboardInterrupt:
            return
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        assert bits(simulation) == alone(int(kind), 20)

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


OPERATIONS = ("make", "run", "fail", "use_old", "interrupt")


# An interrupt may come while Python frees an object, which tells of it by a warning.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_any_order_of_operations_works_with_the_same_bits_or_is_refused(seed):
    rng = np.random.default_rng(seed)
    session, first, then = Session(rng), rng.choice(OPERATIONS, 8), rng.choice(OPERATIONS, 6)
    for operation in ("make", "make", *first, "end", "use_old", *then, "make", "run"):
        getattr(session, operation)()
