"""Boxes on structures given by modes, as scenes in groups: one structure a group."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ca_damper.scenes.table import dealt
from ca_damper.structure import ModalStructure
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, instance, whole

#: Words for what a single container is on.
MOUNTS = ("spring", "base", "floor")
#: Modes that a kernel integrates at most: its compile time grows with their number.
MOST_MODES = 16
_SHARED = ("frequency", "base_amplitude", "dt")


class ModalMount:
    """What the scenes of each group hang on: a ModalStructure, with boxes at places."""

    def __init__(
        self, structure: ModalStructure, places: Sequence[int], force_place: int | None = None
    ):
        self.structure = instance("structure", structure, ModalStructure)
        whole("modes of a structure with boxes", structure.mode_count, 1, MOST_MODES)
        last = structure.place_count - 1
        self.places = tuple(whole("place of a box", place, 0, last) for place in places)
        if not self.places:
            raise InputError("boxes must be at least one, got none")
        empty = sorted(set(range(last + 1)) - set(self.places))
        self.scene_places = (*self.places, *empty)
        if force_place is not None:
            force_place = whole("force_place", force_place, 0, last)
        self.force_place = force_place
        self.sizes = np.abs(structure.shapes).max(axis=0)

    @property
    def group(self) -> int:
        """Scenes of a group."""
        return len(self.scene_places)

    def has_box(self, scenes: int) -> np.ndarray:
        """Which scenes have a box, (scenes,)."""
        return np.arange(scenes) % self.group < len(self.places)

    def check(self, table: Any) -> None:
        """InputError unless the scenes of a table make whole groups of equal time and base."""
        if table.count % self.group:
            raise InputError(
                f"scenes must be a multiple of {self.group}, the boxes and the places without one, "
                f"got {table.count}"
            )
        for name in _SHARED:
            of_groups = table.column(name).reshape(-1, self.group)
            if (of_groups != of_groups[:, :1]).any():
                raise InputError(f"{name} must be the same in all scenes of a group")

    def order(self, cost: np.ndarray, threads: int) -> np.ndarray:
        """First scenes of the groups as ``dealt`` orders them, then zeros, (scenes,) i32."""
        first = self.group * dealt(cost.reshape(-1, self.group).sum(axis=1), threads)
        return np.concatenate([first, np.zeros(len(cost) - len(first), dtype=first.dtype)])

    def of_modes(self) -> np.ndarray:
        """(4, modes): mass [kg], stiffness [N/m], damping [N s/m], share of the base's motion."""
        s, mass = self.structure, self.sizes**-2.0
        omega = 2.0 * np.pi * s.frequencies
        stiffness, damping = mass * omega**2, 2.0 * mass * omega * s.damping_ratios
        return np.stack([mass, stiffness, damping, self.sizes * s.participation])

    def of_scenes(self) -> np.ndarray:
        """(group, 2 modes + 1): shape at the place, what its motion adds to the modes, residual."""
        s = self.structure
        to_modes = (s.masses @ s.shapes) * self.sizes
        rows = [
            [
                *(s.shapes[i] / self.sizes),
                *(to_modes[i] * (i not in self.scene_places[:k])),
                s.residual[i],
            ]
            for k, i in enumerate(self.scene_places)
        ]
        return np.array(rows)

    def of_force(self) -> np.ndarray:
        """Shape at the place of the force, (modes,); zeros without a force."""
        if self.force_place is None:
            return np.zeros_like(self.sizes)
        row: np.ndarray = self.structure.shapes[self.force_place] / self.sizes
        return row


def checked_mount(mount: Any, structure: Any) -> tuple[str, ModalMount | None]:
    """Word for the mount of a batch, and the ModalMount if it has one; InputError."""
    word = choice("mount", mount, MOUNTS)
    if structure is None:
        return word, None
    if word != "spring":
        raise InputError(f"mount must be 'spring' for boxes on a structure, got {word!r}")
    return "structure", instance("structure", structure, ModalMount)
