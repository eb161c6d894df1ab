"""Theory of grains that fly between floor and lid as one block: collect and collide.

Without gravity a shaken container collects its grains on one wall and throws them as one block at
its largest speed A w. The block flies until the opposite wall meets it, at the phase p after that,

    p - sin p = gap / A,

and dissipates all of the relative motion, N m (A w)^2 (1 - cos p)^2 / 2. If that wall then still
speeds up, p <= pi, it throws the block back half a cycle after the first throw. A cycle so takes

    E = N m A^2 w^2 (1 - cos p)^2.

The motion exists from p = pi on, which is A = gap / pi: there both meet at opposite speeds and E
jumps to its largest value, 4 N m A^2 w^2; for larger A it falls slowly. Source: Bannerman et al.,
Phys. Rev. E 84 (2011) 011301; Sack et al., Phys. Rev. Lett. 111 (2013) 018001.

The block's speed over a half cycle is A w up to p and that of the container, A w cos, after it. Its
first harmonic by that of the container is u - i l with

    l = (1 - cos p)^2 / pi,    u = (2 sin p + pi - p - sin(2 p) / 2) / pi,

so that the container feels the damping c = l N m w, with pi c A^2 w = E, and the mass u N m.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.validation import SMALLEST, real_numbers

_HALVINGS = 60


@dataclass(frozen=True, eq=False)
class CollectAndCollide:
    """Answer of the theory at amplitudes A and gaps of one shape; NaN where A < gap / pi.

    Parameters
    ----------
    energy : ndarray
        Energy lost in a cycle over N m A^2 w^2 [-].
    loss : ndarray
        Apparent damping over N m w [-].
    mass : ndarray
        Apparent mass over N m [-].
    phase : ndarray
        Phase of the wall when it meets the block [rad].
    """

    energy: np.ndarray
    loss: np.ndarray
    mass: np.ndarray
    phase: np.ndarray

    __repr__ = by_fields


def collect_and_collide(amplitude: ArrayLike, gap: ArrayLike) -> CollectAndCollide:
    """Loss and apparent mass of a block of grains in a container that moves as A sin(w t).

    Parameters
    ----------
    amplitude : array_like
        Amplitude A of the container [m].
    gap : array_like
        Distance that the block can move between floor and lid [m]; broadcast against the amplitude.

    Notes
    -----
    The motion exists for A >= gap / pi. The phase p of the impact follows from p - sin p = gap / A.

    References
    ----------
    Bannerman et al., Phys. Rev. E 84 (2011) 011301; Sack et al., PRL 111 (2013) 018001.

    Examples
    --------
    >>> made = collect_and_collide(2.0, 2.0 * np.pi)
    >>> round(float(made.energy), 12)
    4.0
    """
    size, clearance = np.broadcast_arrays(
        real_numbers("amplitude", amplitude, SMALLEST), real_numbers("gap", gap, SMALLEST)
    )
    ratio = clearance / size
    phase = _phase(np.minimum(ratio, np.pi))
    phase = np.where(ratio <= np.pi, phase, np.nan)
    loss = (1.0 - np.cos(phase)) ** 2 / np.pi
    mass = (2.0 * np.sin(phase) + np.pi - phase - 0.5 * np.sin(2.0 * phase)) / np.pi
    return CollectAndCollide(np.pi * loss, loss, mass, phase)


def _phase(ratio):
    low, high = np.zeros_like(ratio), np.full_like(ratio, np.pi)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        above = middle - np.sin(middle) > ratio
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return high
