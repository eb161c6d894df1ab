"""Modes and closed forms of structures: against their matrices, chains and the Oscillator."""

import numpy as np
import pytest

from ca_damper import Box, InputError, ModalStructure, Oscillator
from tests.ca_modes.frames import MASSES, STIFFNESS, damping_of, frame

FREQUENCIES = np.array([0.3, 1.5, 3.6, 5.0, 9.0])
ADDED = np.array([0.1, 0.0, 0.3])


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
    assert (made.shapes[np.abs(made.shapes).argmax(axis=0), range(n)] > 0.0).all()


@pytest.mark.parametrize("added", [None, ADDED])
def test_all_modes_respond_as_the_matrices(added):
    """(K + i w C - w^2 (M + A)) x = (K + i w C) 1 y + F, solved as it stands."""
    made, more = frame(), np.zeros(3) if added is None else added
    c = damping_of(made)
    moved, pushed = made.transfer(FREQUENCIES, added), made.force_transfer(FREQUENCIES, 1, added)
    for k, omega in enumerate(2.0 * np.pi * FREQUENCIES):
        held = STIFFNESS + 1j * omega * c
        matrix = held - omega**2 * np.diag(MASSES + more)
        assert moved[k] == pytest.approx(np.linalg.solve(matrix, held @ np.ones(3)), rel=1e-10)
        assert pushed[k] == pytest.approx(np.linalg.solve(matrix, [0.0, 1.0, 0.0]), rel=1e-10)


def test_a_matrix_of_masses_may_couple_the_places():
    coupled = np.diag(MASSES) + 0.1 * (np.eye(3, k=1) + np.eye(3, k=-1))
    made = frame(masses=coupled)
    omega = 2.0 * np.pi * 2.0
    held = STIFFNESS + 1j * omega * damping_of(made)
    wanted = np.linalg.solve(held - omega**2 * coupled, held @ np.ones(3))
    assert made.transfer(2.0) == pytest.approx(wanted, rel=1e-10)
    assert made.recoil(1) == pytest.approx(np.linalg.inv(coupled)[1, 1], rel=1e-12)


@pytest.mark.parametrize("modes", [1, 2])
def test_modes_left_out_leave_a_slow_translation_whole(modes):
    """Relative to the base the kept modes move by (w / w_k)^2 y at most, times their share."""
    made, slow = frame(modes), 0.01
    share = np.abs(made.shapes * made.participation) @ (slow / made.frequencies) ** 2
    # Beyond it (w / w_1)^4 of it, 2e-9.
    assert (np.abs(made.transfer(slow) - 1.0) <= share * (1.0 + 1e-3)).all()
    assert np.abs(made.residual).max() > 0.03
    # Of a static force the modes that are left out have no part.
    flexible = np.linalg.inv(STIFFNESS)[:, 2] - made.force_transfer(0.0, 2).real
    left = frame().shapes[:, modes:]
    omega = 2.0 * np.pi * frame().frequencies[modes:]
    assert flexible == pytest.approx(left @ (left[2] / omega**2), rel=1e-9)


def test_one_place_is_an_oscillator():
    o = Oscillator()
    made = ModalStructure([o.mass], [o.natural_frequency], o.damping_ratio, [[o.mass**-0.5]])
    assert made.transfer(FREQUENCIES)[:, 0] == pytest.approx(o.transfer(FREQUENCIES), rel=1e-12)
    wanted = o.transfer(FREQUENCIES, 0.02)
    assert made.transfer(FREQUENCIES, [0.02])[:, 0] == pytest.approx(wanted, rel=1e-12)
    assert made.recoil(0) == pytest.approx(1.0 / o.mass)


def test_motions_are_sums_of_modes():
    made, motion = frame(), np.random.default_rng(1).normal(size=(7, 3))
    assert made.modal(motion) @ made.shapes.T == pytest.approx(motion, abs=1e-12)


def given(**changes):
    good = {
        "masses": [2.0, 1.0],
        "frequencies": [3.0, 7.0],
        "damping_ratios": [0.01, 0.02],
        "shapes": [[0.5**0.5, 0.0], [0.0, 1.0]],
    }
    return ModalStructure(**{**good, **changes})


def matrices(**changes):
    good = {"mass": [2.0, 1.0], "stiffness": [[3.0, -1.0], [-1.0, 1.0]], "damping_ratios": 0.01}
    return ModalStructure.from_matrices(**{**good, **changes})


