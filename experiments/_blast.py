"""The paper's blast, and the methods by which its experiments run it."""

from _cli import PAPER_BLOCK
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    effects,
    read_mesh,
)

#: Metres that a body may go in a second's worth of the paper's largest step: l = 1e-7 m at 1e-8 s.
WAY_PER_STEP = 10.0


def paper_effects():
    """All effects of the paper's scene."""
    return [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        effects.SphereContact(),
        effects.Friction(),
        effects.GasPressure(),
    ]


def paper_scene(mesh=PAPER_BLOCK):
    """The paper's scene with all of its effects; mesh: a file."""
    return Scene(read_mesh(mesh), CONCRETE, paper_effects())


def paper_uniform(step):
    """The paper's rule with one step for all; step: its largest [s]."""
    return Uniform(step, WAY_PER_STEP * step)


def paper_multirate(step):
    """The paper's rule with a step for each."""
    return Multirate(step, WAY_PER_STEP * step)


def multirate_controlled(step):
    """Steps for each by what limits them, down to an eighth, with dashpots limited to that."""
    # With the usual 0.25 the hole is 0.24 % off at 5e-4 s, with 0.2 less than 0.2 %.
    control = StepControl(safety=0.2, dashpot_floor=step / 8.0)
    return Multirate(step, 1e-5, control=control, dashpot="limited")


def explicit_limited(step):
    """One fixed step for all, dashpots limited to what it bears."""
    return Uniform(step, dashpot="limited")


#: Method by name: how it is made of a step [s], and the step that it is used with.
METHODS = {
    "paper_uniform": (paper_uniform, 1e-8),
    "paper_multirate": (paper_multirate, 1e-8),
    "multirate_controlled": (multirate_controlled, 8e-8),
    "explicit_limited": (explicit_limited, 2.5e-8),
    "implicit": (ImplicitDashpots, 4e-7),
}
