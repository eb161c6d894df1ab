"""A small bar that is blown at one end: 16 bonds break, and what they held touches, in 5.5e-5 s."""

from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, StepControl, Uniform, effects
from taichi_dem.mesh.shapes import bar
from tests.scenes import paper_effects

METHODS = {
    "uniform": Uniform(2e-8, 2e-7),
    "controlled": Multirate(8e-8, 1e-5, control=StepControl(dashpot_floor=1e-8), dashpot="limited"),
    "implicit": ImplicitDashpots(4e-7, refresh=1e-5),
}
UNTIL = 8.4e-5


def bar_scene(*more, kind=effects.SphereContact):
    """Bar of 72 bodies and 112 bonds with all effects of the paper and more; kind: of contact."""
    listed = paper_effects(kind=kind)[:-1]
    gas = effects.GasPressure("left", peak=2e9, rise=1e-5)
    return Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [*listed, gas, *more])
