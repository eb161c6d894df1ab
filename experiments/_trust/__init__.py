"""Cases of others, for trust.py: one file a case, each a function of an ``Effort``.

It returns its numbers, and a function that draws them on axes.
"""

from dataclasses import dataclass

from _trust.bar_wave import bar_wave
from _trust.blast import blast
from _trust.branching import branching
from _trust.crack import crack
from _trust.disc import disc
from _trust.joint import joint
from _trust.rotation import rotation
from _trust.slope import slope
from _trust.spall import spall

#: Cases by name, in the order of the page.
CASES = {
    "bar_wave": bar_wave,
    "spall": spall,
    "disc": disc,
    "crack": crack,
    "branching": branching,
    "joint": joint,
    "blast": blast,
    "slope": slope,
    "rotation": rotation,
}


@dataclass(frozen=True)
class Effort:
    """What is spent: random meshes of a size, sizes of element, and the first seed."""

    meshes: int
    sizes: int
    seed: int

    @property
    def seeds(self):
        """Of the meshes."""
        return range(self.seed, self.seed + self.meshes)
