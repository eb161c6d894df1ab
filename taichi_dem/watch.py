"""Looks, at recording times, for effects that a scene left out and the run turns out to need."""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_dem.physics.fracture import coulomb_limit


@dataclass
class Missed:
    """A need that no listed effect serves.

    effect: what to list. what: the finding in words. times: recordings that saw it. most: the
    largest number of places in one of them. where: first such bond. first_s: when first [s].
    """

    effect: str
    what: str
    times: int = 0
    most: int = 0
    where: int = -1
    first_s: float = 0.0

    def __str__(self):
        return (
            f"{self.effect} is left out, but {self.what}: up to {self.most} at a time, first at "
            f"t = {self.first_s:.4g} s (bond {self.where}), seen at {self.times} recordings"
        )


_NEEDS = (
    ("tension", "Softening", "bonds are stretched past their tensile strength"),
    ("shear", "ShearSlip", "bonds are sheared past their Coulomb limit"),
    ("contact", "SphereContact", "bodies overlap where a bond has been released"),
)


@ti.data_oriented
class Watch:
    """Counts the places where an absent effect would have acted, at recording times."""

    def __init__(self, model, state, advance):
        self.model, self.state, self.advance = model, state, advance
        listed = {effect.role for effect in model.effects if effect.name}
        self.missed = {
            role: Missed(effect, what) for role, effect, what in _NEEDS if role not in listed
        }
        material = model.material
        self.limits = ti.Vector([material.tensile_strength, material.cohesion, material.friction])

    def look(self, time_s):
        """Update the findings at a recording time [s]."""
        if not self.missed or self.model.bond_count == 0:
            return
        marks = np.zeros((self.model.bond_count, 3), dtype=np.int32)
        self._mark(marks)
        for column, (role, _, _) in enumerate(_NEEDS):
            places = np.flatnonzero(marks[:, column])
            if role in self.missed and len(places):
                missed = self.missed[role]
                if missed.times == 0:
                    missed.where, missed.first_s = int(places[0]), time_s
                missed.times += 1
                missed.most = max(missed.most, len(places))

    def saved(self):
        """What a checkpoint holds of it, arrays by name."""
        rows = [[m.times, m.most, m.where, m.first_s] for m in self.missed.values()]
        return {"missed": np.array(rows, dtype=np.float64).reshape(-1, 4)}

    def resume(self, saved):
        """Take over what ``saved`` gave."""
        for missed, row in zip(self.missed.values(), saved["missed"].tolist()):
            missed.times, missed.most, missed.where = (int(value) for value in row[:3])
            missed.first_s = row[3]

    def findings(self):
        """Sentences about effects that were needed, an empty tuple where none was."""
        return tuple(str(missed) for missed in self.missed.values() if missed.times)

    @ti.kernel
    def _mark(self, marks: ti.types.ndarray(dtype=ti.i32, ndim=2)):
        for b in range(self.model.bond_count):
            opening = self.advance.bond_opening(b)
            stiffness = self.model.bond_stiffness[b]
            if self.state.broken_tick[b] < 0:
                pull = stiffness[0] * opening[0]
                limit = coulomb_limit(self.limits[1], self.limits[2], -pull)
                marks[b, 0] = ti.cast(pull > self.limits[0], ti.i32)
                marks[b, 1] = ti.cast(stiffness[1] * opening[1] > limit, ti.i32)
            else:
                marks[b, 2] = ti.cast(opening[0] < 0.0, ti.i32)
