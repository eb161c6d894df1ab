"""Grains in boxes of their size, and the boxes that hold one mass of them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ca_damper.automaton import Automaton
from ca_damper.spheres import Spheres
from taichi_dem.kit.display import listed
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import positive, shown

#: Of the default grains [kg/m^3].
DENSITY = Automaton.particle_mass / (math.pi / 6.0 * Automaton.width**3)


class Grains(NamedTuple):
    """Grains in a box: number, mass of each [kg], diameter [m], inner width and height [m]."""

    particles: int
    mass: float
    diameter: float
    width: float
    height: float

    @property
    def clearance(self) -> float:
        """Distance from the settled grains to the lid [m]."""
        columns = int(self.width / self.diameter * (1.0 + 1e-9))
        return self.height - self.diameter * self.particles / columns

    def put_into(self, filling: Any) -> Any:
        """The filling with these grains in this box."""
        if isinstance(filling, Spheres):
            box = {"diameter": self.diameter, "width": self.width, "height": self.height}
        else:
            columns, rows = (round(x / self.diameter) for x in (self.width, self.height))
            box = {"width": self.diameter, "columns": columns, "rows": rows}
        return replace(filling, particle_mass=self.mass, **box)


def pair_of(name: str, value: Any, words: str, check: Any) -> tuple[Any, Any]:
    """Two values that have passed a check; InputError for anything but two."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(f"{name} must be {words}, got {shown(value)}")
    return check(name, value[0]), check(name, value[1])


def diameter_of(mass: float, density: float) -> float:
    """Diameter of a ball [m]."""
    return (6.0 * mass / (math.pi * density)) ** (1.0 / 3.0)


def boxes_of(
    mass: float, counts: Sequence[int], box: Any, density: float, heights: int
) -> list[Grains]:
    """Boxes to look at: grains of one mass in whole cells of their size."""
    width, height = pair_of("box", box, "an inner width and a greatest inner height [m]", positive)
    found = []
    for count in counts:
        own = mass / count
        size = diameter_of(own, density)
        columns, most = (int(one / size * (1.0 + 1e-9)) for one in (width, height))
        least = 1 + math.ceil(count / max(1, columns))
        if columns > 0 and most >= least:
            rows = np.unique(np.linspace(least, most, heights).round().astype(int))
            found += [Grains(count, own, size, columns * size, row * size) for row in rows]
    if not found:
        raise InputError(
            f"box must hold {mass:g} kg of grains with a layer free above them, got "
            f"{shown(box)} m for {listed(counts)} grains"
        )
    return found


def shifted(best: Grains, share: float) -> Iterator[tuple[str, Grains]]:
    """Boxes with an error of manufacture, and its name, where the grains still fit."""
    # Balls of one density weigh by the cube of their size.
    for sign in (1.0, -1.0):
        by = 1.0 + sign * share
        taller = best.height + sign * share * best.clearance
        yield f"clearance {_change(by)}", best._replace(height=taller)
        count = max(1, round(by * best.particles))
        more = _change(count / best.particles)
        yield f"number {more}, mass {more}", best._replace(particles=count)
        other = best._replace(diameter=by * best.diameter, mass=by**3 * best.mass)
        if other.clearance > 0.0:
            yield f"size {_change(by)}, mass {_change(by**3)}", other


def _change(factor):
    return f"{100.0 * (factor - 1.0):+.3g} %"
