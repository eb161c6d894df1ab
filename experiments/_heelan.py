"""Waves of a short charge in a long thin hole along z in elastic rock: near and far field, lobes.

A unit of pressure in a unit of volume of the hole has the moments l + 2m, l + 2m and l over m along
x, y and z, l and m the constants of Lame. All fields are at one frequency, as exp(-i w t). Sources:
P. A. Heelan, Radiation from a cylindrical source of finite length, Geophysics 18, 1953, 685-696; K.
Aki and P. G. Richards, Quantitative Seismology, 2nd ed., 2002, eq. 4.29.
"""

import numpy as np

from _tunnel import ROCK

#: Places in half of a charge, and weights.
GAUSS = np.polynomial.legendre.leggauss(4)


def of_charge(places, turn, cp, cs, half):
    """Velocities at places (n, 3) per pressure and volume of a charge along z, at a frequency."""
    points = zip(*GAUSS)
    moved = sum(0.5 * w * of_moments(places - (0, 0, half * z), turn, cp, cs) for z, w in points)
    return -1j * turn * moved


def far_field(places, turn, cp, cs, half):
    """The same far away: lobes (c_p / c_s)^2 - 2 cos^2 of P and the sine of the doubled angle."""
    distance = np.linalg.norm(places, axis=1)[:, None]
    out, across = ways(places)
    cosine, total = out[:, 2:], 0.0
    sine = np.sqrt(1.0 - cosine**2)
    lobes_of = ((cp / cs) ** 2 - 2.0 * cosine**2) * out, 2.0 * sine * cosine * across
    for c, lobe in zip((cp, cs), lobes_of):
        k = turn / c
        wave = np.exp(1j * k * distance) * np.sinc(k * half * cosine / np.pi) / distance
        total = total - turn * k * wave * lobe / (4.0 * np.pi * ROCK.density * c**2)
    return total


def ways(places):
    """Unit vectors away from the charge, and across in its plane, away from the hole, (n, 3)."""
    out = places / np.linalg.norm(places, axis=1)[:, None]
    sine = np.hypot(out[:, 0], out[:, 1])
    return out, np.column_stack([out[:, 2:] * out[:, :2] / sine[:, None], -sine])


def of_moments(x, turn, cp, cs):
    """Displacements at x (n, 3) by the three moments in one point, near and far field."""
    distance, z = np.linalg.norm(x, axis=1)[:, None], x[:, 2:]
    p, s = (slopes(turn / c, distance) for c in (cp, cs))
    along = np.array([0.0, 0.0, 1.0])
    second, third = s[1] - p[1], s[2] - p[2]
    # The sum of a swelling in all directions and a moment along the hole.
    swelling = -((cp / cs) ** 2) * (turn / cp) ** 2 * p[0] * x
    twice = (third * z * z + second) * x + 2.0 * second * z * along
    axial = 2.0 * ((turn / cs) ** 2 * s[0] * z * along + twice)
    return (swelling + axial) / (4.0 * np.pi * ROCK.density * turn**2)


def slopes(k, r):
    """The operator d / (r dr) once, twice and three times on exp(i k r) / r."""
    q, wave = 1j * k * r, np.exp(1j * k * r)
    cubic = -15.0 + 15.0 * q - 6.0 * q**2 + q**3
    return wave * (q - 1.0) / r**3, wave * (3.0 - 3.0 * q + q**2) / r**5, wave * cubic / r**7
