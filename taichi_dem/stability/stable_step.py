"""Largest stable explicit steps of springs and dashpots: for arrays, and for kernels."""

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike


def dashpot_step(rate: ArrayLike) -> np.ndarray:
    """Largest step [s] at which dashpots are stable that slow a body at a rate [1/s].

    A pair of equal bodies moves against each other at twice the rate of one, and forward Euler
    is stable to 2 / (2 rate). Infinite where the rate is zero.
    """
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(rate)


def spring_step(rate2: ArrayLike) -> np.ndarray:
    """Largest step [s] at which springs are stable that hold a body at a squared rate [1/s2].

    As for dashpots a pair has twice that of one, and symplectic Euler is stable to
    2 / sqrt(2 omega^2). Infinite where it is zero.
    """
    with np.errstate(divide="ignore"):
        return 2.0 / np.sqrt(2.0 * np.asarray(rate2))


@ti.func
def dashpot_limit(rate):
    """``dashpot_step`` for kernels: [s], huge where the rate [1/s] is zero."""
    return 1.0 / ti.max(rate, 1e-200)


@ti.func
def spring_limit(rate2):
    """``spring_step`` for kernels: [s], huge where the squared rate [1/s2] is zero."""
    return 2.0 / ti.sqrt(2.0 * ti.max(rate2, 1e-200))
