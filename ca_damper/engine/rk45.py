"""Dormand-Prince 5(4) for any right-hand side, in Python and inside kernels alike (ti.pyfunc).

``rhs(context, t, y)`` returns dy/dt; in a kernel it is a ti.func, ``y`` a ti.Vector. Source:
Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19-26; steps: Hairer et al., ODEs I, II.4.
"""

import taichi as ti

from taichi_dem.kit.elementary import fifth_root

#: Steps below this share of the time itself no longer move the clock.
_SMALLEST_SHARE = 1e-15


@ti.pyfunc
def step(rhs: ti.template(), context, t, y, slope, h):
    """One step of length h from y at t, where dy/dt is ``slope``."""
    # Fifth order; dy/dt at the end is the next step's slope, so that a step costs six evaluations.
    t2, t3, t4, t5 = t + h * (1 / 5), t + h * (3 / 10), t + h * (4 / 5), t + h * (8 / 9)
    return stages(rhs, context, t2, t3, t4, t5, t + h, y, slope, h)


@ti.pyfunc
def stages(rhs: ti.template(), context, t2, t3, t4, t5, t_end, y, slope, h):
    """The step of ``step`` for given times of its stages, t + h (1/5, 3/10, 4/5, 8/9, 1)."""
    # rhs gets these times as they are, so that what it needs of them can be computed before.
    k1 = slope
    k2 = rhs(context, t2, y + h * (1 / 5 * k1))
    k3 = rhs(context, t3, y + h * (3 / 40 * k1 + 9 / 40 * k2))
    k4 = rhs(context, t4, y + h * (44 / 45 * k1 - 56 / 15 * k2 + 32 / 9 * k3))
    y5 = 19372 / 6561 * k1 - 25360 / 2187 * k2 + 64448 / 6561 * k3 - 212 / 729 * k4
    k5 = rhs(context, t5, y + h * y5)
    y6 = 9017 / 3168 * k1 - 355 / 33 * k2 + 46732 / 5247 * k3 + 49 / 176 * k4
    k6 = rhs(context, t_end, y + h * (y6 - 5103 / 18656 * k5))
    y7 = 35 / 384 * k1 + 500 / 1113 * k3 + 125 / 192 * k4 - 2187 / 6784 * k5 + 11 / 84 * k6
    y_new = y + h * y7
    k7 = rhs(context, t_end, y_new)
    gap = 71 / 57600 * k1 - 71 / 16695 * k3 + 71 / 1920 * k4 - 17253 / 339200 * k5
    return y_new, k7, h * (gap + 22 / 525 * k6 - 1 / 40 * k7)


@ti.pyfunc
def scaled_norm(vector, y, y_new, rtol, atol):
    """Euclidean length of a vector in units of atol + rtol max(|y|, |y_new|), by component."""
    # A sum of squares, as a maximum would let a NaN pass.
    ratio = vector / (atol + rtol * ti.max(abs(y), abs(y_new)))
    return ti.sqrt((ratio * ratio).sum())


@ti.pyfunc
def growth(error):
    """By how much the next step is longer, for an error in units of the tolerance."""
    # The local error grows with the fifth power of the step; 0.9 aims short; NaN shrinks the step.
    factor = 0.2
    if error < 1e3:
        factor = min(5.0, max(0.2, 0.9 / fifth_root(max(error, 1e-10))))
    return factor


@ti.pyfunc
def attempt(rhs: ti.template(), context, t, t_end, y, slope, h, rtol, atol):
    """Try a step of length h, or the rest up to t_end."""
    left = t_end - t
    size = min(h, left)
    y_new, slope_new, gap = step(rhs, context, t, y, slope, size)
    error = scaled_norm(gap, y, y_new, rtol, atol)
    t_after, y_after, slope_after = 1.0 * t, y, slope
    if error <= 1.0:
        y_after, slope_after = y_new, slope_new
        t_after = t + size
        if size == left or t_after > t_end:
            t_after = 1.0 * t_end
    return t_after, y_after, slope_after, size, error


@ti.pyfunc
def integrate(rhs: ti.template(), context, t, t_end, y, slope, h, rtol, atol, most_attempts):
    """Take y from t to t_end >= t with steps chosen by the error."""
    # attempts is -1 when most_attempts did not suffice or the step fell to nothing, as at a NaN.
    now, state, change, length, attempts = 1.0 * t, y, slope, 1.0 * h, 0
    error = 1.0
    while now < t_end and attempts >= 0:
        # Chosen here and not after the attempt: the last one needs no successor, and the power in
        # ``growth`` costs as much as half a step.
        if attempts > 0:
            length *= growth(error)
        now, state, change, length, error = attempt(
            rhs, context, now, t_end, state, change, length, rtol, atol
        )
        attempts += 1
        if now < t_end and stuck(now, t_end, length, attempts, most_attempts):
            attempts = -1
    return state, change, attempts


@ti.pyfunc
def stuck(t, t_end, h, attempts, most_attempts):
    """Whether to give up: too many attempts, or a step that no longer moves the clock."""
    return (attempts >= most_attempts) | (h <= _SMALLEST_SHARE * max(abs(t), abs(t_end)))
