"""The paper's blast, and the methods by which its experiments run it."""

import numpy as np

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    Every,
    ImplicitDashpots,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    effects,
    quality_report,
    read_mesh,
)
from taichi_dem.kit.study import parser

#: Drivers of a blast, the first the default.
BLAST_DRIVERS = ("auto", "resident", "parallel")
#: Metres that a body may go in a second's worth of the paper's largest step: l = 1e-7 m at 1e-8 s.
WAY_PER_STEP = 10.0
EFFECTS = {
    "bond_damping": effects.BondDamping,
    "softening": effects.Softening,
    "shear_slip": effects.ShearSlip,
    "sphere_contact": effects.SphereContact,
    "friction": effects.Friction,
    "gas_pressure": effects.GasPressure,
    "gravity": effects.Gravity,
}


def blast_parser(name, description, drivers=BLAST_DRIVERS):
    """Parser of an experiment on the paper's block or another mesh."""
    made = parser(name, description, drivers)
    made.add_argument("--mesh", default=PAPER_BLOCK, help="tetrahedra with a face group hole")
    return made


class Costs:
    """Observer that keeps what a run has cost at every sample, and the levels of its bodies."""

    when = Every(samples=1)

    def __init__(self):
        self.columns, self.levels, self.view = {"cpu_s": [], "evaluations": []}, [], None

    def observe(self, view):
        """Take a row."""
        self.view = view
        self.columns["cpu_s"].append(view.cpu_seconds)
        self.columns["evaluations"].append(view.evaluations)
        self.levels.append(view.motion()["level"])


def level_shares(levels):
    """Share of bodies on each level: rows (sample, level) that sum to 1."""
    count = max(int(level.max()) for level in levels) + 1
    return np.array([np.bincount(level, minlength=count) / len(level) for level in levels])


def paper_effects():
    """All effects of the paper's scene."""
    return [make() for name, make in EFFECTS.items() if name != "gravity"]


def print_quality(scene):
    """Print the worst of a scene's mesh."""
    print("\n".join(str(quality_report(scene.mesh, scene.material)).splitlines()[:7]))


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
