"""Numbers of each connected part of a scene, by which an effect is judged there.

A part is judged by its own size, stiffness, strength, loads and speed: beside a large or fast part,
a mean or a largest value of all would hide what moves or breaks a small or slow one.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from taichi_dem.mesh.parts import part_boxes, parts_under
from taichi_dem.state.model import Model

#: Standard weight [m/s^2].
WEIGHT = 9.80665


class PartScales:
    """Numbers of connected parts, arrays (count,).

    part: of each body, as from ``parts_of``. first: its lowest body. mass [kg], density [kg/m^3],
    size: longest side of its box [m], spacing: of its bodies [m]; of_bonds: part of each bond,
    is_bonded: whether a part has any; wave: speed of sound [m/s]; damping: share of its energy that
    a bond between bodies of mean size loses in a cycle.
    """

    def __init__(self, model: Model, part: np.ndarray):
        self.model, self.part, self.count = model, part, int(part.max()) + 1
        self.first = np.unique(part, return_index=True)[1]
        self.bodies, self.mass = np.bincount(part), self.sum(model.body_mass)
        corners = model.mesh.points[model.mesh.tetrahedra]
        low, high = part_boxes(corners, part)
        edges = corners[:, 1:] - corners[:, :1]
        self.density = self.mass / self.sum(np.abs(np.linalg.det(edges)) / 6.0)
        self.size = (high - low).max(axis=1)
        self.spacing = 2.0 * self.sum(model.body_radius) / self.bodies
        self._join()

    def sum(self, values: np.ndarray) -> np.ndarray:
        """Sum of a number of each body over every part."""
        return np.bincount(self.part, values, minlength=self.count)

    def sum_of_bonds(self, values: np.ndarray) -> np.ndarray:
        """Sum of a number of each bond over every part."""
        return np.bincount(self.of_bonds, values, minlength=self.count)

    def _join(self):
        """Stiffness and damping of the bonds of each part: medians, where bonds differ."""
        model, bonds = self.model, self.model.bond_count
        self.of_bonds = self.part[model.topology.master]
        self.is_bonded = np.bincount(self.of_bonds, minlength=self.count) > 0
        normal = np.full(self.count, self._stiffness_of_all())
        self.damping = np.zeros(self.count)
        if bonds:
            order = np.argsort(self.of_bonds, kind="stable")
            ends = np.cumsum(np.bincount(self.of_bonds, minlength=self.count))[:-1]
            stiffness, damping = model.bond_stiffness[:, 0], model.bond_damping[:, 0]
            area, pair = 3.0 * model.bonds["area"], 0.5 * self.mass / self.bodies
            for p, own in enumerate(np.split(order, ends)):
                if len(own):
                    normal[p] = np.median(stiffness[own])
                    rate = float(area[own].mean()) / (normal[p] * pair[p])
                    self.damping[p] = 2.0 * math.pi * np.median(damping[own]) * math.sqrt(rate)
        self.wave = np.sqrt(normal * self.spacing / self.density)

    def _stiffness_of_all(self):
        """Normal stiffness per area [Pa/m] where a part has no bond; NaN where only bonds have."""
        if not self.model.bond_count:
            given = self.model.material.normal_stiffness
            return float(given) if isinstance(given, (int, float)) else math.nan
        return float(np.median(self.model.bond_stiffness[:, 0]))

    def of_materials(self, name: str, choose: Any) -> np.ndarray:
        """A constant of each part: ``np.minimum`` or ``np.maximum`` of those of its bodies."""
        materials = self.model.materials
        values = np.array([getattr(one, name) for one in materials.materials], dtype=np.float64)
        found = values[materials.of_body[self.first]]
        choose.at(found, self.part, values[materials.of_body])
        return found

    def under(self, effects: Iterable[Any]) -> np.ndarray:
        """Whether any of some effects acts on each part."""
        marks = [parts_under(self.model.mesh, effect, self.part) for effect in effects]
        return np.any([np.zeros(self.count, dtype=bool), *marks], axis=0)

    def stress(self, effects: Iterable[Any], size: np.ndarray, everywhere: bool) -> np.ndarray:
        """Sum of the stresses of loads and supports [Pa]; NaN where it is not known.

        size: of each part, or of what it may rest on [m]. everywhere: whether each effect may
        reach all parts.
        """
        of_body, materials = self.model.materials.of_body, self.model.materials.materials
        present = np.zeros((self.count, len(materials)), dtype=bool)
        present[self.part, of_body] = True
        total = np.zeros(self.count)
        for effect in effects:
            acts = parts_under(self.model.mesh, effect, self.part) | everywhere
            for p in np.flatnonzero(acts):
                own = [one for one, here in zip(materials, present[p]) if here]
                total[p] += max(effect.stress(one, float(size[p])) for one in own)
        return total

    def weight_stress(self, until: float) -> np.ndarray:
        """Largest stress that weight may cause in a part that something bears, by a time [Pa].

        That of a beam of its length and thickness, as if it were held at one end and its weight set
        in at once, twice that at rest, 3 density g length^2 / thickness; but no more than a speed
        of g until causes in a beam, sqrt(3) density wave g until.
        """
        long, thin = self._extents()
        bent = 6.0 * WEIGHT * long**2 / thin
        return self.density * np.minimum(bent, math.sqrt(3.0) * self.wave * WEIGHT * until)

    def _extents(self):
        """Longest and shortest side [m] of the box with the second moments of each part."""
        mass, inertia = self.model.body_mass, self.model.body_inertia
        centre = np.stack([self.sum(mass * x) / self.mass for x in self.model.centre.T], axis=1)
        arm = self.model.centre - centre[self.part]
        own = 0.5 * np.trace(inertia, axis1=1, axis2=2)[:, None, None] * np.eye(3) - inertia
        rows = own + mass[:, None, None] * arm[:, :, None] * arm[:, None]
        second = np.stack([self.sum(row) for row in rows.reshape(-1, 9).T], axis=1)
        squares = np.linalg.eigvalsh((second / self.mass[:, None]).reshape(-1, 3, 3))
        sides = np.sqrt(12.0 * np.maximum(squares, 0.0))
        return sides[:, 2], sides[:, 0]
