"""Structures with boxes: against one oscillator, exact motions, hand-made blows, and themselves."""

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Box,
    ModalStructure,
    Oscillator,
    RigidMass,
    SceneTable,
    Spheres,
    excitation,
    shake,
    shake_structure,
)
from ca_damper.engine.modal_mount import ModalMount
from ca_damper.excitation import Excitation, SineForce
from tests.ca_modes.frames import Linear, frame, on_base, two_storeys

#: Largest error of the spline of a Signal as a share of its amplitude (tests/ca_excitation).
SPLINE = 3e-6
SINES = ((2.0, 1e-3, 0.0), (4.5, 0.3e-3, 0.7))
MASS = 0.2e-3


def base_motion(sines=SINES, duration=2.0):
    frequencies, amplitudes, phases = zip(*sines)
    return excitation.sines(frequencies, amplitudes, duration, phases=phases)


def still(duration):
    return excitation.sines(1.0, 0.0, duration)


def shaken(structure, boxes, motion, filling=None, **options):
    filling = RigidMass(MASS, gravity=0.0) if filling is None else filling
    return shake_structure(
        filling, structure, boxes, motion, **{"seeds": 1, "interval": 2e-3, **options}
    )


def amplification(structure, added=None):
    return np.abs(structure.transfer(np.linspace(0.0, 12.0, 24001), added)).max()


@pytest.mark.parametrize(
    "filling", [RigidMass(), pytest.param(Automaton(), marks=pytest.mark.slow)]
)
def test_one_mode_at_one_place_is_the_oscillator(filling):
    """The same equations in the same unit: only roundings differ, 1e-16 of the motion a step."""
    o, motion = Oscillator(), base_motion(duration=0.5)
    one = ModalStructure([o.mass], [o.natural_frequency], o.damping_ratio, [[o.mass**-0.5]])
    alone = shake(filling, motion, particles=20, seeds=[3])
    made = shake_structure(filling, one, Box(0, 20), motion, seeds=[3])
    for name in ("x", "v", "force"):
        wanted = getattr(alone, name)[:, 0]
        error = np.abs(getattr(made, name)[:, 0] - wanted).max()
        # 5000 steps.
        assert error < 5000 * 1e-16 * np.abs(wanted).max(), (name, error)
    assert made.rms == pytest.approx(alone.rms, rel=1e-12)
    assert made.peak == pytest.approx(alone.peak, rel=1e-12)


@pytest.mark.slow
def test_three_modes_under_base_and_force_move_as_the_exact_solution():
    """With masses in two boxes, of which one place has none, and their weight from t = 0 on."""
    structure, pushed = frame(), (3.1, 0.05, 0.4)
    force = SineForce(pushed[1], pushed[0], pushed[2])
    boxes = [Box(2, 300), Box(0, 200)]
    added = np.array([200.0, 0.0, 300.0]) * MASS
    for moving in (False, True):
        motion = base_motion() if moving else still(2.0)
        made = shaken(
            *(structure, boxes, Excitation(motion, force), RigidMass(MASS, gravity=9.8)),
            force_place=1,
        )
        sines = SINES if moving else ()
        wanted = on_base(structure, sines, added, [(*pushed, 1)], -9.8 * added)
        x, v = wanted.at(made.time_s)
        # RK45 is exact to (w dt)^6 = 2e-15 here; 20000 roundings.
        allowed = 3e-12 * np.abs(x).max()
        if moving:
            allowed += SPLINE * amplification(structure, added) * sum(a for _, a, _ in SINES)
        assert np.abs(made.x[:, :, 0] - x).max() < allowed
        assert np.abs(made.v[:, :, 0] - v).max() < 2.0 * np.pi * 6.0 * allowed
        fine = wanted.at(np.arange(20001) * 1e-4)[0]
        assert made.rms[:, 0] == pytest.approx(fine[:-1].std(axis=0), rel=1e-4)
        assert made.peak[:, 0] == pytest.approx(np.abs(fine).max(axis=0), rel=1e-4)


def test_modes_left_out_move_with_the_base():
    """Kept modes, from the base: (1 + S'A S) u'' + C u' + W u = -S'(M + A) 1 y''."""
    structure, added = frame(2), np.array([0.0, 0.04, 0.06])
    made = shaken(structure, [Box(1, 200), Box(2, 300)], base_motion())
    s, total = structure.shapes, structure.masses + np.diag(added)
    omega = 2.0 * np.pi * structure.frequencies
    matrices = (
        np.eye(2) + s.T @ np.diag(added) @ s,
        np.diag(2.0 * omega * structure.damping_ratios),
        np.diag(omega**2),
    )
    share = s.T @ total @ np.ones(3)
    pulls = [(f, a * np.exp(1j * phase) * (2.0 * np.pi * f) ** 2 * share) for f, a, phase in SINES]
    # The structure is at rest in the room: u = -G y and u' = -G y' at the beginning.
    y0 = sum(a * np.sin(phase) for _, a, phase in SINES)
    w0 = sum(a * 2.0 * np.pi * f * np.cos(phase) for f, a, phase in SINES)
    g = structure.participation
    relative, _ = Linear(matrices, pulls, -g * y0, -g * w0).at(made.time_s)
    y = sum(a * np.sin(2.0 * np.pi * f * made.time_s + phase) for f, a, phase in SINES)
    wanted = y[:, None] + relative @ s.T
    allowed = SPLINE * amplification(structure, added) * sum(a for _, a, _ in SINES)
    assert np.abs(made.x[:, :, 0] - wanted).max() < 2.0 * allowed
    assert made.modal[:, :, 0] == pytest.approx(relative, abs=20.0 * allowed)


