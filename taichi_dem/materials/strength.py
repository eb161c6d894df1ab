"""Strength that varies from bond to bond: factors by Weibull's law (NumPy only)."""

import math

import numpy as np

#: Largest relative standard deviation; Weibull moduli for it and for the least one in use.
MOST_SPREAD = 1.0
_MODULI = 1.0, 1e4
#: Digits of a factor: those that every machine's powers agree on.
_DIGITS = 9


def weibull_modulus(spread: float) -> float:
    """Weibull modulus of a relative standard deviation, which falls as it grows: by bisection."""
    low, high = _MODULI
    for _ in range(80):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if _spread_of(middle) > spread else (low, middle)
    return middle


def _spread_of(modulus):
    """Standard deviation over mean at a modulus."""
    mean = math.gamma(1.0 + 1.0 / modulus)
    return math.sqrt(max(0.0, math.gamma(1.0 + 2.0 / modulus) / mean**2 - 1.0))


def drawn(seed: int, count: int) -> np.ndarray:
    """Numbers above 0 and below 1, (count,): a hash of the seed and the place of each alone.

    G. L. Steele et al., Fast splittable pseudorandom number generators, OOPSLA 2014 (splitmix).
    """
    with np.errstate(over="ignore"):
        start = np.uint64(seed) * np.uint64(0xD1342543DE82EF95)
        word = start + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            word = (word ^ (word >> np.uint64(shift))) * np.uint64(factor)
        word ^= word >> np.uint64(31)
    return ((word >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53


def factors(spread: np.ndarray, reference: np.ndarray, volume: np.ndarray, seed: int) -> np.ndarray:
    """Strength of each bond over the material's, (n,): of mean 1, in bonds of the reference volume.

    spread: relative standard deviation; reference, volume [m3]: of material (0: none), bond.
    """
    uniform, factor = drawn(seed, len(spread)), np.ones(len(spread))
    for scatter, size in np.unique(np.stack([spread, reference], axis=1), axis=0):
        if scatter > 0.0:
            here = (spread == scatter) & (reference == size)
            modulus = weibull_modulus(scatter)
            stronger = (size / volume[here]) ** (1.0 / modulus) if size else 1.0
            part = (-np.log(uniform[here])) ** (1.0 / modulus) / math.gamma(1.0 + 1.0 / modulus)
            factor[here] = np.round(stronger * part, _DIGITS)
    return np.maximum(factor, 10.0**-_DIGITS)
