"""Recorded workloads, and simulated workers that share them."""

import numpy as np
import pytest
from scipy.optimize import nnls

from taichi_dem import CONCRETE, Multirate, Scene, Simulation, effects
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.plot_style import styled
from taichi_dem.mesh.shapes import bar
from taichi_dem.workload import Workers, Workload, record_workload
from taichi_dem.workload.picture import draw_acceleration, draw_cuts, draw_shares

# Two classes of ticks: all are due at the first, the last quarter also at three ticks between.
BODIES, INTERVALS, TICKS = 40, 5, (10, 30)


@pytest.fixture
def workers():
    """Simulated workers on a workload whose prices are known: 2 s a bond and nothing else."""
    counts = np.zeros((INTERVALS, BODIES, 2, 3), dtype=int)
    counts[:, :, 0, 0] = TICKS[0]
    counts[:, -BODIES // 4 :, 1, 0] = TICKS[1]
    seconds = 2.0 * counts[..., 0].sum(axis=(1, 2))
    ticks = np.tile(TICKS, (INTERVALS, 1))
    # All intervals are alike: with ticks the fit could charge them instead of the bonds.
    time_s = np.arange(1, INTERVALS + 1) * 1e-6
    return Workers(Workload(time_s, counts, 0 * ticks, seconds, 0 * time_s)), ticks


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
    object.__setattr__(made.workload, "ticks", ticks)
    for count in (2, 5):
        shared = made.share("due", count)
        assert shared.elapsed == pytest.approx(made.total / count, rel=1e-12)
        assert shared.seconds == pytest.approx(np.full(count, made.total / count), rel=1e-12)
    # 16 workers: 3 bonds for some at the ticks of all, one at the others.
    elapsed = 2.0 * INTERVALS * (10 * 3 + 30 * 1)
    assert made.share("due", 16).elapsed == pytest.approx(elapsed, rel=1e-12)


def test_acceleration_leaves_the_serial_share_alone(workers):
    """Of one worker's time a tenth is not shared: with waiting T, (1 + 1/9) / (T / total + 1/9)."""
    made, _ = workers
    shared = made.share("static", 5)
    assert shared.workers == 5
    assert shared.imbalance == shared.seconds.max() / shared.seconds.min()
    assert shared.acceleration() == pytest.approx(made.total / shared.elapsed, rel=1e-12)
    expected = (10.0 / 9.0) / (shared.elapsed / made.total + 1.0 / 9.0)
    assert shared.acceleration(0.1) == pytest.approx(expected, rel=1e-12)


def test_an_unknown_way_is_refused(workers):
    with pytest.raises(InputError, match=r"way must be one of static, .*, got 'fair'"):
        workers[0].share("fair", 2)


@pytest.mark.parametrize("prices", [(2e-7, 5e-7, 1e-8, 3e-6, 4e-5), (2e-7, 0.0, 1e-8, 0.0, 4e-5)])
def test_prices_are_those_that_made_the_seconds(prices):
    """The system is consistent, so that least squares gives the prices to its round-off."""
    random = np.random.default_rng(0)
    counts, ticks = random.integers(1, 100, (30, 4, 2, 3)), random.integers(1, 100, (30, 2))
    searches = random.integers(0, 9, 30)
    table = np.column_stack([counts.sum(axis=(1, 2)), ticks.sum(axis=1), searches])
    made = Workload(np.arange(30.0), counts, ticks, table @ prices, searches)
    assert made.prices() == pytest.approx(prices, rel=1e-9, abs=1e-15)


def test_prices_are_never_negative():
    """Seconds that fall with the pairs: the best price of a pair is nothing, as NNLS has it."""
    random = np.random.default_rng(1)
    counts, ticks = random.integers(1, 100, (40, 3, 2, 3)), random.integers(1, 100, (40, 2))
    work = counts.sum(axis=(1, 2))
    seconds = 1e-6 * (9.0 * work[:, 0] - 2.0 * work[:, 1] + 3e3)
    searches = np.zeros(40)
    made = Workload(np.arange(40.0), counts, ticks, seconds, searches)
    table = np.column_stack([work, ticks.sum(axis=1), searches]) / seconds[:, None]
    assert made.prices() == pytest.approx(nnls(table, np.ones(40))[0], rel=1e-6, abs=1e-12)
    assert made.prices().min() == 0.0


@pytest.mark.slow
def test_counted_run_counts_what_the_schedule_does_and_changes_no_bit():
    """A bar that breaks under gas, by the paper's rule, counted and as it is."""
    parts = [effects.Softening(), effects.SphereContact()]
    gas = effects.GasPressure(group="left", peak=2e9, rise=4e-6)
    scene = Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, [*parts, gas])
    method, steps = Multirate(1e-8, 1e-7), 400
    made, counted = record_workload(scene, method, steps * method.dt0, 50, progress=None)
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


def test_pictures_show_accelerations_shares_and_cuts(workers):
    made, _ = workers
    shared = {way: {n: made.share(way, n) for n in (1, 2, 5)} for way in ("static", "rebalanced")}
    chosen = {way: by_count[5] for way, by_count in shared.items()}
    with styled(1, 3) as (_, (gain, share, cut)):
        draw_acceleration(gain, shared, most=2, serial=0.5)
        draw_shares(share, chosen)
        draw_cuts(cut, chosen["static"], made.workload.time)
    static, _, bound = gain.lines
    assert static.get_xdata().tolist() == [1, 2] and static.get_ydata()[0] == pytest.approx(1.0)
    # Half of the time is not shared: two workers need three quarters of it at least.
    assert bound.get_ydata() == pytest.approx([1.0, 4.0 / 3.0])
    assert [line.get_ydata().mean() for line in share.lines] == pytest.approx([1.0, 1.0])
    assert len(cut.lines) == 4 and cut.get_ylim() == (0, BODIES)