def test_steady_state_is_that_of_the_transfer_function():
    """After 60 time constants of the slowest mode; harmonics by a whole number of cycles."""
    matrices = np.array([[800.0, -400.0], [-400.0, 400.0]])
    heavy = ModalStructure.from_matrices([0.2, 0.15], matrices, [0.3, 0.3])
    made = shaken(heavy, Box(1, 100), base_motion(((4.0, 1e-3, 0.0),), 4.0), interval=1 / 64)
    late = made.time_s > 3.0 - 1e-9
    wave = np.exp(-2j * np.pi * 4.0 * made.time_s[late][:-1])
    measured = 2j * (made.x[late][:-1, :, 0] * wave[:, None]).mean(axis=0) / 1e-3
    wanted = heavy.transfer(4.0, [0.0, 100 * MASS])
    assert measured == pytest.approx(wanted, rel=2.0 * SPLINE)


def zero_order_hold(structure, history):
    """Exact motion of the places under the recorded forces, each constant over its step."""
    dt = history.time_s[1] - history.time_s[0]
    omega, z = 2.0 * np.pi * structure.frequencies, structure.damping_ratios
    decay, turn = z * omega, omega * np.sqrt(1.0 - z**2)
    c, s = np.exp(-decay * dt) * np.cos(turn * dt), np.exp(-decay * dt) * np.sin(turn * dt) / turn
    rows = structure.shapes[[box.place for box in history.boxes]]
    p, v = (structure.modal(start[0, :, 0]) for start in (history.x, history.v))
    found = [p]
    for force in history.force[1:, :, 0]:
        rest = rows.T @ force / omega**2
        p, v = (
            rest + (c + decay * s) * (p - rest) + s * v,
            (c - decay * s) * v - omega**2 * s * (p - rest),
        )
        found.append(p)
    return np.array(found) @ structure.shapes.T


def test_places_move_by_the_forces_of_both_boxes():
    """Spheres push evenly over a step, so that the motion under their forces has a closed form."""
    structure = two_storeys()
    made = shaken(
        *(structure, [Box(1, 15), Box(0, 8)], still(0.3), Spheres()),
        displacement=[8e-3, 12e-3],
        velocity=[0.3, -0.1],
        interval=2e-5,
    )
    assert made.report.dt_s[0] == pytest.approx(made.time_s[1])
    impulses = np.abs(made.force).sum(axis=0) * 2e-5
    assert (impulses > 2e-3).all()
    assert np.abs(made.x[:, :, 0] - zero_order_hold(structure, made)).max() < 1e-13
    assert made.report.momentum_error < 1e-12


def test_fillings_see_the_acceleration_without_impacts():
    """That of springs and dashpots, a = -phi (w^2 p + 2 z w p'), in a step with impacts."""
    structure, motion = two_storeys(), still(0.3)
    table = SceneTable([15, 8], [1, 2], 2e-5, 1 / 0.3)
    batch = Batch(
        *(Spheres(), table),
        **{"structure": ModalMount(structure, [1, 0]), "excitation": motion},
        recorded_samples=1,
    )
    batch.start(displacement=[12e-3, 8e-3])
    recoil = batch.engine.table.in_use(batch.engine.table.recoil)
    assert recoil == pytest.approx([structure.recoil(1), structure.recoil(0)], rel=1e-14)
    omega, struck = 2.0 * np.pi * structure.frequencies, np.zeros(2, dtype=bool)
    rates = 2.0 * structure.damping_ratios * omega
    for _ in range(60):
        batch.advance(100)
        now = batch.sample()
        p, speed = (structure.modal(now[name][::-1]) for name in ("x", "v"))
        wanted = -structure.shapes @ (omega**2 * p + rates * speed)
        # Nearly all of it cancels where springs are slack: 1e-12 of the 30 m/s^2 that act.
        assert now["a"][::-1] == pytest.approx(wanted, abs=3e-11)
        struck |= np.abs(now["force"]) > 0.01
    assert struck.all()


