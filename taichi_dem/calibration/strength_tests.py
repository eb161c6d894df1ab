"""Strengths that specimens of a material show: tension, compression and the Brazilian test."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.calibration.specimens import disc, prism
from taichi_dem.effects import (
    BondDamping,
    Friction,
    PrescribedMotion,
    ShearSlip,
    SlipWeakening,
    Softening,
    SphereContact,
)
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.materials import Material
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.scene import Scene
from taichi_dem.simulation import Simulation
from taichi_dem.stability.step_report import step_report

#: Times that a wave runs along a specimen until it reaches the strength that is expected. At 12 it
#: is stronger by up to 1 % in tension, 9 % in the Brazilian test and 7 % in compression.
_TRANSITS = 48.0
#: Readings of the force until the strength that is expected, and runs at most this many times
#: longer; a specimen has failed once the force has fallen to a share of its peak.
_READINGS, _LONGEST, _FALLEN = 40, 4, 0.9
#: Share of the largest stable step.
_SAFETY = 0.8


@dataclass(frozen=True)
class StrengthTest:
    """One test: how its specimen is made, loaded and judged.

    specimen: of an element's edge [m] and a seed. groups: both loaded ones. axis: of loading, 0 for
    x, 1 for y. pulls: whether the groups move apart. loaded_area: what the force is divided by
    [m^2], a function of the mesh. strain: of a specimen at its strength, over strength / modulus.
    """

    specimen: Callable[[float, int], Mesh]
    groups: tuple[str, str]
    axis: int
    pulls: bool
    loaded_area: Callable[[Mesh], float]
    strain: float

    def strength(
        self, material: Material, element: float, expected: float, seed: int, slip_energy: Any
    ) -> float:
        """Largest nominal stress [Pa] of a specimen that is strained at a constant rate.

        element: edge of its elements [m]. expected: about the strength [Pa], which sets the rate.
        slip_energy: G_II of ``SlipWeakening`` [J/m2], None for ``ShearSlip``.
        NaN where the specimen has not failed at four times the strain of this strength.
        """
        mesh = self.specimen(element, seed)
        stiffness = mesh_stiffness(mesh, material)
        size = float(np.ptp(mesh.points[:, self.axis]))
        duration = _TRANSITS * size / stiffness.wave_speeds["bar"]
        rate = self.strain * expected / stiffness.young / duration
        scene = Scene(mesh, material, self._effects(rate * size, slip_energy))
        bonds = _SAFETY * float(step_report(scene).borne("solved").min())
        steps = max(1, math.ceil(duration / _READINGS / bonds))
        simulation = Simulation(scene, ImplicitDashpots(duration / _READINGS / steps))
        self._begin(simulation, rate)
        return float(self._peak(simulation, steps, rate * size) / self.loaded_area(mesh))

    def _effects(self, speed, slip_energy):
        """Laws of the bonds and of contact, and the motion of both groups [m/s]."""
        sign = 1.0 if self.pulls else -1.0
        motions = []
        for side, group in zip((-0.5, 0.5), self.groups):
            velocity = [0.0, 0.0, 0.0]
            velocity[self.axis] = sign * side * speed
            motions.append(PrescribedMotion(group, velocity))
        slip = ShearSlip() if slip_energy is None else SlipWeakening(slip_energy)
        laws = [Softening(), slip, BondDamping()]
        return [*laws, SphereContact(outer_faces=False), Friction(), *motions]

    def _begin(self, simulation, rate):
        """Set the velocities of an even strain rate, so that no wave starts at the ends."""
        centre = simulation.model.centre
        axis, middle = self.axis, 0.5 * np.ptp(simulation.model.mesh.points, axis=0)
        middle = middle + simulation.model.mesh.points.min(axis=0)
        velocity = np.zeros_like(centre)
        sign = 1.0 if self.pulls else -1.0
        velocity[:, axis] = sign * rate * (centre[:, axis] - middle[axis])
        simulation.state.set_motion(centre, velocity=velocity)

    def _peak(self, simulation, steps, speed):
        """Largest force [N] until the specimen has failed: work of the groups over their way."""
        simulation.start()
        way = speed * steps * simulation.method.dt0
        before = peak = 0.0
        for reading in range(1, _LONGEST * _READINGS + 1):
            simulation.advance_to(reading * steps)
            work = simulation.energy_balance.account()["support_work"]
            force, before = (work - before) / way, work
            peak = max(peak, force)
            if reading > 5 and force < _FALLEN * peak:
                return peak
        return math.nan


def _section(mesh):
    """Cross section of a prism along x [m^2]."""
    return float(np.ptp(mesh.points[:, 1]) * np.ptp(mesh.points[:, 2]))


def _split_area(mesh):
    """Area by which the force of a Brazilian test is divided, pi D t / 2 [m^2]."""
    diameter, depth = np.ptp(mesh.points[:, 0]), np.ptp(mesh.points[:, 2])
    return float(0.5 * math.pi * diameter * depth)


#: Tests by name.
TESTS = {
    "tension": StrengthTest(prism, ("left", "right"), 0, True, _section, 1.0),
    "compression": StrengthTest(prism, ("left", "right"), 0, False, _section, 1.3),
    "brazilian": StrengthTest(disc, ("bottom", "top"), 1, False, _split_area, 3.6),
}
