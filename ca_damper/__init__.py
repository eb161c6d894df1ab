"""The granular damper: a container of grains on a spring, by automaton or by spheres."""

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem.kit import runtime  # isort: skip

from ca_damper import excitation, goals
from ca_damper.automaton import Automaton
from ca_damper.automaton.rules.paper import Paper
from ca_damper.automaton.rules.place import Place
from ca_damper.batch import Batch
from ca_damper.errors import InputError, SimulationDiverged
from ca_damper.fixed_mass import Empty, RigidMass
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.report.certificate import Certificate
from ca_damper.report.report import Report, needed_effects
from ca_damper.runs.best_damper import BestDamper, best_damper
from ca_damper.runs.damper_map import DamperMap, damper_map
from ca_damper.runs.film import film
from ca_damper.runs.frequency_sweep import Sweep, sweep_up_and_down
from ca_damper.runs.history import StructureHistory, TimeHistory
from ca_damper.runs.response import AmplitudeResponse, Response, frequency_response
from ca_damper.runs.shake import shake, shake_structure
from ca_damper.scenes.table import SceneTable
from ca_damper.solve_response import solve_response
from ca_damper.spheres import Spheres
from ca_damper.structure import Box, ModalStructure
from ca_damper.theory.collect_and_collide import CollectAndCollide, collect_and_collide
from ca_damper.theory.decay import logarithmic_decrement
from ca_damper.theory.impact_damper import ImpactDamper
from taichi_dem.kit.bars.answer import Answer, Branch
from taichi_dem.kit.checkpoint import Checkpoint
from taichi_dem.kit.progress import Progress
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.sweeps.sweep import sweep
from taichi_dem.kit.sweeps.table import parameter_grid
from taichi_dem.kit.version import __version__

__all__ = [
    "AmplitudeResponse",
    "Answer",
    "Automaton",
    "Batch",
    "BestDamper",
    "Box",
    "Branch",
    "Certificate",
    "Checkpoint",
    "CollectAndCollide",
    "DamperMap",
    "Empty",
    "Goal",
    "ImpactDamper",
    "InputError",
    "ModalStructure",
    "Oscillator",
    "Paper",
    "Place",
    "Progress",
    "ProgressBar",
    "Report",
    "Response",
    "RigidMass",
    "SceneTable",
    "SimulationDiverged",
    "Spheres",
    "StructureHistory",
    "Sweep",
    "TimeHistory",
    "__version__",
    "best_damper",
    "collect_and_collide",
    "damper_map",
    "excitation",
    "film",
    "frequency_response",
    "goals",
    "logarithmic_decrement",
    "needed_effects",
    "parameter_grid",
    "runtime",
    "shake",
    "shake_structure",
    "solve_response",
    "sweep",
    "sweep_up_and_down",
]
