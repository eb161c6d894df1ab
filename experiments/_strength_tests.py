"""Strengths that specimens of a material show: tension, compression and the Brazilian test.

Specimens are small, of elements of a given size: a prism and a disc.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from _meshes import with_moved_nodes
from taichi_dem.effects import (
    BodyContact,
    BondDamping,
    PrescribedMotion,
    ShearSlip,
    SlipWeakening,
    Softening,
    StickingFriction,
)
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.kit.fixed_order import length
from taichi_dem.materials import Material
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors, shared_faces
from taichi_dem.methods import ImplicitDashpots
from taichi_dem.scene import Scene
from taichi_dem.simulation import Simulation
from taichi_dem.stability.step_report import step_report

#: Boxes across and along a prism, across the diameter of a disc, and through it.
_ACROSS, _ALONG, _DIAMETER, _THROUGH = 4, 8, 12, 2
#: Largest shift of a point, as a share of a box.
_SHIFT = 0.15
#: Half of the angle of the arcs on which a disc is loaded by default [degrees].
ARC = 10.0
#: Times that a wave runs along a specimen until it reaches the strength that is expected. At 12 it
#: is stronger by up to 1 % in tension, 9 % in the Brazilian test and 7 % in compression.
_TRANSITS = 48.0
#: Readings of the force until the strength that is expected, and runs at most this many times
#: longer; a specimen has failed once the force has fallen to a share of its peak.
_READINGS, _LONGEST, _FALLEN = 40, 4, 0.9
#: Share of the largest stable step.
_SAFETY = 0.8


def prism(element: float, seed: int) -> Mesh:
    """Square prism along x, twice as long as wide; groups left and right are its ends.

    element: edge of the regular tetrahedron as large as its bodies [m]. seed: of the shifts of its
    points.
    """
    box = _box(element)
    straight = bar(_ALONG * box, _ACROSS * box, (_ALONG, _ACROSS, _ACROSS))
    return with_moved_nodes(straight, _SHIFT * box, seed)


def disc(element: float, seed: int, arc: float = ARC) -> Mesh:
    """Disc about z, cut from boxes; groups bottom and top are arcs of its rim.

    element, seed: as for ``prism``. arc: half of their angle [degrees].
    """
    box = _box(element)
    width = _DIAMETER * box
    square = bar(width, width, (_DIAMETER, _DIAMETER, _THROUGH))
    points = square.points * [1.0, 1.0, _THROUGH / _DIAMETER] - [0.5 * width, 0.5 * width, 0.0]
    block = with_moved_nodes(checked_mesh(points, square.tetrahedra, {}), _SHIFT * box, seed)
    middle = block.points[block.tetrahedra].mean(axis=1)
    bodies = block.tetrahedra[np.hypot(middle[:, 0], middle[:, 1]) < 0.5 * width]
    return checked_mesh(block.points, bodies, _arcs(block.points, bodies, 0.5 * width, arc))


def _box(element):
    """Edge of a box cut into six bodies [m]: edge^3 / (6 sqrt 2) = box^3 / 6."""
    return element / 2.0 ** (1.0 / 6.0)


def _arcs(points, bodies, radius, arc):
    """Outer faces of the rim around its lowest and its highest line."""
    faces = all_faces(bodies)
    free = np.ones(len(faces), dtype=bool)
    free[shared_faces(bodies).ravel()] = False
    faces = faces[free]
    x, y, _ = points[faces].mean(axis=1).T
    normal = area_vectors(points, faces)
    rim = np.abs(normal[:, 2]) < 0.9 * length(normal)
    rim &= (np.degrees(np.arctan2(np.abs(x), np.abs(y))) < arc) & (np.hypot(x, y) > 0.7 * radius)
    return {"bottom": faces[rim & (y < 0.0)], "top": faces[rim & (y > 0.0)]}


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
        return [*laws, BodyContact(), StickingFriction(), *motions]

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
