"""Strengths that specimens of a material show: tension, compression and the Brazilian test.

Specimens are small, of elements of a given size: a prism and a disc.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cases.meshes import with_moved_nodes
from taichi_dem import ImplicitDashpots, Scene, Simulation, step_report
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
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import all_faces, area_vectors, shared_faces

#: Boxes across and along a prism, across the diameter of a disc, and through it.
ACROSS, ALONG, DIAMETER, THROUGH = 4, 8, 12, 2
#: Largest shift of a point, as a share of a box; half of the angle of loaded arcs [degrees].
SHIFT, ARC = 0.15, 10.0
#: Times that a wave runs along a specimen until it reaches the strength that is expected. At 12 it
#: is stronger by up to 1 % in tension, 9 % in the Brazilian test and 7 % in compression.
TRANSITS = 48.0
#: Readings of the force until the strength that is expected, and runs at most this many times
#: longer; a specimen has failed once the force has fallen to a share of its peak.
READINGS, LONGEST, FALLEN = 40, 4, 0.9
#: Share of the largest stable step.
SAFETY = 0.8


def prism(box, seed):
    """Square prism along x, twice as long as wide, of boxes; its ends, and its cross section [m2].

    box: edge [m]. seed: of the shifts of its points.
    """
    straight = bar(ALONG * box, ACROSS * box, (ALONG, ACROSS, ACROSS))
    return with_moved_nodes(straight, SHIFT * box, seed), ("left", "right"), (ACROSS * box) ** 2


def disc(box, seed, arc=ARC):
    """Disc about z, cut from boxes; arcs of its rim, and pi D t / 2 [m2]: as ``prism``.

    arc: half of the angle of the arcs [degrees].
    """
    width = DIAMETER * box
    square = bar(width, width, (DIAMETER, DIAMETER, THROUGH))
    points = square.points * [1.0, 1.0, THROUGH / DIAMETER] - [0.5 * width, 0.5 * width, 0.0]
    block = with_moved_nodes(checked_mesh(points, square.tetrahedra, {}), SHIFT * box, seed)
    middle = block.points[block.tetrahedra].mean(axis=1)
    bodies = block.tetrahedra[np.hypot(middle[:, 0], middle[:, 1]) < 0.5 * width]
    faces = all_faces(bodies)
    faces = np.delete(faces, shared_faces(bodies).ravel(), axis=0)
    x, y, _ = block.points[faces].mean(axis=1).T
    normal = area_vectors(block.points, faces)
    rim = np.abs(normal[:, 2]) < 0.9 * np.linalg.norm(normal, axis=1)
    rim &= (np.degrees(np.arctan2(np.abs(x), np.abs(y))) < arc) & (np.hypot(x, y) > 0.35 * width)
    arcs = {"bottom": faces[rim & (y < 0.0)], "top": faces[rim & (y > 0.0)]}
    mesh = checked_mesh(block.points, bodies, arcs)
    diameter, depth = np.ptp(mesh.points[:, 0]), np.ptp(mesh.points[:, 2])
    return mesh, ("bottom", "top"), float(0.5 * math.pi * diameter * depth)


@dataclass(frozen=True)
class StrengthTest:
    """A test: its specimen of boxes, a function as ``prism``; how that is loaded and judged.

    axis: of loading. sign: 1 where it is pulled, -1 where it is pressed. strain: of a specimen at
    its strength, over strength / modulus.
    """

    specimen: Callable
    axis: int
    sign: float
    strain: float

    def strength(self, material, element, expected, seed, slip_energy):
        """Largest nominal stress [Pa] of a specimen that is strained at a constant rate.

        element: edge of the regular tetrahedron as large as its elements [m]. expected: about the
        strength [Pa], which sets the rate. slip_energy: G_II of ``SlipWeakening`` [J/m2], None for
        ``ShearSlip``. NaN where it has not failed at four times the strain of this strength.
        """
        # Six bodies to a box: edge^3 / (6 sqrt 2) = box^3 / 6.
        mesh, groups, area = self.specimen(element / 2.0 ** (1.0 / 6.0), seed)
        stiffness, place = mesh_stiffness(mesh, material), mesh.points[:, self.axis]
        size, middle = float(np.ptp(place)), 0.5 * (place.min() + place.max())
        duration = TRANSITS * size / stiffness.wave_speeds["bar"]
        rate = self.sign * self.strain * expected / stiffness.young / duration
        pull = np.eye(3)[self.axis]
        drives = [PrescribedMotion(k, s * rate * size * pull) for k, s in zip(groups, (-0.5, 0.5))]
        slip = ShearSlip() if slip_energy is None else SlipWeakening(slip_energy)
        laws = [Softening(), slip, BondDamping(), BodyContact(), StickingFriction()]
        scene = Scene(mesh, material, [*laws, *drives])
        longest = SAFETY * float(step_report(scene).borne("solved").min())
        steps = max(1, math.ceil(duration / READINGS / longest))
        simulation = Simulation(scene, ImplicitDashpots(duration / READINGS / steps))
        # An even strain rate from the start, so that no wave starts at the ends.
        centre = simulation.model.centre
        velocity = np.outer(rate * (centre[:, self.axis] - middle), pull)
        simulation.state.set_motion(centre, velocity=velocity)
        simulation.start()
        return _peak(simulation, steps, abs(rate) * size) / area


def _peak(simulation, steps, speed):
    """Largest force [N] until the specimen has failed: work of the groups over their way."""
    way, before, peak = speed * steps * simulation.method.dt0, 0.0, 0.0
    for reading in range(1, LONGEST * READINGS + 1):
        simulation.advance_to(reading * steps)
        work = simulation.energy_balance.account()["support_work"]
        force, before = (work - before) / way, work
        peak = max(peak, force)
        if reading > 5 and force < FALLEN * peak:
            return peak
    return math.nan


#: Tests by name.
TESTS = {
    "tension": StrengthTest(prism, 0, 1.0, 1.0),
    "compression": StrengthTest(prism, 0, -1.0, 1.3),
    "brazilian": StrengthTest(disc, 1, -1.0, 3.6),
}
