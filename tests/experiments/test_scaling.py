"""What ``blast_scaling.py`` counts and simulates."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Multirate, Scene, effects
from taichi_dem.mesh.shapes import bar

# Two classes of ticks: all are due at the first, the last quarter also at three ticks between.
BODIES, INTERVALS, TICKS = 40, 5, (10, 30)


@pytest.fixture
def workers(script):
    """Simulated workers on a record whose prices are known: 2 s a bond and nothing else."""
    script("blast_scaling")
    from _scaling_record import Record
    from _scaling_simulate import Workers

    counts = np.zeros((INTERVALS, BODIES, 2, 3), dtype=int)
    counts[:, :, 0, 0] = TICKS[0]
    counts[:, -BODIES // 4 :, 1, 0] = TICKS[1]
    seconds = 2.0 * counts[..., 0].sum(axis=(1, 2))
    ticks = np.tile(TICKS, (INTERVALS, 1))
    # All intervals are alike: with ticks the fit could charge them instead of the bonds.
    time_s = np.arange(1, INTERVALS + 1) * 1e-6
    return Workers(Record(time_s, counts, 0 * ticks, seconds, 0 * time_s)), ticks


@pytest.mark.parametrize("way", ["static", "polyline", "rebalanced"])
def test_simulated_workers_do_all_the_work_and_wait_for_the_slowest(workers, way):
    made, _ = workers
    assert made.total == pytest.approx(
        2.0 * INTERVALS * (10 * BODIES + 30 * BODIES // 4), rel=1e-12
    )
    alone = made.share(way, 1)
    assert alone.elapsed == pytest.approx(made.total, rel=1e-12)
    for count in (2, 5, 24):
        shared = made.share(way, count)
        assert shared.seconds.sum() == pytest.approx(made.total, rel=1e-12)
        assert made.total / count <= shared.elapsed * (1.0 + 1e-12)
        assert shared.elapsed <= made.total * (1.0 + 1e-12)


def test_balance_over_an_interval_is_not_balance_at_each_tick(workers):
    """Bodies cost 10, the last ten 40, 700 in all: half is 350, after 31 of them.

    At the ticks of all the first worker then has 31 of 40, at the others the second 9 of 10. The
    fixed shares of the first interval: 39 + 38 + ... + 29 = 374 of 780, the twelfth is too much.
    """
    made, _ = workers
    shared = made.share("rebalanced", 2)
    assert shared.cuts[:2].tolist() == [[0, 11, 40], [0, 31, 40]]
    first, later = 2.0 * (10 * 29 + 30 * 10), 2.0 * (10 * 31 + 30 * 9)
    assert shared.elapsed == pytest.approx(first + (INTERVALS - 1) * later, rel=1e-12)


def test_equal_parts_of_what_is_due_leave_nobody_waiting(workers):
    """40 and 10 bonds are due at a tick: two and five workers share them without a rest."""
    made, ticks = workers
    object.__setattr__(made.record, "ticks", ticks)
    for count in (2, 5):
        shared = made.share("due", count)
        assert shared.elapsed == pytest.approx(made.total / count, rel=1e-12)
        assert shared.seconds == pytest.approx(np.full(count, made.total / count), rel=1e-12)
    # 16 workers: 3 bonds for some at the ticks of all, one at the others.
    elapsed = 2.0 * INTERVALS * (10 * 3 + 30 * 1)
    assert made.share("due", 16).elapsed == pytest.approx(elapsed, rel=1e-12)


@pytest.mark.slow
def test_counted_run_counts_what_the_schedule_does_and_changes_no_bit(script):
    """A bar that breaks under gas, by the paper's rule, counted and as it is."""
    script("blast_scaling")
    from _scaling_record import record
    from taichi_dem import Simulation

    parts = [effects.Softening(), effects.SphereContact()]
    gas = effects.GasPressure(group="left", peak=2e9, rise=4e-6)
    scene = Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, [*parts, gas])
    method, steps = Multirate(1e-8, 1e-7), 400
    made, counted = record(scene, method, steps * method.dt0, 50, lambda progress: None)
    plain = Simulation(scene, method, "resident")
    plain.advance_to(steps)
    assert counted.report().broken_faces > 0
    for name, array in counted.state.motion().items():
        assert np.array_equal(array, plain.state.motion()[name]), name
    evaluations = plain.schedule.evaluations.to_numpy()
    bonds, pairs, spheres = made.counts.sum(axis=(0, 1, 2))
    assert [made.ticks.sum(), bonds, pairs] == evaluations[[0, 2, 3]].tolist()
    assert spheres >= pairs > 0 and made.counts.shape[2] > 1
    assert len(made.time) == 8 and made.time[-1] == pytest.approx(4e-6, rel=1e-12)
