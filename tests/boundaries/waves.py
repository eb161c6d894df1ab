"""Blocks with waves in them, on meshes with regular and with perturbed nodes."""

from dataclasses import replace

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.shapes import bar, with_moved_nodes

#: Concrete whose bonds have no dashpots, so that no wave fades.
UNDAMPED = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)
#: Groups of a bar's sides, and the directions that they cannot move in for plane waves along x.
SIDES = {"bottom": (0, 1, 0), "top": (0, 1, 0), "back": (0, 0, 1), "front": (0, 0, 1)}
QUIET = (effects.QuietBoundary("left"), effects.QuietBoundary("right"))


def perturbed(mesh, share, seed):
    """Nodes moved by up to a share of the shortest edge along each axis, outer ones in plane."""
    corners = mesh.points[mesh.tetrahedra]
    edges = corners[:, [0, 0, 0, 1, 1, 2]] - corners[:, [1, 2, 3, 2, 3, 3]]
    return with_moved_nodes(mesh, share * np.linalg.norm(edges, axis=2).min(), seed)


def plane_bar(boxes, across=2, share=0.0, seed=1):
    """A bar of 1 m of cubic boxes, across by across of them, with nodes moved by a share."""
    mesh = bar(1.0, across / boxes, (boxes, across, across))
    return perturbed(mesh, share, seed) if share else mesh


def rollers():
    """Supports of the sides, for plane waves."""
    return [effects.Roller(name, normal) for name, normal in SIDES.items()]


def with_pulse(mesh, listed, method=None, way=(1.0, 0.0, 0.0), width=0.1):
    """A simulation that begins with velocities exp(-((x - 1/2) / width)^2) [m/s] along a way.

    Half of the energy goes to either end.
    """
    simulation = Simulation(Scene(mesh, UNDAMPED, listed), method or Uniform(2e-7))
    x = simulation.model.centre[:, 0]
    velocity = np.exp(-(((x - 0.5) / width) ** 2))[:, None] * np.array(way)
    simulation.state.set_motion(simulation.model.centre, velocity=velocity)
    simulation.start()
    return simulation


def advanced(simulation, time_s):
    """Go on to a time [s]; the account."""
    simulation.advance_to(round(time_s / simulation.method.dt0))
    return simulation.energy_balance.account()


def share_left(simulation, time_s):
    """Share of the energy at the start that the bodies hold at a time [s]."""
    account = advanced(simulation, time_s)
    return (account["kinetic"] + account["bond_strain"]) / simulation.energy_balance.start_energy
