"""Structures of the tests, and exact motions of linear systems by their physical matrices."""

import numpy as np

from ca_damper import ModalStructure

MASSES = np.array([2.0, 1.0, 0.5])
STIFFNESS = np.array([[900.0, -500.0, 0.0], [-500.0, 800.0, -300.0], [0.0, -300.0, 300.0]])
RATIOS = np.array([0.01, 0.02, 0.03])


def frame(modes=3, masses=MASSES):
    """Three storeys on a base."""
    return ModalStructure.from_matrices(masses, STIFFNESS, RATIOS[:modes], modes=modes)


def two_storeys():
    """Two storeys of about 5 and 14 Hz."""
    stiffness = np.array([[800.0, -400.0], [-400.0, 400.0]])
    return ModalStructure.from_matrices([0.2, 0.15], stiffness, [0.01, 0.01])


def damping_of(structure):
    """Damping matrix M phi diag(2 z w) phi^T M of a structure with all its modes [N s/m]."""
    rates = 4.0 * np.pi * structure.frequencies * structure.damping_ratios
    left = structure.masses @ structure.shapes
    return left @ np.diag(rates) @ left.T


class Linear:
    """M q'' + C q' + K q = constant + sum Im(F exp(i w t)), solved by eigenvalues.

    sines: (frequency [Hz], complex F (n,)); x0, v0: (n,).
    """

    def __init__(self, matrices, sines, x0=0.0, v0=0.0, constant=0.0):
        m, c, k = matrices
        n = len(m)
        self.sines = [
            (
                2 * np.pi * f,
                np.linalg.solve(k + 2j * np.pi * f * c - (2 * np.pi * f) ** 2 * m, force),
            )
            for f, force in sines
        ]
        self.rest = np.linalg.solve(k, np.broadcast_to(constant, n).astype(float))
        inverse = np.linalg.inv(m)
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ k, -inverse @ c]])
        self.rates, self.vectors = np.linalg.eig(state)
        x, v = self._forced(np.zeros(1))
        begin = np.concatenate([np.broadcast_to(x0, n) - x[0], np.broadcast_to(v0, n) - v[0]])
        self.weights = np.linalg.solve(self.vectors, begin)

    def _forced(self, time_s):
        x = np.tile(self.rest, (len(time_s), 1)).astype(complex)
        v = np.zeros_like(x)
        for omega, shape in self.sines:
            wave = np.exp(1j * omega * time_s)[:, None] * shape
            x, v = x + wave.imag, v + (1j * omega * wave).imag
        return x.real, v.real

    def at(self, time_s):
        """Motions (q, q') at times, (times, n) each."""
        x, v = self._forced(time_s)
        free = np.exp(np.outer(time_s, self.rates)) * self.weights @ self.vectors.T
        n = x.shape[1]
        return x + free[:, :n].real, v + free[:, n:].real


def on_base(structure, sines, added=0.0, force=(), constant=0.0, **start):
    """Exact motion of a structure with all its modes, by its matrices.

    sines: of the base, and force: (frequency, amplitude, phase), the latter with its place.
    """
    m, c = structure.masses, damping_of(structure)
    left = m @ structure.shapes
    k = left @ np.diag((2 * np.pi * structure.frequencies) ** 2) @ left.T
    one, unit = np.ones(len(m)), np.eye(len(m))
    pulls = [
        (f, a * np.exp(1j * phase) * ((k + 2j * np.pi * f * c) @ one)) for f, a, phase in sines
    ]
    pulls += [(f, a * np.exp(1j * phase) * unit[place]) for f, a, phase, place in force]
    return Linear((m + np.diag(added * one), c, k), pulls, constant=constant * one, **start)
