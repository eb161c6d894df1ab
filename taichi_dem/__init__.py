"""Blasting and breaking of blocks of bonded rigid tetrahedra, with steps that differ by body.

A scene is a mesh, a material and the effects that act; ``simulate`` runs it::

    from taichi_dem import CONCRETE, PAPER_BLOCK, ImplicitDashpots, Scene
    from taichi_dem import effects, read_mesh, runtime, simulate

    runtime.start()
    blow = effects.GasPressure(group="hole", peak=5e6)
    scene = Scene(mesh=read_mesh(PAPER_BLOCK), material=CONCRETE, effects=[blow])
    result = simulate(scene, method=ImplicitDashpots(), until=1e-4)
    print(result.report)

``python -m taichi_dem`` lists what else there is.
"""

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit import runtime  # isort: skip

from taichi_dem import effects, goals, methods, shapes
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.goals import Goal
from taichi_dem.kit.bars.answer import Answer, Branch
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.progress import Progress
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.sweeps.sweep import sweep
from taichi_dem.kit.sweeps.table import parameter_grid
from taichi_dem.kit.version import __version__
from taichi_dem.materials import CONCRETE, Material
from taichi_dem.mesh.files import read_mesh
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import in_space_order, join
from taichi_dem.meshes import PAPER_BLOCK
from taichi_dem.methods import ImplicitDashpots, Multirate, Uniform
from taichi_dem.needed_effects import needed_effects
from taichi_dem.observers import At, Collector, Every, Observer, Received, Receivers, RunView
from taichi_dem.output.record import write_paraview
from taichi_dem.report.estimates import estimated_effects
from taichi_dem.scene import Scene
from taichi_dem.simulate import simulate
from taichi_dem.simulation import Simulation
from taichi_dem.solve import solve
from taichi_dem.stability.step_report import elastic_report, step_report
from taichi_dem.step_control import StepControl

__all__ = [
    "CONCRETE",
    "PAPER_BLOCK",
    "Answer",
    "At",
    "Branch",
    "Checkpoint",
    "Collector",
    "Every",
    "Goal",
    "ImplicitDashpots",
    "InputError",
    "Material",
    "Mesh",
    "Multirate",
    "Observer",
    "Progress",
    "ProgressBar",
    "Received",
    "Receivers",
    "RunView",
    "Scene",
    "Simulation",
    "SimulationDiverged",
    "StepControl",
    "Uniform",
    "__version__",
    "checked_mesh",
    "effects",
    "elastic_report",
    "estimated_effects",
    "goals",
    "in_space_order",
    "join",
    "mesh_stiffness",
    "methods",
    "needed_effects",
    "parameter_grid",
    "read_mesh",
    "runtime",
    "shapes",
    "simulate",
    "solve",
    "step_report",
    "sweep",
    "write_paraview",
]
