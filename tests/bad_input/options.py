"""Every option of both packages: its name, its kind, and what is built with a value of it."""

from dataclasses import fields, replace
from typing import Callable, NamedTuple

from ca_damper import (
    Automaton,
    Batch,
    Box,
    ModalStructure,
    Oscillator,
    RigidMass,
    SceneTable,
    Spheres,
    excitation,
    rk45,
    shake_structure,
)
from ca_damper.scenes.clock import steps_per_cycle
from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Material,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    effects,
    read_mesh,
    runtime,
)
from taichi_dem.mesh import shapes as mesh_shapes
from taichi_dem.mesh.face_groups import with_inner_group
from taichi_dem.mesh.gmsh import block_with_hole
from tests.paper import paper


class Option(NamedTuple):
    """owner: what takes it. kind: of ``refusals.WRONG``. build: makes the owner with a value.

    allowed: values of the wrong list that this option takes all the same.
    """

    owner: str
    name: str
    kind: str
    build: Callable
    allowed: tuple = ()


def taken(make, kind, names, allowed=()):
    """Options that ``make`` takes by keyword; a partial of a class has its name."""
    owner = getattr(make, "func", make).__name__
    return [
        Option(owner, name, kind, lambda value, name=name: make(**{name: value}), allowed)
        for name in names
    ]


def concrete(**changes):
    """Concrete with something else in it."""
    return replace(CONCRETE, **changes)


def rock(**options):
    """A material from what is measured."""
    return Material.from_elastic(**{**ROCK, **options})


def scene(**options):
    """A scene of one body."""
    return Scene(mesh_shapes.single(), CONCRETE, **options)


def table(**columns):
    """A table of two scenes."""
    return SceneTable(**{"particles": [0, 0], "seed": 1, "dt": 1e-3, **columns})


def checkpoint(**options):
    """A checkpoint of a name, unless it is given another."""
    return Checkpoint(**{"path": "run.npz", **options})


def solved(**options):
    """A solution of y' = -y."""
    arguments = {"span": (0.0, 1.0), "y0": [1.0], **options}
    return rk45.solve(lambda t, y: -y, arguments.pop("span"), arguments.pop("y0"), **arguments)


def batch(**options):
    """A batch of empty containers; its table is made before, and not refused."""
    return Batch(RigidMass(), SceneTable(0, 1, 1e-3), **options)


def block(**options):
    """A block for gmsh, in a folder that is not there."""
    return block_with_hole("none/block.msh", **options)


def one_mode(**options):
    """A structure of one place, from its matrices."""
    return ModalStructure.from_matrices([1.0], [[1e3]], options.get("damping_ratios", 0.01))


def box(**options):
    """An empty box at the first place."""
    return Box(**{"place": 0, "particles": 0, **options})


def shaken_structure(**options):
    """A shaken structure of one place; all but the option is valid."""
    still = excitation.sines(1.0, 0.0, 0.1)
    given = {"seeds": 1, "progress": None, **options}
    return shake_structure(RigidMass(), one_mode(), box(), still, **given)


def cycle(**options):
    """Steps of a cycle."""
    arguments = {"frequency": 6.0, "dt": 1e-4, **options}
    return steps_per_cycle(arguments["frequency"], arguments["dt"])


def support(**options):
    """A support that moves."""
    return effects.PrescribedMotion(**{"group": "left", "velocity": (1, 0, 0), **options})


def pressure(**options):
    """A pressure that rises."""
    return effects.Pressure(**{"group": "left", "values": (0, 1), "times": (0, 1), **options})


def triangle(**options):
    """A pulse of pressure."""
    arguments = {"group": "left", "peak": 1.0, "rise": 1.0, "fall": 1.0, **options}
    return effects.Pressure.triangle(**arguments)


def quiet(**options):
    """A quiet boundary."""
    return effects.QuietBoundary(**{"group": "left", **options})


def cut(**options):
    """A scene of two bodies that share the group notch."""
    mesh = with_inner_group(mesh_shapes.pair(), "notch", lambda x: x[:, 0] < 1.0)
    return Scene(mesh, CONCRETE, **options)


def roller(**options):
    """A support that slides."""
    return effects.Roller(**{"group": "left", "normal": (1, 0, 0), **options})


