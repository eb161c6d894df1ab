"""Grains in boxes of their size, and the boxes that hold one mass of them."""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
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

    def __str__(self) -> str:
        sizes = (self.diameter, self.width, self.height, self.clearance)
        size, width, height, gap = (f"{1e3 * one:.3g}" for one in sizes)
        box = f"{width} x {height} mm, clearance {gap} mm"
        return f"{self.particles} grains of {size} mm in a box of {box}"

    @property
    def settled(self) -> float:
        """Height of the settled grains [m]."""
        return self.diameter * self.particles / _cells(self.width, self.diameter)

    @property
    def clearance(self) -> float:
        """Distance from the settled grains to the lid [m]."""
        return self.height - self.settled

    def with_clearance(self, clearance: float) -> "Grains":
        """The grains in a box as high as a clearance needs [m]."""
        return self._replace(height=self.settled + clearance)

    def between_neighbours(self, tried: Iterable["Grains"]) -> list["Grains"]:
        """Boxes half-way to the next lower and higher one of as many grains that was tried."""
        rows = sorted(round(one.height / one.diameter) for one in tried if one[:4] == self[:4])
        k = rows.index(round(self.height / self.diameter))
        near = itertools.pairwise(rows[max(0, k - 1) : k + 2])
        new = {(low + high) // 2 for low, high in near}.difference(rows)
        return [self._replace(height=row * self.diameter) for row in sorted(new)]

    def with_errors(self, share: float) -> Iterator[tuple[str, "Grains"]]:
        """Boxes with one error of manufacture, all else as it was, and its name."""
        for by in (1.0 + share, 1.0 - share):
            change = f"{100.0 * (by - 1.0):+.3g} %"
            yield f"clearance {change}", self.with_clearance(by * self.clearance)
            yield f"mass {change}", self._replace(mass=by * self.mass)
            other = self._replace(diameter=by * self.diameter)
            if other.diameter <= self.width:
                yield f"size {change}", other.with_clearance(self.clearance)

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


def _cells(length: float, size: float) -> int:
    """Whole cells in a length."""
    return int(length / size * (1.0 + 1e-9))


def boxes_of(
    mass: float, counts: Sequence[int], box: Any, density: float, heights: int
) -> list[Grains]:
    """Boxes to look at: grains of one mass in whole cells of their size."""
    width, height = pair_of("box", box, "an inner width and a greatest inner height [m]", positive)
    boxes, enough = [], []
    for count in counts:
        own = mass / count
        size = diameter_of(own, density)
        columns, most = _cells(width, size), _cells(height, size)
        least = 1 + math.ceil(count / max(1, columns))
        if columns and most >= least:
            rows = np.unique(np.linspace(least, most, heights).round().astype(int))
            boxes += [Grains(count, own, size, columns * size, row * size) for row in rows]
        enough.append((max(width, size), least * size))
    if not boxes:
        # Upwards to a tenth of a millimetre, so that it does.
        wide, high = (math.ceil(1e4 * length - 1e-6) / 1e4 for length in min(enough))
        raise InputError(
            f"box must hold {mass:g} kg of grains with a layer free above them, in one sheet that "
            f"is a grain deep: at least ({wide:g}, {high:g}) m, got {shown(box)} m for "
            f"{listed(counts)} grains"
        )
    return boxes
