"""The same bits over more than 1e5 steps with fracture and contact: drivers and threads."""

import functools

import pytest
import taichi as ti

from taichi_dem import Simulation, runtime
from taichi_dem.kit.checkpoint import digest
from taichi_dem.kit.field_memory import FieldMemory
from tests.bar_blast import METHODS, bar_scene

#: Largest steps; they have a hundred thousand substeps.
STEPS = 3400


def bits(driver):
    """Digest of all that the run says about bodies and bonds; substeps, broken bonds, pairs."""
    simulation = Simulation(bar_scene(), METHODS["uniform"], driver)
    simulation.advance_to(STEPS)
    fields = FieldMemory(simulation).read()
    names = [name for name in sorted(fields) if name.split(".")[0] in ("state", "model")]
    report = simulation.report()
    counts = report.substeps, report.broken_faces, report.pair_evaluations
    account = simulation.energy_balance.account()
    return digest(*(fields[name] for name in names), list(account.values())), counts


@pytest.mark.slow
def test_drivers_and_threads_change_no_bit_in_a_hundred_thousand_steps(monkeypatch):
    """Taichi would leave loops of fewer than 512 members to one thread: here 16 go to each."""
    found = [bits("resident")]
    spread = {"make_cpu_multithreading_loop": False, "cpu_block_dim_adaptive": False}
    start = functools.partial(ti.init, default_cpu_block_dim=16, **spread)
    monkeypatch.setattr(ti, "init", start)
    for threads in (1, 2):
        runtime.stop()
        runtime.start(threads=threads)
        found.append(bits("parallel"))
    runtime.stop()
    (substeps, broken, pairs) = found[0][1]
    assert substeps > 100_000
    assert broken > 10
    assert pairs > 100_000
    assert found[1:] == [found[0]] * 2
