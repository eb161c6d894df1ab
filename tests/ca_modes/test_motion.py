"""Structures and their boxes against matrices, chains, an oscillator, exact motions, themselves."""

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Box,
    ModalStructure,
    Oscillator,
    RigidMass,
    Spheres,
    excitation,
    shake,
    shake_structure,
)
from ca_damper.excitation import Excitation
from ca_damper.excitation.signal import spline
from tests.ca_modes.frames import (
    MASSES,
    STIFFNESS,
    Linear,
    damping_of,
    frame,
    on_base,
    two_storeys,
)

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


def test_a_mode_that_moves_one_place_is_the_oscillator():
    """The same equations in the same unit: only roundings differ, 1e-16 of the motion a step.

    The other mode moves the other place alone.
    """
    o, motion = Oscillator(), base_motion(duration=0.5)
    own, shapes = (o.natural_frequency, 14.0), np.diag([o.mass**-0.5, 1.0])
    structure = ModalStructure([o.mass, 1.0], own, [o.damping_ratio, 0.01], shapes)
    alone = shake(RigidMass(), motion, particles=20, seeds=[3])
    made = shake_structure(RigidMass(), structure, Box(0, 20), motion, seeds=[3])
    for name in ("x", "v", "force"):
        wanted = getattr(alone, name)[:, 0]
        error = np.abs(getattr(made, name)[:, 0] - wanted).max()
        # 5000 steps.
        assert error < 5000 * 1e-16 * np.abs(wanted).max(), (name, error)
    assert made.rms[0] == pytest.approx(alone.rms[0], rel=1e-12)
    assert made.peak[0] == pytest.approx(alone.peak[0], rel=1e-12)


@pytest.mark.parametrize("moving", [True, False])
def test_all_modes_under_base_and_force_move_as_the_exact_solution(moving):
    """With masses in two boxes at one of two places, and their weight from t = 0 on."""
    structure, pushed = two_storeys(), (3.1, 0.05, 0.4)
    # The spline is off by 5 / 384 of (w h)^4, 1e-13.
    time, step = np.linspace(0.0, 2.0, 25_001, retstep=True)
    push = pushed[1] * np.sin(2.0 * np.pi * pushed[0] * time + pushed[2])
    force = spline(step, push, "push")
    added = np.array([0.0, 500.0]) * MASS
    motion = base_motion() if moving else still(2.0)
    made = shaken(
        *(structure, [Box(1, 300), Box(1, 200)], Excitation(motion, force)),
        **{"filling": RigidMass(MASS, gravity=9.8), "force_place": 0},
    )
    sines = SINES if moving else ()
    wanted = on_base(structure, sines, added, [(*pushed, 0)], -9.8 * added)
    x, v = wanted.at(made.time_s)
    # RK45 is exact to (w dt)^6 = 2e-12 here; 20000 roundings.
    allowed = 3e-12 * np.abs(x).max()
    if moving:
        allowed += SPLINE * amplification(structure, added) * sum(a for _, a, _ in SINES)
    assert np.abs(made.x[:, :, 0] - x).max() < allowed
    assert np.abs(made.v[:, :, 0] - v).max() < 2.0 * np.pi * 14.0 * allowed
    fine = wanted.at(np.arange(20001) * 1e-4)[0]
    assert made.rms[:, 0] == pytest.approx(fine[:-1].std(axis=0), rel=1e-4)
    assert made.peak[:, 0] == pytest.approx(np.abs(fine).max(axis=0), rel=1e-4)


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


def test_places_move_by_the_forces_of_all_boxes():
    """Spheres push evenly over a step, so that the motion under their forces has a closed form."""
    structure = two_storeys()
    made = shaken(
        *(structure, [Box(1, 15), Box(0, 8), Box(1, 5)], still(0.3), Spheres()),
        displacement=[8e-3, 12e-3],
        velocity=[0.3, -0.1],
        interval=2e-5,
    )
    assert made.report.dt_s[0] == pytest.approx(made.time_s[1])
    impulses = np.abs(made.force).sum(axis=0) * 2e-5
    assert (impulses > 1e-3).all()
    assert np.abs(made.x[:, :, 0] - zero_order_hold(structure, made)).max() < 1e-13
    assert made.report.momentum_error < 1e-12


def test_order_of_boxes_changes_no_bit_and_momentum_closes():
    """Two forces have one sum in either order; seeds of their own tell the boxes apart."""
    boxes, motion = [Box(1, 20, seed=7), Box(0, 10, seed=9)], base_motion(duration=0.4)
    one, other = (
        shaken(two_storeys(), these, motion, Automaton()) for these in (boxes, boxes[::-1])
    )
    assert np.array_equal(one.x, other.x)
    assert np.array_equal(one.force, other.force[:, ::-1])
    assert one.report.momentum_error < 1e-9


FREQUENCIES = np.array([0.3, 1.5, 3.6, 5.0, 9.0])


def test_frequencies_of_a_uniform_chain_are_those_of_the_closed_form():
    """Fixed at one end, free at the other: w_k = 2 sqrt(k / m) sin((2 k - 1) pi / (4 n + 2))."""
    n, m, k = 6, 0.3, 700.0
    stiffness = k * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[-1, -1] = k
    made = ModalStructure.from_matrices(np.full(n, m), stiffness, 0.01)
    turns = (2.0 * np.arange(1, n + 1) - 1.0) * np.pi / (4 * n + 2)
    omega = 2.0 * np.sqrt(k / m) * np.sin(turns)
    assert made.frequencies == pytest.approx(omega / (2.0 * np.pi), rel=1e-12)
    assert made.shapes.T @ made.masses @ made.shapes == pytest.approx(np.eye(n), abs=1e-12)


def test_all_modes_respond_as_the_matrices():
    """(K + i w C - w^2 (M + A)) x = (K + i w C) 1 y, solved as it stands.

    The matrix of masses couples the places.
    """
    coupled, added = np.diag(MASSES) + 0.1 * (np.eye(3, k=1) + np.eye(3, k=-1)), [0.1, 0.0, 0.3]
    made = frame(masses=coupled)
    c = damping_of(made)
    moved = made.transfer(FREQUENCIES, added)
    for k, omega in enumerate(2.0 * np.pi * FREQUENCIES):
        held = STIFFNESS + 1j * omega * c
        matrix = held - omega**2 * (coupled + np.diag(added))
        assert moved[k] == pytest.approx(np.linalg.solve(matrix, held @ np.ones(3)), rel=1e-10)
    assert made.recoil(1) == pytest.approx(np.linalg.inv(coupled)[1, 1], rel=1e-12)


@pytest.mark.parametrize("modes", [1, 2])
def test_modes_left_out_leave_a_slow_translation_whole(modes):
    """Relative to the base the kept modes move by (w / w_k)^2 y at most, times their share."""
    made, slow = frame(modes), 0.01
    share = np.abs(made.shapes * made.participation) @ (slow / made.frequencies) ** 2
    # Beyond it (w / w_1)^4 of it, 2e-9.
    assert (np.abs(made.transfer(slow) - 1.0) <= share * (1.0 + 1e-3)).all()
