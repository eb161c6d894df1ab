"""Warning where a number looks as if it were given in another unit than the one it is read in."""

import dataclasses
import os
import sys
import warnings
from typing import NamedTuple

_PACKAGES = tuple(
    os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(__file__))), name, "")
    for name in ("taichi_dem", "ca_damper")
)


class UnitWarning(UserWarning):
    """A number that another unit would explain; it is used in the unit that the docs name."""


class Quantity(NamedTuple):
    """Unit of a quantity, and the units in which its usual values lie between two numbers."""

    unit: str
    others: tuple[tuple[float, float, str], ...]


#: Ice, concrete, rocks and metals have 0.9 to 8.9 g/cm^3; a foam some 15 kg/m^3.
DENSITY = Quantity("kg/m^3", ((0.8, 9.0, "g/cm^3"),))
#: Rocks have 1 to 200 GPa; rubber 1e6 Pa, gels some 1e3 Pa.
MODULUS = Quantity("Pa", ((0.5, 1e3, "GPa"),))
#: Rocks have 0.1 to 300 MPa; loose soil some 1e3 Pa.
STRENGTH = Quantity("Pa", ((0.1, 1e3, "MPa"),))
#: Blasts and blows have 5 to 1000 MPa; 1 is the load of many a linear question.
PRESSURE = Quantity("Pa", ((5.0, 1e3, "MPa"),))
#: Friction angles are 5 to 60 degrees.
ANGLE = Quantity("degrees", ((0.05, 1.5, "radians"),))
#: Gas rises within 0.01 to 1 ms, or 10 to 1000 us.
BLAST_RISE = Quantity("s", ((0.01, 1.0, "ms"), (5.0, 5e3, "us")))
#: Edges of tetrahedra: 1 mm to 10 m.
EDGE = Quantity("m", ((20.0, 1e4, "mm"),))
#: Accelerations: up to some 200 times gravity in a centrifuge.
ACCELERATION = Quantity("m/s^2", ((5e3, 2e4, "mm/s^2"),))
#: Masses of grains, told by their density: 100 to 20,000 kg/m^3.
GRAIN_MASS = Quantity("kg", ((4e5, 4e7, "g"),))
#: Grains: 0.1 to 100 mm; boxes: 5 mm to 2 m.
GRAIN, BOX = Quantity("m", ((0.5, 100.0, "mm"),)), Quantity("m", ((5.0, 2e3, "mm"),))


def likely_unit(value: float, quantity: Quantity) -> str:
    """Unit in which a number would be a usual one, "" where it may be what it says."""
    within = (unit for least, most, unit in quantity.others if least <= abs(value) < most)
    return next(within, "")


def in_unit(name: str, value: float, quantity: Quantity, told_by: float | None = None) -> float:
    """The value; UnitWarning where it looks as if it were given in another unit."""
    likely = likely_unit(value if told_by is None else told_by, quantity)
    if likely:
        warn_of_unit(f"{name} is read in {quantity.unit}, got {value:g}: likely {likely} is meant")
    return value


def warn_of_unit(sentence: str) -> None:
    """Warn at the line of the user that leads here, so that it is shown once."""
    depth, frame = 1, sys._getframe()
    while frame.f_back and _is_ours(frame.f_code.co_filename):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(sentence, UnitWarning, stacklevel=depth)


def _is_ours(path):
    """Whether code lies in the packages, or is that of ``dataclasses`` and what it made."""
    return path.startswith(_PACKAGES) or path in ("<string>", dataclasses.__file__)
