"""The granular damper: a container of grains on a spring, by automaton or by spheres."""

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem import runtime  # isort: skip

from ca_damper.errors import InputError, SimulationDiverged
from ca_damper.filling import Empty, RigidMass

__all__ = [
    "Empty",
    "InputError",
    "RigidMass",
    "SimulationDiverged",
    "runtime",
]
