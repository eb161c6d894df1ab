"""Small bars: one under a short blow, which takes tenths of a second, and one that breaks."""

from taichi_dem import CONCRETE, Scene, effects
from taichi_dem.mesh.shapes import bar
from tests.structures import filled

UNTIL, BROKEN_UNTIL = 2e-5, 3e-4


def struck_bar(damping=True):
    """Bar of 72 bodies under a blow on its left end, damped unless told otherwise."""
    blow = effects.GasPressure("left", peak=5e6, rise=1e-5)
    acting = filled("bonds", blow, *([effects.BondDamping()] * damping))
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, acting)


def broken_bar():
    """Bar of twelve bodies that its blow breaks, as it comes back as tension."""
    blow = effects.GasPressure("left", peak=9e8, rise=1e-5, decay_ratio=1.5)
    bonds = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    acting = [blow, *bonds, effects.SphereContact(), effects.Friction(), effects.Fixed("right")]
    return Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, acting)
