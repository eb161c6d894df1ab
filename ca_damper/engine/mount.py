"""What the containers of a batch are on, by its modes: one a scene, or structures with boxes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ca_damper.scenes.table import SceneTable, dealt
from ca_damper.structure import ModalStructure
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, instance, whole

#: Words for what a single container is on.
MOUNTS = ("spring", "base", "floor")
#: Modes that a kernel integrates at most: its compile time grows with their number.
MOST_MODES = 16
_SHARED = ("frequency", "base_amplitude", "dt")


class MountKind(NamedTuple):
    """What is compiled: a word, and the number of modes."""

    word: str
    modes: int = 1


class Mount:
    """A container of its own in each scene: one mode, that of the table's mass on its spring."""

    #: Scenes on a structure, and those of them that have a box.
    group = boxes = 1

    def __init__(self, word: str):
        self.kind = MountKind(choice("mount", word, MOUNTS))

    def has_box(self, scenes: int) -> np.ndarray:
        """Which scenes have a box, the first of each group, (scenes,)."""
        return np.arange(scenes) % self.group < self.boxes

    def check(self, table: SceneTable) -> None:
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

    def frequencies(self, table: SceneTable) -> np.ndarray:
        """Natural frequencies of what excitation moves [Hz]."""
        if self.kind.word != "spring":
            return np.empty(0)
        return np.sqrt(table.column("stiffness") / table.column("mass")) / (2.0 * np.pi)

    def masses(self, table: SceneTable) -> np.ndarray:
        """Mass that a blow in each scene moves [kg], (scenes,)."""
        mass = table.column("mass")
        return np.full_like(mass, np.inf) if self.kind.word == "base" else mass

    def numbers(self, table: SceneTable) -> dict[str, np.ndarray]:
        """Numbers of a ``Container`` by name, (scenes, modes) or (scenes,).

        mass [kg], stiffness [N/m], damping [N s/m], share of the base's motion, and of the force,
        of the modes; of the place of a scene its shape, what its motion adds to the modes, the
        share of the base's motion that no mode has, and the first scene there, within its group.
        """
        each = np.ones((table.count, 1))
        moves = 0.0 if self.kind.word == "base" else 1.0
        of_table = {name: table.column(name)[:, None] for name in ("mass", "stiffness", "damping")}
        return {**of_table, "share": each, "pushed": each, "shape": moves * each, "lift": each}


class ModalMount(Mount):
    """A ModalStructure for each group of scenes, with boxes at places."""

    def __init__(
        self, structure: ModalStructure, places: Sequence[int], force_place: int | None = None
    ):
        self.structure = instance("structure", structure, ModalStructure)
        modes = whole("modes of a structure with boxes", structure.mode_count, 1, MOST_MODES)
        self.kind = MountKind("structure", modes)
        last = structure.place_count - 1
        self.places = tuple(whole("place of a box", place, 0, last) for place in places)
        if not self.places:
            raise InputError("boxes must be at least one, got none")
        empty = sorted(set(range(last + 1)) - set(self.places))
        self.scene_places = (*self.places, *empty)
        self.group, self.boxes = len(self.scene_places), len(self.places)
        if force_place is not None:
            force_place = whole("force_place", force_place, 0, last)
        self.force_place = force_place

    def frequencies(self, table: SceneTable) -> np.ndarray:
        """Those of the structure."""
        return self.structure.frequencies

    def masses(self, table: SceneTable) -> np.ndarray:
        """Of the places, infinite where nothing moves one."""
        recoils = np.array([self.structure.recoil(place) for place in self.scene_places])
        return np.resize(1.0 / np.maximum(recoils, 1e-300), table.count)

    def numbers(self, table: SceneTable) -> dict[str, np.ndarray]:
        """In metres: a mode moves one place by its coordinate, and no other by more."""
        s, scenes = self.structure, self.scene_places
        sizes = np.abs(s.shapes).max(axis=0)
        mass, omega = sizes**-2.0, 2.0 * np.pi * s.frequencies
        to_modes = (s.masses @ s.shapes) * sizes
        pushed = 0.0 * sizes if self.force_place is None else s.shapes[self.force_place] / sizes
        groups = {
            "mass": mass,
            "stiffness": mass * omega**2,
            "damping": 2.0 * mass * omega * s.damping_ratios,
            "share": sizes * s.participation,
            "pushed": pushed,
        }
        # Of several boxes at a place, the first moves the modes at the start.
        home = np.array([scenes.index(place) for place in scenes])
        is_first = (home == np.arange(len(scenes)))[:, None]
        places = {
            "shape": s.shapes[[*scenes]] / sizes,
            "lift": to_modes[[*scenes]] * is_first,
            "residual": s.residual[[*scenes]],
            "home": home,
        }
        of_group = np.arange(table.count) % self.group
        same = {name: np.tile(row, (table.count, 1)) for name, row in groups.items()}
        return {**same, **{name: rows[of_group] for name, rows in places.items()}}


def mount_of(word: str, structure: ModalMount | None) -> Mount:
    """What a batch is on; InputError."""
    mount = Mount(word)
    if structure is None:
        return mount
    if word != "spring":
        raise InputError(f"mount must be 'spring' for boxes on a structure, got {word!r}")
    return instance("structure", structure, ModalMount)