@pytest.mark.slow
def test_a_grain_strikes_a_structure_of_two_modes():
    """m and the place, seen as of mass 1 / recoil, exchange J = (1 + e) m V / (1 + m recoil).

    After it p_k = phi_bk J sin(w_d t) exp(-z w t) / w_d, from the middle of the blow on: as it
    lasts, up to (w T)^2 / 24 of it is missing in mode k, and the springs take w T of J.
    """
    structure, m, speed = two_storeys(), 50e-3, 0.4
    grain = Spheres(
        *("tsuji", 0.75, 0.6),
        **{"gravity": 0.0, "particle_mass": m},
        start=((0.03, 0.003 + 0.5e-3),),
        start_velocity=((0.0, -speed),),
    )
    made = shaken(structure, Box(1, 1), still(0.06), grain, interval=4e-6, dt=4e-6)
    force, dt = made.force[1:, 0, 0], 4e-6
    impulse, struck = force.sum() * dt, np.flatnonzero(force)
    lasting = (struck[-1] - struck[0] + 1) * dt
    assert 100 * dt < lasting < 2e-3
    wanted = -1.6 * m * speed / (1.0 + m * structure.recoil(1))
    omega = 2.0 * np.pi * structure.frequencies
    # The spheres' step is of first order.
    assert impulse == pytest.approx(wanted, rel=dt / lasting)
    middle = (force * (np.arange(len(force)) + 0.5) * dt).sum() / force.sum()
    since = made.time_s - middle
    after = since > lasting
    decay, turn = (
        structure.damping_ratios * omega,
        omega * np.sqrt(1.0 - structure.damping_ratios**2),
    )
    free = np.exp(-np.outer(since, decay)) * np.sin(np.outer(since, turn)) / turn
    x = impulse * (free * structure.shapes[1]) @ structure.shapes.T
    error = np.abs(made.x[after, :, 0] - x[after]).max()
    assert error < (omega[1] * lasting) ** 2 / 24.0 * np.abs(x[after]).max()
    assert np.abs(x[after]).max() > 1e-3


@pytest.mark.parametrize("filling", [Automaton(), Spheres()])
def test_momentum_closes_in_every_box(filling):
    made = shaken(
        two_storeys(), [Box(1, 20), Box(0, 40), Box(1, 3)], base_motion(duration=0.4), filling
    )
    assert made.report.momentum_error < 1e-9
    assert made.force.shape == (201, 3, 1)


def test_masses_in_boxes_of_one_place_add_up():
    few, start = base_motion(duration=0.5), {"displacement": [1e-3, -2e-3], "velocity": 0.1}
    together, apart = (
        shaken(two_storeys(), boxes, few, **start)
        for boxes in ([Box(1, 50)], [Box(1, 20), Box(1, 30)])
    )
    assert together.x[0, :, 0] == pytest.approx([1e-3, -2e-3], abs=1e-17)
    assert apart.x == pytest.approx(together.x, abs=1e-14)
    assert apart.force.sum(axis=1) == pytest.approx(together.force[:, 0], abs=1e-12)


def test_order_of_boxes_changes_no_bit():
    """Two forces have one sum in either order; seeds of their own tell the boxes apart."""
    boxes, motion = [Box(1, 20, seed=7), Box(0, 10, seed=9)], base_motion(duration=0.4)
    for filling in (Automaton(), Spheres()):
        one, other = (
            shaken(two_storeys(), these, motion, filling) for these in (boxes, boxes[::-1])
        )
        assert np.array_equal(one.x, other.x)
        assert np.array_equal(one.force, other.force[:, ::-1])


def permuted(structure, order):
    mass = structure.masses[np.ix_(order, order)]
    shapes = structure.shapes[order]
    return ModalStructure(mass, structure.frequencies, structure.damping_ratios, shapes)


@pytest.mark.parametrize("order", [[2, 0, 1], [1, 0, 2]])
def test_numbers_of_places_are_names(order):
    structure, motion = frame(2), base_motion(duration=1.0)
    one = shaken(structure, [Box(0, 100), Box(2, 300)], motion)
    to = {place: k for k, place in enumerate(order)}
    other = shaken(permuted(structure, order), [Box(to[0], 100), Box(to[2], 300)], motion)
    assert other.x == pytest.approx(one.x[:, order], abs=1e-14)
    assert other.rms == pytest.approx(one.rms[order], rel=1e-9)


def test_a_structure_held_at_both_ends_moves_as_its_mirror_image():
    stiffness = 500.0 * (2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    structure = ModalStructure.from_matrices([0.3, 0.5, 0.3], stiffness, 0.01, modes=2)
    motion = base_motion(duration=0.4)
    left, right = (
        shaken(structure, [Box(place, 20, seed=3)], motion, RigidMass(MASS)) for place in (0, 2)
    )
    assert right.x[:, ::-1] == pytest.approx(left.x, abs=1e-14)
    assert np.abs(left.x[:, 0] - left.x[:, 2]).max() > 1e-6


def test_a_shape_of_the_other_sign_is_the_same_mode():
    structure, motion = two_storeys(), base_motion(duration=0.4)
    turned = ModalStructure(
        *(structure.masses, structure.frequencies, structure.damping_ratios),
        structure.shapes * [1.0, -1.0],
    )
    one, other = (shaken(each, Box(1, 20), motion, Automaton()) for each in (structure, turned))
    # A change of sign is exact in every product and sum.
    assert np.array_equal(one.x, other.x)
