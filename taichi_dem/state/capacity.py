"""Capacity of an engine; counts of a scene are read at run time."""

from typing import NamedTuple

from taichi_dem.kit.errors import InputError
from taichi_dem.state.model import Model

#: Spare entries of the lists of a contact search, beside those of each body.
SPARE_PAIRS, SPARE_SPHERES, SPARE_NEIGHBOURS = 64, 4096, 1024
#: Entries of one list, whose indices are counted in 32 bits.
_MOST_ENTRIES = 2**31 - 1


class Capacity(NamedTuple):
    """Room of an engine: bodies, and for each of them spheres on a face and entries of lists.

    pairs, pair_spheres, neighbours: mean entries of a body; 0 without contact.
    """

    bodies: int
    face_spheres: int = 0
    pairs: int = 0
    pair_spheres: int = 0
    neighbours: int = 0

    @property
    def faces(self) -> int:
        """Faces of all bodies."""
        return 4 * self.bodies

    @property
    def bonds(self) -> int:
        """Bonds: each takes two of the four faces of a body."""
        return 2 * self.bodies

    @property
    def units(self) -> int:
        """Contact units of all bonds."""
        return 3 * self.bonds

    @property
    def spheres(self) -> int:
        """Contact spheres on all faces."""
        return self.faces * self.face_spheres

    @property
    def pair_entries(self) -> int:
        """Pairs of bodies."""
        return self.bodies * self.pairs + SPARE_PAIRS

    @property
    def sphere_entries(self) -> int:
        """Pairs of spheres."""
        return self.bodies * self.pair_spheres + SPARE_SPHERES

    @property
    def neighbour_entries(self) -> int:
        """Entries of the list of neighbours."""
        return self.bodies * self.neighbours + SPARE_NEIGHBOURS

    def check(self) -> None:
        """Raise InputError where a list would have more entries than can be counted."""
        largest = max(9 * self.bonds, self.spheres, 2 * self.pair_entries, self.sphere_entries)
        if max(largest, self.neighbour_entries) > _MOST_ENTRIES:
            raise InputError(
                f"lists must have at most {_MOST_ENTRIES} entries, a mesh of {self.bodies} bodies "
                "with these options of its contact has more: take a smaller mesh or shorter lists"
            )


def capacity_of(model: Model) -> Capacity:
    """Capacity that a ``Model`` needs."""
    if not model.has_contact:
        return Capacity(model.body_count)
    return Capacity(model.body_count, model.contact.face_spheres, *model.contact.lengths)


#: Smallest engine: the paper's block and contact lists of the usual length find room in it.
LEAST = Capacity(1024, 6, 24, 160, 64)
