"""The paper's blast, the methods by which its experiments run it, and what a run has cost."""

from functools import partial

import taichi_dem as dem
from taichi_dem.kit.study import add_checkpoints, checkpoint_of, parser
from taichi_dem.methods import ImplicitDashpots, Multirate, Uniform
from taichi_dem.step_control import StepControl

#: Drivers of a blast, the first the default.
BLAST_DRIVERS = ("auto", "resident", "parallel")
#: Fracture energy of mode II [J/m^2], ten times that of mode I.
MODE_TWO = 1000.0
#: Step of a run of the full block, 3 m deep, with dashpots solved [s].
BLOCK_STEP = 4e-7
#: Radius of the hole [m], and how many of them away the fall of peak velocities is fitted from.
HOLE_RADIUS, FROM_RADII = 0.025, 4.0
EFFECTS = {
    "bond_damping": dem.effects.BondDamping,
    "softening": dem.effects.Softening,
    "shear_slip": dem.effects.ShearSlip,
    # The paper's reading: faces carry spheres once they break, outer faces never.
    "sphere_contact": partial(dem.effects.SphereContact, outer_faces=False),
    "surface_contact": dem.effects.SphereContact,
    # As effects="auto" takes it for a block in one piece.
    "body_contact": partial(dem.effects.BodyContact, outer_faces="once_broken"),
    "friction": dem.effects.Friction,
    "sticking_friction": dem.effects.StickingFriction,
    "gas_pressure": dem.effects.GasPressure,
    "gravity": dem.effects.Gravity,
    "slip_weakening": partial(dem.effects.SlipWeakening, MODE_TWO),
}
#: Those of the paper's scene, the gas last.
PAPER = ("bond_damping", "softening", "shear_slip", "sphere_contact", "friction", "gas_pressure")


def blast_parser(
    name, description, drivers=BLAST_DRIVERS, mesh=dem.PAPER_BLOCK, saves=False, **given
):
    """Parser of an experiment on a mesh; given: settings and defaults, as of ``parser``.

    saves: whether its run is written whole, and saves itself on the way.
    """
    made = parser(name, description, drivers, **given)
    made.add_argument("--mesh", default=mesh, help="mesh file with a face group named hole")
    if saves:
        add_checkpoints(made)
    return made


def run_options(options):
    """Those arguments of ``simulate`` that options give."""
    names = ("until", "driver", "samples", "frames")
    kept = {"output": options.out, **checkpoint_of(options)} if "resume" in options else {}
    return {**kept, **{name: value for name, value in vars(options).items() if name in names}}


def paper_effects():
    """All effects of the paper's scene."""
    return [EFFECTS[name]() for name in PAPER]


def paper_scene(mesh=dem.PAPER_BLOCK):
    """The paper's scene with all of its effects; mesh: a file."""
    return dem.Scene(dem.read_mesh(mesh), dem.CONCRETE, paper_effects())


def run_costs():
    """Collector of what a run has cost at every sample, and of the levels of its bodies."""
    return dem.Collector(
        dem.Every(samples=1),
        cpu_s=lambda view: view.cpu_seconds,
        evaluations=lambda view: view.evaluations,
        level=lambda view: view.motion()["level"],
    )


def controlled(step):
    """Steps for each by what limits them, down to an eighth, with dashpots limited to that."""
    # With the usual 0.25 the hole is 0.24 % off at 5e-4 s, with 0.2 less than 0.2 %.
    control = StepControl(safety=0.2, dashpot_floor=step / 8.0)
    return Multirate(step, 1e-5, control=control, dashpot="limited")


#: Method by name: how it is made of a step [s], and the step that it is used with. In those of the
#: paper a body may go l = 1e-7 m in its largest step of 1e-8 s, and in others in proportion.
METHODS = {
    "paper_uniform": (lambda step: Uniform(step, 10.0 * step), 1e-8),
    "paper_multirate": (lambda step: Multirate(step, 10.0 * step), 1e-8),
    "multirate_controlled": (controlled, 8e-8),
    "explicit_limited": (lambda step: Uniform(step, dashpot="limited"), 2.5e-8),
    "implicit": (ImplicitDashpots, 4e-7),
}
