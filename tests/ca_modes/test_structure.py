"""Modes and closed forms of structures: against their matrices, chains and the Oscillator."""

import numpy as np
import pytest

from ca_damper import ModalStructure
from tests.ca_modes.frames import MASSES, STIFFNESS, damping_of, frame

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
