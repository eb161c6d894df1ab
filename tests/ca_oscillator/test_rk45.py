"""Dormand-Prince 5(4): order, tolerance, the same in Python and in kernels."""

import math

import numpy as np
import pytest
import taichi as ti

from ca_damper.engine import rk45


def bell(_, t, y):
    """Solved by y = 1 / (1 + t^2) from y(0) = 1: not linear, not autonomous."""
    return -2.0 * t * y * y


def bell_at(t):
    return 1.0 / (1.0 + t * t)


def slope_of(sizes, errors):
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


def test_local_error_is_of_order_6_and_embedded_difference_of_order_5():
    # Local error of the fifth-order result h^6, of the embedded fourth-order result h^5; their
    # difference shows the latter. Steps this long stay clear of round-off (h^6 / 720 > 1e-12).
    sizes = 0.2 * 0.5 ** np.arange(5)
    t, y = 0.3, np.array([bell_at(0.3)])
    steps = [rk45.step(bell, None, t, y, bell(None, t, y), h) for h in sizes]
    errors = [abs(new[0] - bell_at(t + h)) for (new, _, _), h in zip(steps, sizes)]
    gaps = [abs(gap[0]) for _, _, gap in steps]
    # The exponent itself still drifts by O(h); 0.3 tells 6 from 5 and 5 from 4 with room.
    assert slope_of(sizes, errors) == pytest.approx(6.0, abs=0.3)
    assert slope_of(sizes, gaps) == pytest.approx(5.0, abs=0.3)
    new, slope, _ = steps[0]
    assert slope[0] == bell(None, t + sizes[0], new)[0]


def turning_in_python(rate, t, y):
    return np.array([rate * y[1], -rate * y[0]])


@ti.func
def turning(rate, t, y):
    return ti.Vector([rate * y[1], -rate * y[0]])


@ti.kernel
def turn(rate: ti.f64, t_end: ti.f64, rtol: ti.f64) -> ti.types.vector(3, ti.f64):
    y = ti.Vector([0.0, 1.0])
    slope = turning(rate, 0.0, y)
    y, _, attempts = rk45.integrate(turning, rate, 0.0, t_end, y, slope, 1e-3, rtol, 1e-12, 100000)
    return ti.Vector([y[0], y[1], ti.cast(attempts, ti.f64)])


def test_integration_in_a_kernel_keeps_the_tolerance_and_agrees_with_python():
    kernel, y = turn(2.0, 10.0, 1e-9).to_numpy(), np.array([0.0, 1.0])
    assert np.abs(kernel[:2] - [math.sin(20.0), math.cos(20.0)]).max() < kernel[2] * 1e-9
    slope = turning_in_python(2.0, 0.0, y)
    y, _, attempts = rk45.integrate(
        turning_in_python, 2.0, 0.0, 10.0, y, slope, 1e-3, 1e-9, 1e-12, 100000
    )
    assert attempts == int(kernel[2])
    # Only the power in the step control may round differently.
    assert np.abs(y - kernel[:2]).max() < 1e-13
