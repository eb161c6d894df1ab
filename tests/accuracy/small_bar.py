"""A small bar under a short blow on its left end, of which a question takes tenths of a second."""

from taichi_dem import CONCRETE, Scene, effects
from taichi_dem.mesh.shapes import bar

UNTIL = 2e-5


def struck_bar(*more, damping=True):
    """Bar of 72 bodies, damped unless told otherwise, with further effects."""
    blow = effects.GasPressure("left", peak=5e6, rise=1e-5)
    damped = [effects.BondDamping()] if damping else []
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [blow, *damped, *more])