_MATERIAL = [field.name for field in fields(Material)]
_MAY_VANISH = ["normal_damping", "shear_damping", "cohesion", "friction", "contact_damping"]
_ROOM = ("neighbours_per_body", "pairs_per_body", "spheres_per_body")
_SIZES = ("width", "height", "depth", "hole_diameter", "size_hole", "size_far", "distance_far")
ROCK = {
    "young": 32e9,
    "poisson": 0.2,
    "density": 2450.0,
    "tensile_strength": 5e6,
    "fracture_energy": 100.0,
    "friction_angle": 40.0,
    "cohesion": 10e6,
}
BLAST = [
    *taken(rock, "positive", ("young", "density", "tensile_strength", "fracture_energy")),
    *taken(rock, "zero or positive", ("cohesion", "damping_ratio")),
    *taken(rock, "poisson", ("poisson",)),
    *taken(rock, "up to one", ("friction_angle",), (1.5,)),
    *taken(concrete, "positive", [name for name in _MATERIAL if name not in _MAY_VANISH]),
    *taken(concrete, "zero or positive", _MAY_VANISH),
    *taken(Uniform, "positive", ("dt0",)),
    *taken(Uniform, "positive", ("distance",), (None,)),
    *taken(Uniform, "word", ("dashpot",)),
    *taken(Uniform, "object", ("control",), (None,)),
    *taken(Multirate, "positive", ("dt0", "distance")),
    *taken(Multirate, "word", ("neighbour", "dashpot")),
    *taken(ImplicitDashpots, "positive", ("dt", "tolerance", "refresh")),
    *taken(ImplicitDashpots, "share", ("theta",)),
    *taken(ImplicitDashpots, "three numbers", ("sweeps",), ((1, 2),)),
    *taken(StepControl, "positive", ("safety", "angle", "ahead")),
    *taken(StepControl, "up to one", ("dashpot_floor",)),
    *taken(StepControl, "whole", ("level_jump",), (None,)),
    *taken(StepControl, "words", ("criteria", "wake"), ([],)),
    *taken(effects.GasPressure, "positive", ("peak", "rise", "decay_ratio")),
    *taken(effects.GasPressure, "zero or positive", ("start",)),
    *taken(effects.GasPressure, "group", ("group",)),
    *taken(effects.Fixed, "group", ("group",)),
    *taken(effects.SphereContact, "positive", ("skin",)),
    *taken(effects.StickingFriction, "positive", ("stiffness_ratio",)),
    *taken(effects.FaceContact, "positive", ("skin",)),
    *taken(effects.FaceContact, "whole", ("divisions", *_ROOM)),
    *taken(effects.SphereContact, "whole", ("divisions", *_ROOM)),
    *taken(effects.SphereContact, "flag", ("outer_faces",)),
    *taken(effects.Gravity, "three numbers", ("acceleration",)),
    *taken(roller, "three numbers", ("normal",)),
    *taken(support, "three numbers", ("velocity",)),
    *taken(support, "zero or positive", ("frequency", "ramp")),
    *taken(support, "history", ("history",)),
    *taken(pressure, "numbers", ("values", "times")),
    *taken(pressure, "group", ("group",)),
    *taken(triangle, "zero or positive", ("rise",)),
    *taken(triangle, "positive", ("fall",)),
    *taken(quiet, "positive", ("p_speed", "s_speed"), (None,)),
    *taken(quiet, "group", ("group",)),
    *taken(cut, "names", ("unbonded",)),
    *taken(cut, "shares", ("weaker",)),
    *taken(cut, "materials", ("materials",)),
    *taken(scene, "positive", ("max_speed",)),
    *taken(scene, "three numbers", ("velocity", "spin"), (None, [[1, 2, 3]])),
    *taken(checkpoint, "path", ("path",)),
    *taken(checkpoint, "whole", ("every_steps",), (None,)),
    *taken(checkpoint, "positive", ("every_s", "every_wall_s"), (None,)),
    *taken(block, "positive", _SIZES),
    *taken(block, "whole", ("hole_segments",)),
    *taken(runtime.start, "whole", ("threads",), (None,)),
    *taken(runtime.start, "flag", ("debug",)),
    *taken(runtime.start, "word", ("arch",)),
    Option("read_mesh", "scale", "positive", lambda value: read_mesh("none.msh", scale=value)),
    Option("read_mesh", "path", "path", read_mesh),
    Option("single", "edge", "positive", mesh_shapes.single),
    Option("bar", "width", "positive", lambda value: mesh_shapes.bar(1.0, value, (1, 1, 1))),
    Option("bar", "cells", "three numbers", lambda value: mesh_shapes.bar(1.0, 1.0, value)),
]
_NUMBERS = ("width", "particle_mass", "v_max")
_MODULI = ("reference_speed", "young", "wall_young", "diameter", "particle_mass")
DAMPER = [
    *taken(paper, "word", ("accounting", "pair_rule", "priority", "accumulator", "traversal")),
    *taken(Automaton, "word", ("rules",)),
    *taken(Automaton, "zero or positive", ("friction", "wall_friction"), (None,)),
    *taken(Automaton, "share", ("restitution", "wall_restitution")),
    *taken(Automaton, "positive", _NUMBERS),
    *taken(Automaton, "zero or positive", ("gravity", "static_threshold")),
    *taken(Automaton, "whole", ("columns", "rows")),
    *taken(paper, "flag", ("ledger",)),
    *taken(Automaton, "flag", ("static_contact",), (None,)),
    *taken(Spheres, "word", ("damping", "search", "friction_law")),
    *taken(Spheres, "share", ("restitution", "wall_restitution")),
    *taken(Spheres, "positive", (*_MODULI, "width", "height")),
    *taken(Spheres, "zero or positive", ("friction", "wall_friction", "gravity")),
    *taken(Spheres, "poisson", ("poisson", "wall_poisson")),
    *taken(Spheres, "flag", ("rotation",)),
    *taken(RigidMass, "positive", ("particle_mass",)),
    *taken(RigidMass, "zero or positive", ("gravity",)),
    *taken(Oscillator, "positive", ("mass", "stiffness")),
    *taken(Oscillator, "zero or positive", ("damping", "base_amplitude")),
    *taken(one_mode, "zero or positive", ("damping_ratios",)),
    *taken(box, "whole", ("place", "particles")),
    *taken(box, "whole", ("seed",), (None,)),
    *taken(shaken_structure, "positive", ("dt", "duration"), (None,)),
    *taken(shaken_structure, "positive", ("interval",)),
    *taken(shaken_structure, "whole", ("force_place",), (None,)),
    *taken(shaken_structure, "word", ("effects",)),
    *taken(cycle, "positive", ("frequency", "dt")),
    *taken(batch, "zero or positive", ("rtol",)),
    *taken(batch, "positive", ("atol",)),
    *taken(batch, "word", ("mount",)),
    *taken(batch, "whole", ("measured_cycles",)),
    *taken(solved, "zero or positive", ("rtol",)),
    *taken(solved, "positive", ("atol",)),
    *taken(solved, "positive", ("first",), (None,)),
    *taken(solved, "whole", ("most_attempts",)),
]
