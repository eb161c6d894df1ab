"""Coefficient of a dashpot for a wanted coefficient of restitution.

Two spheres meet head on: m d'' = -max(0, k d^(3/2) + c d^p d'); d: overlap, m: effective mass. In
units of the overlap D = (m v^2 / k)^(2/5) and of the impact speed v, c becomes the number alpha = c
D^(p+1) / (m v): independent of v for p = 1/4, so that restitution is one number, and growing with v
for p = 1/2, so that it holds at one speed only.

The contact ends where the force has fallen to zero, before the overlap has: spheres do not pull.
"""

import math
from functools import lru_cache

from taichi_dem.kit.elementary import fifth_root

# Step in the solver's variable: fourth order, errors of restitution below 1e-7.
_STEP = 1.0 / 256.0
_BISECTIONS = 40


@lru_cache(maxsize=64)
def damping_number(restitution: float, power: float) -> float:
    """Number alpha of a dashpot d^power that lets spheres part at ``restitution`` times the speed.

    restitution lies in (0, 1]; power is 1/4 or 1/2.
    """
    low, high = 0.0, 1.0
    while restitution_of(high, power) > restitution:
        low, high = high, 2.0 * high
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if restitution_of(middle, power) > restitution:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def restitution_of(alpha: float, power: float) -> float:
    """Speed of parting over speed of impact for a dashpot of number alpha.

    Overlap y^4 instead of d, and a time in which y' is the speed u: then all terms are smooth,
    where d^(1/4) is not. Integrated by the classical Runge-Kutta method.
    """
    y, u = 0.0, 1.0
    while True:
        rate = _rate(y, u, alpha, power)
        y_new, u_new = _runge_kutta(y, u, alpha, power)
        rate_new = _rate(y_new, u_new, alpha, power)
        if u_new < 0.0 <= rate_new:
            # The force falls to zero within this step, and with it the rate, about linearly.
            share = rate / (rate - rate_new) if rate < 0.0 else 0.0
            return -(u + 0.5 * share * _STEP * rate)
        y, u = y_new, u_new


def damping(restitution: float, power: float, mass: float, stiffness: float, speed: float) -> float:
    """Coefficient c [N s/m^(1+power)] that gives ``restitution`` at an impact speed [m/s].

    mass: effective mass [kg]. stiffness: k [N/m^(3/2)]. For power = 1/4 the speed cancels.
    """
    root = fifth_root(mass * speed * speed / stiffness)
    depth = root * root
    more = math.sqrt(depth) if power == 0.5 else math.sqrt(math.sqrt(depth))
    return damping_number(restitution, power) * mass * speed / (depth * more)


def _rate(y, u, alpha, power):
    """Change of the speed u: -4 y^3 (d^(3/2) + alpha d^p u), d = y^4."""
    damped = y * u if power == 0.25 else y * y * u
    cube = y * y * y
    return -4.0 * cube * (cube * cube + alpha * damped)


def _runge_kutta(y, u, alpha, power):
    h = _STEP
    y1, u1 = u, _rate(y, u, alpha, power)
    y2, u2 = u + 0.5 * h * u1, _rate(y + 0.5 * h * y1, u + 0.5 * h * u1, alpha, power)
    y3, u3 = u + 0.5 * h * u2, _rate(y + 0.5 * h * y2, u + 0.5 * h * u2, alpha, power)
    y4, u4 = u + h * u3, _rate(y + h * y3, u + h * u3, alpha, power)
    return (
        y + h / 6.0 * (y1 + 2.0 * y2 + 2.0 * y3 + y4),
        u + h / 6.0 * (u1 + 2.0 * u2 + 2.0 * u3 + u4),
    )
