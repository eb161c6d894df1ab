"""Friction with history: what holds, what slides, energy, and bits that may not change."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ca_damper import Batch, SceneTable
from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import pair_numbers, shear_ratio, wall_numbers
from taichi_dem import Checkpoint
from tests.ca_spheres.rig import Rig

G, DT, MASS, RADIUS, MU = 9.8, 2e-5, 0.2e-3, 3e-3, 0.5
HISTORY = {"friction_law": "history"}
SIDE_BY_SIDE = [(0.027, 0.05), (0.033, 0.05)]
SHAKEN = {"dt": DT, "frequency": 6.0, "amplitude": 0.02}


def test_ratio_of_stiffnesses_is_mindlins():
    assert shear_ratio(1e9, 0.3, 1e9, 0.3) == pytest.approx(2.0 * 0.7 / 1.7)
    # A rigid partner counts in neither direction.
    assert shear_ratio(1e9, 0.3, 1e30, 0.0) == pytest.approx(2.0 * 0.7 / 1.7)


def pile(gap, rotation, **law):
    """Two spheres on the floor, a gap [m] apart, and one on top of both."""
    half = RADIUS + 0.5 * gap
    top = RADIUS + np.sqrt(4.0 * RADIUS**2 - half**2)
    places = [(0.03 - half, RADIUS), (0.03 + half, RADIUS), (0.03, top)]
    return Rig(Spheres(start=places, rotation=rotation, **law), 3, DT)


@pytest.mark.parametrize("rotation", [False, True])
@pytest.mark.parametrize("gap", [1e-6, 1e-3])
def test_a_pile_of_three_stands(gap, rotation):
    """What moves it at rest is rounding: of places, 2e-18 m in each of 125,000 steps.

    Springs carry what is left of slip in the first half second, e^-10 and less of it. Friction by
    slip lets the pile sink by 80 um a second, and collapse in 3 s with rotation.
    """
    rig = pile(gap, rotation, **HISTORY).run(25_000)
    before = rig.state()[0]
    place, velocity = rig.run(125_000).state()
    assert np.abs(place - before).max() < 125_000 * 2e-18
    assert np.abs(velocity).max() < 1e-12
    assert rig.divergence_code() == 0
    creeping = pile(gap, False).run(25_000)
    height = creeping.state()[0][2, 1]
    assert creeping.run(50_000).state()[0][2, 1] < height - 5e-5


def on_a_slope(angle, rotation=False):
    """A sphere on a floor that is tilted by an angle with tan = its share of the friction."""
    gravity = (G * np.sin(angle), G * np.cos(angle))
    filling = Spheres(gravity=gravity, start=[(0.005, RADIUS)], rotation=rotation, **HISTORY)
    return Rig(filling, 1, DT), gravity


@pytest.mark.parametrize("share", [0.2, 0.9, 0.98])
def test_a_block_holds_on_a_slope_below_the_angle_of_friction(share):
    rig, (across, _) = on_a_slope(np.arctan(share * MU))
    before = rig.run(10_000).state()[0][0]
    place, velocity = (array[0] for array in rig.run(50_000).state())
    assert np.abs(place - before).max() < 50_000 * 2e-18
    assert np.abs(velocity).max() < 1e-12
    # It slips in the first blows only, which last for less than a millisecond.
    assert 0.0 < place[0] - 0.005 < 0.5 * across * 1e-6


@pytest.mark.parametrize("share", [1.05, 1.5, 4.0])
def test_a_block_slides_above_it_with_what_friction_leaves(share):
    """Friction is mu times the push in each step, to a rounding: so are their sums."""
    rig, (across, down) = on_a_slope(np.arctan(share * MU))
    (before,) = rig.run(1500).state()[1]
    (after,) = rig.run(2500).state()[1]
    push = down * 2500 * DT + after[1] - before[1]
    assert after[0] - before[0] == pytest.approx(across * 2500 * DT - MU * push, abs=1e-12)
    # It has come to rest on the floor, as far as this: g (sin - mu cos).
    expected = (across - MU * down) * 2500 * DT
    assert after[0] - before[0] == pytest.approx(expected, rel=1e-3)


def test_a_sphere_rolls_down_a_slope_at_five_sevenths():
    """m a = m g sin - F and (2/5) m r^2 a / r = F r, with the lever shorter by the overlap.

    It rolls while F = (2/7) m g sin stays below mu m g cos.
    """
    rig, (across, _) = on_a_slope(np.arctan(0.5 * MU), rotation=True)
    (before,) = rig.run(2500).state()[1]
    (after,) = rig.run(2500).state()[1]
    assert (after[0] - before[0]) / (2500 * DT) == pytest.approx(5.0 / 7.0 * across, rel=1e-3)


def test_a_change_of_step_leaves_a_spring_as_it_is():
    rig, _ = on_a_slope(np.arctan(0.9 * MU))
    before = rig.run(10_000).state()[0][0]
    for dt in (1e-5, 2e-5, 3e-6):
        rig.drive(6.0, dt)
        rig.run(2000)
        assert np.abs(rig.state()[0][0] - before).max() < 1e-14


def sticking_blow(speed, across, **numbers):
    """Motion of a sphere in an elastic blow on a wall without slip, by the law in continuous time.

    F' = k_t s' while the overlap d grows, and F' = k_t s' + F d' / (2 d) while it shrinks.
    """
    k, shear = numbers["stiffness"], 1.5 * numbers["shear_ratio"] * numbers["stiffness"]

    def rates(_, y):
        d, rate, slip, force = y
        d = max(d, 1e-15)
        fade = 0.5 * force * min(rate, 0.0) / d
        return [rate, -k * d**1.5 / MASS, -force / MASS, shear * np.sqrt(d) * slip + fade]

    def parting(_, y):
        return y[0] - 1e-12 if y[1] < 0.0 else 1.0

    parting.terminal = True
    start, options = [1e-12, speed, across, 0.0], {"rtol": 1e-10, "atol": 1e-14}
    return solve_ivp(rates, (0.0, 1e-3), start, events=parting, **options).y[:, -1]


def thrown_at_the_floor():
    """A sphere that sticks in an elastic blow, and its speed across the normal after it [m/s]."""
    speed, across = 0.5, 0.2
    options = {"restitution": 1.0, "wall_restitution": 1.0, "wall_friction": 100.0}
    start = {"start": [(0.03, RADIUS + 1e-4)], "start_velocity": [(across, -speed)]}
    filling = Spheres(gravity=0.0, **options, **start, **HISTORY)
    return filling, sticking_blow(speed, across, **wall_numbers(filling))[2]


def test_a_blow_that_sticks_follows_the_law():
    """At falling steps the error falls with them, and the law is that in continuous time."""
    filling, expected = thrown_at_the_floor()
    errors = []
    for dt in (4e-6, 2e-6, 1e-6, 5e-7):
        rig = Rig(filling, 1, dt).run(round(1e-3 / dt))
        errors.append(abs(rig.state()[1][0, 0] - expected))
    assert abs(expected) > 0.1
    assert errors[-1] < 0.3 * errors[0]
    assert errors[-1] < 2e-3 * 0.2


@pytest.mark.parametrize("steps", [60, 74])
def test_a_change_of_step_within_a_blow_stretches_its_spring_by_the_way(steps):
    """The blow begins with steps of 4 us and ends with 0.4 us: errors between those of both.

    A way that is counted as if there were no change leaves these bounds, by up to twice.
    """
    filling, expected = thrown_at_the_floor()
    coarse = Rig(filling, 1, 4e-6).run(300).state()[1][0, 0] - expected
    rig = Rig(filling, 1, 4e-6).run(steps)
    assert rig.state()[0][0, 1] < RADIUS - 1e-5
    rig.drive(6.0, 4e-7)
    error = rig.run(1000).state()[1][0, 0] - expected
    assert 0.0 < error / coarse < 1.0


def test_a_sphere_that_comes_back_to_a_wall_has_no_spring_left():
    """Its second blow has the bits of one of a sphere that starts from the flight between both."""
    # Without a dashpot the push, and so the spring, lasts to the last step of a blow.
    options = {"start": [(0.01, 0.004)], "start_velocity": [(0.1, -0.3)], "wall_restitution": 1.0}
    filling = Spheres(**options, **HISTORY)
    rig = Rig(filling, 1, DT, seed=[1, 1])
    springs = rig.device.history.wall_spring
    while not springs[0, 2][0]:
        rig.run(1)
    rig.run(100)
    bodies = rig.device.bodies
    for field in (bodies.position, bodies.velocity):
        field[bodies.stride] = field[0]
    rig.device.history.wall_step[bodies.stride] = -3
    for wall in range(4):
        springs[bodies.stride, wall] = [0.0, 0.0]
    (first, second), (velocity, other) = rig.run(5000).states()
    assert np.array_equal(first, second)
    assert np.array_equal(velocity, other)


@pytest.mark.parametrize("rotation", [False, True])
def test_springs_only_keep_and_lose_energy(rotation):
    """Elastic blows of rough spheres: all of the motion's energy, and what springs hold, falls.

    The leapfrog errs by (w dt)^2 / 4 in a contact; the frequency w of the tangential spring is up
    to sqrt(0.82 x 7/2) times that of the normal one, half a period in 23 steps of 5e-6 s.
    """
    options = {"restitution": 1.0, "wall_restitution": 1.0, "friction": 0.3, "wall_friction": 0.3}
    rig = Rig(Spheres(gravity=0.0, rotation=rotation, **options, **HISTORY), 12, 5e-6)
    rng = np.random.default_rng(5)
    rig.throw(rng.uniform(-0.5, 0.5, (12, 2)))
    energy = [rig.run(4).energy() for _ in range(5000)]
    bound = 0.25 * (np.pi / 23.0) ** 2 * 0.82 * 3.5
    assert np.maximum.accumulate(energy[::-1])[::-1][0] <= energy[0] * (1.0 + bound)
    lowest = np.minimum.accumulate(energy)
    assert ((energy - lowest) < bound * energy[0]).all()
    assert energy[-1] < 0.9 * energy[0]
    assert rig.divergence_code() == 0


@pytest.mark.parametrize("particles", [1, 2])
def test_energy_holds_what_the_springs_store(particles):
    """In the middle of a blow that sticks, most of the tangential motion is in the spring.

    On the floor, or of two spheres on each other.
    """
    rough = {"wall_restitution": 1.0, "wall_friction": 100.0, "restitution": 1.0, "friction": 100.0}
    places = [(0.03, RADIUS)] if particles == 1 else SIDE_BY_SIDE
    speeds = [(0.2, -0.2)] if particles == 1 else [(0.1, 0.1), (-0.1, -0.1)]
    start = {"start": places, "start_velocity": speeds}
    rig = Rig(Spheres(gravity=0.0, **rough, **start, **HISTORY), particles, 1e-6)
    first = rig.energy()
    least, before = first, rig.state()[1][0]
    while rig.done < 400:
        velocity = rig.run(1).state()[1]
        least = min(least, 0.5 * MASS * (velocity**2).sum())
        if velocity[0] @ before > 0.0:
            # As the overlap grows a spring loses F^2 / 2 (1/k - 1/k'), which is heat.
            assert 0.8 * first < rig.energy() < 1.001 * first
    assert least < 0.2 * first


@pytest.mark.parametrize("rotation", [False, True])
@pytest.mark.parametrize("particles", [2, 50, 160])
def test_both_searches_keep_the_same_springs(particles, rotation):
    cells, pairs = (
        Rig(Spheres(search=search, rotation=rotation, **HISTORY), particles, **SHAKEN).run(20_000)
        for search in ("cells", "all_pairs")
    )
    for one, other in zip(cells.state(), pairs.state()):
        assert np.array_equal(one, other)
    assert cells.energy() == pairs.energy()
    assert cells.divergence_code() == 0


def test_mirrored_start_runs_mirrored_bit_for_bit():
    rig = Rig(Spheres(rotation=True, **HISTORY), 50, seed=[3, 3], **SHAKEN)
    rig.mirror(0, to=1)
    _, (velocity, turned) = (array[:, :50] for array in rig.run(20_000).states())
    assert np.array_equal(velocity * [-1.0, 1.0], turned)


def test_launches_and_neighbours_in_a_batch_change_no_bit():
    filling = Spheres(rotation=True, **HISTORY)
    together = Rig(filling, [10, 50, 33], seed=[5, 6, 7], **SHAKEN).run(6000)
    alone = Rig(filling, 50, seed=6, **SHAKEN)
    for steps in (1, 7, 1992, 4000):
        alone.run(steps)
    for one, other in zip(together.state(1), alone.state()):
        assert np.array_equal(one, other)


def test_springs_survive_a_checkpoint(tmp_path):
    """The run goes on from a file with the bits of one that was never stopped."""

    def made():
        table = SceneTable([20, 40], 1, DT, 6.0, 1e-3)
        batch = Batch(Spheres(rotation=True, **HISTORY), table, measured_cycles=2)
        batch.start()
        return batch

    checkpoint = Checkpoint(str(tmp_path / "run.npz"), every_wall_s=1e-3)
    batch = made()
    with batch.checkpointed(checkpoint, None, {"job": "test"}):
        batch.run(3, 0)
    assert (batch.engine.device.history.pair_count.to_numpy()[:2] > 0).any()
    expected = batch.run(0, 2).record
    again = made()
    with again.checkpointed(None, checkpoint.path, {"job": "test"}):
        again.run(3, 0)
    assert np.array_equal(again.run(0, 2).record, expected)


def test_friction_by_slip_has_no_springs():
    plain = Rig(Spheres(), 2, DT).device.history
    smooth = Rig(Spheres(friction=0.0, wall_friction=0.0, **HISTORY), 2, DT).device.history
    assert not plain.remembers
    assert not smooth.remembers
    assert not hasattr(plain, "pair")


def test_report_tells_the_share_of_friction():
    rig = Rig(Spheres(**HISTORY), 30, **SHAKEN).run(5000)
    for _ in range(100):
        rig.run(37)
        assert rig.divergence_code() == 0
    (friction,) = rig.device.uses(("friction",))
    assert 0.0 < friction.share < 1.0
    assert pair_numbers(rig.filling)["shear_ratio"] > 0.0
