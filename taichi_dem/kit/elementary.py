"""Sine, cosine and fifth root with the same bits on every processor and device, in kernels too."""

import numpy as np
import taichi as ti

from taichi_dem.kit.products import expression, once

#: Powers of 32 that bring any number into [1, 32); steps from there to the last bit.
_POWERS, _NEWTON_STEPS = (128, 64, 32, 16, 8, 4, 2, 1), 8
#: A quarter turn as a sum: the first two have 33 bits, so that whole multiples of them are exact.
_QUARTER = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
_QUARTERS_PER_RADIAN = 0.63661977236758134308
# Coefficients of fdlibm (Sun Microsystems 1993), of powers of r^2 on [-pi/4, pi/4].
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@expression
def _of_rest(angle):
    """Sine and cosine of what an angle [rad] is beyond whole quarter turns, and their number."""
    turns = once((_QUARTERS_PER_RADIAN * angle + 0.5) // 1.0)
    r = once(angle - turns * _QUARTER[0] - turns * _QUARTER[1] - turns * _QUARTER[2])
    z = once(r * r)
    sine = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
    rest = z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
    half = once(1.0 - 0.5 * z)
    cosine = half + ((1.0 - half - 0.5 * z) + rest)
    quarter = turns - 4.0 * (turns // 4.0)
    return sine, cosine, quarter


@ti.pyfunc
def sine_and_cosine(angle):
    """Sine and cosine of an angle [rad]."""
    # Exact to a unit in the last place of 1 up to a million turns; beyond, the angle's own rounding
    # is larger.
    sine, cosine, quarter = _of_rest(angle)
    if quarter == 1.0 or quarter == 3.0:
        sine, cosine = cosine, -sine
    if quarter > 1.5:
        sine, cosine = -sine, -cosine
    return sine, cosine


@expression
def sine_shortfall(angle):
    """1 - sin(angle) / angle of an angle [rad] of at most pi / 2, without a difference."""
    square, rest = once(angle * angle), 1.0
    for k in range(10, 0, -1):
        rest = 1.0 - square / ((2.0 * k + 2.0) * (2.0 * k + 3.0)) * rest
    return square / 6.0 * rest


@ti.pyfunc
def fifth_root(value):
    """Fifth root of a number that is not negative, by Newton's method."""
    rest, scale = 1.0 * value, 1.0
    for power in ti.static(_POWERS):
        if rest >= 32.0**power:
            rest, scale = rest * 32.0**-power, scale * 2.0**power
        if rest < 32.0 ** (1 - power):
            rest, scale = rest * 32.0**power, scale * 2.0**-power
    root = 1.0 + (rest - 1.0) / 31.0
    for _ in range(_NEWTON_STEPS):
        square = root * root
        root = 0.2 * (4.0 * root + rest / (square * square))
    return scale * root


def sines_and_cosines(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine of each angle [rad]: the bits of ``sine_and_cosine``, without its loop."""
    sine, cosine, quarter = _of_rest(angles)
    odd, behind = (quarter == 1.0) | (quarter == 3.0), quarter > 1.5
    turned, other = np.where(odd, cosine, sine), np.where(odd, -sine, cosine)
    return np.where(behind, -turned, turned), np.where(behind, -other, other)