NAN = float("nan")
REFUSED = [
    (given, {"masses": 3.0}, "masses must be a matrix of numbers, got 3.0"),
    (given, {"masses": [2.0, "x"]}, "masses must be a list of numbers"),
    (
        given,
        {"masses": [2.0, NAN]},
        r"masses must be finite numbers up to 1e\+60, got nan at \[1\]",
    ),
    (given, {"masses": [2.0, 0.0]}, "masses must be positive numbers, got 0 at place 1"),
    (given, {"masses": [[2.0, 1.0]]}, "masses must be a square matrix, got 1 x 2"),
    (given, {"masses": [[2.0, 1.0], [0.5, 2.0]]}, r"symmetric matrix, got 1 at \[0, 1\] and 0.5"),
    (given, {"masses": [[1.0, 2.0], [2.0, 1.0]]}, "masses must be a positive definite matrix"),
    (given, {"masses": [1.0] * 1001}, "masses must be of at most 1000 places, got 1001"),
    (given, {"masses": [[2.0], [1.0, 2.0]]}, "masses must be a matrix of numbers"),
    (given, {"masses": None}, "masses must be a matrix of numbers, got None"),
    (given, {"frequencies": [3.0]}, r"frequencies must be 2 numbers, one for each mode, got \[3"),
    (given, {"frequencies": [3.0, -7.0]}, "frequencies must be positive numbers, got -7 of mode 1"),
    (given, {"frequencies": [0.0, 7.0]}, "frequencies must be positive numbers, got 0 of mode 0"),
    (given, {"frequencies": 3.0}, "frequencies must be a list of numbers, got 3.0"),
    (given, {"frequencies": [True, False]}, "frequencies must be a list of numbers"),
    (
        given,
        {"damping_ratios": -0.1},
        "damping_ratios must be zero or a positive finite number, got -0.1",
    ),
    (given, {"damping_ratios": [0.1, -0.1]}, "zero or positive numbers, got -0.1 of mode 1"),
    (given, {"damping_ratios": [NAN, 0.1]}, "damping_ratios must be finite"),
    (given, {"shapes": [0.7, 1.0]}, "shapes must be a matrix of numbers"),
    (given, {"shapes": [[0.7], [0.0], [0.0]]}, "shapes must have a row for each of 2 places"),
    (given, {"shapes": np.ones((2, 3))}, "shapes must have from 1 to 2 modes, as places, got 3"),
    (given, {"shapes": np.ones((2, 0))}, "shapes must be a matrix of numbers"),
    (
        given,
        {"shapes": [[0.5**0.5, 0.1], [0.0, 1.0]]},
        "got 0.141421 in place of 0 for modes 0 and 1",
    ),
    (given, {"shapes": np.eye(2)}, "got 2 in place of 1 for modes 0 and 0"),
    (given, {"shapes": [[NAN, 0.0], [0.0, 1.0]]}, r"shapes must be finite.*nan at \[0, 0\]"),
    (matrices, {"stiffness": [[3.0]]}, "stiffness must be 2 x 2 numbers, as mass, got 1 x 1"),
    (matrices, {"stiffness": [[3.0, -1.0], [1.0, 1.0]]}, "stiffness must be a symmetric matrix"),
    # Free of the base: it may float away.
    (matrices, {"stiffness": [[1.0, -1.0], [-1.0, 1.0]]}, "stiffness must be a positive definite"),
    (matrices, {"modes": 3}, "modes must be a whole number from 1 to 2, got 3"),
    (matrices, {"modes": 0}, "modes must be a whole number from 1 to 2, got 0"),
    (
        matrices,
        {"modes": 1, "damping_ratios": [0.1, 0.1]},
        "damping_ratios must be 1 number, one for each mode",
    ),
    (given().recoil, {"place": 2}, "place must be a whole number from 0 to 1, got 2"),
    (given().force_transfer, {"frequency": 1.0, "place": -1}, "place must be a whole number"),
    (given().transfer, {"frequency": 1.0, "added_masses": [1.0]}, "added_masses must be 2 numbers"),
    (given().transfer, {"frequency": 1.0, "added_masses": [1.0, -1.0]}, "added_masses must be 2"),
    (Box, {"place": -1, "particles": 1}, "place must be a whole number from 0"),
    (Box, {"place": 0, "particles": 1.5}, "particles must be a whole number from 0"),
    (Box, {"place": 0, "particles": 1, "seed": "a"}, "seed must be a whole number from 0"),
]


@pytest.mark.parametrize(("make", "changes", "words"), REFUSED)
def test_what_is_no_structure_is_refused(make, changes, words):
    with pytest.raises(InputError, match=words):
        make(**changes)


def test_arrays_of_a_structure_are_its_own():
    masses = np.array([2.0, 1.0])
    made = given(masses=masses)
    masses[:] = 5.0
    assert made.masses[0, 0] == 2.0
    with pytest.raises(ValueError, match="read-only"):
        made.shapes[0, 0] = 1.0


@pytest.mark.parametrize("mode", range(3))
def test_a_mode_without_damping_has_no_steady_state_at_its_frequency(mode):
    shares = np.where(np.arange(3) == mode, 0.0, 0.02)
    made = ModalStructure.from_matrices(MASSES, STIFFNESS, shares)
    own = made.frequencies
    for ask in (made.transfer, lambda frequency: made.force_transfer(frequency, 0)):
        assert np.isfinite(ask(np.delete(own, mode))).all()
        with pytest.raises(InputError, match=f"no steady state .*, got {own[mode]:.6g} Hz"):
            ask(own)
