"""Pieces of a run: bodies that bonds still join."""

from typing import NamedTuple

import numpy as np

from taichi_dem.mesh.tetrahedra import components

#: Least share of all mass that counts as a piece; below it is dust.
LEAST = 0.005


class Piece(NamedTuple):
    """mass [kg], mean velocity [m/s], lowest and highest corner at the start [m]."""

    mass: float
    velocity: np.ndarray
    low: np.ndarray
    high: np.ndarray


def pieces_of(result, least=LEAST):
    """Pieces at the end of a run whose share of all mass is larger than ``least``."""
    model, held = result.model, np.isnan(result.broken_time)
    links = np.stack([model.topology.master, model.topology.slave], axis=1)[held]
    piece = np.unique(components(model.body_count, links), return_inverse=True)[1].reshape(-1)
    mass, velocity = np.bincount(piece, model.body_mass), result.frames[-1].velocity
    corners, found = model.mesh.points[model.mesh.tetrahedra], []
    for k in np.flatnonzero(mass > least * mass.sum()):
        own = piece == k
        mean = (model.body_mass[own, None] * velocity[own]).sum(axis=0) / mass[k]
        ends = corners[own].min(axis=(0, 1)), corners[own].max(axis=(0, 1))
        found.append(Piece(float(mass[k]), mean, *ends))
    return found
