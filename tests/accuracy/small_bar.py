"""Small bars: one under a short blow, which takes tenths of a second, and one that breaks."""

from taichi_dem import CONCRETE, Scene, effects
from taichi_dem.mesh.shapes import bar

UNTIL, BROKEN_UNTIL = 2e-5, 3e-4


def struck_bar(damping=True):
    """Bar of 72 bodies under a blow on its left end, damped unless told otherwise."""
    blow = effects.GasPressure("left", peak=5e6, rise=1e-5)
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [blow, *([effects.BondDamping()] * damping)])


def laws(peak, blown="left", held="right"):
    """A blow [Pa] that comes back as tension, and all that may happen then."""
    breaks = [effects.Softening(), effects.ShearSlip(), effects.SphereContact(), effects.Friction()]
    blow = effects.GasPressure(blown, peak=peak, rise=1e-5, decay_ratio=1.5)
    return [blow, effects.BondDamping(), *breaks, effects.Fixed(held)]


def broken_bar(parts=(2, 1, 1)):
    """Bar of twelve bodies that its blow breaks."""
    return Scene(bar(0.1, 0.05, parts), CONCRETE, laws(peak=9e8))
