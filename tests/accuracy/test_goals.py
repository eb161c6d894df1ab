"""Goals: their values by formulas of a test's own."""

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots, goals, simulate
from tests.accuracy.small_bar import BROKEN_UNTIL, broken_bar

BODY = 5


@pytest.fixture(scope="module")
def blast():
    """A bar that breaks into parts, with a frame at every sample."""
    looks = {"until": BROKEN_UNTIL, "samples": 100, "frames": 100, "progress": None}
    return simulate(broken_bar(), method=ImplicitDashpots(4e-7), **looks)


def moved_mm(result, bodies):
    """Distances from the centroids of the mesh at the end [mm]."""
    mesh = result.scene.mesh
    first = mesh.points[mesh.tetrahedra].mean(axis=1)
    return 1e3 * np.linalg.norm((result.frames[-1].position - first)[bodies], axis=1)


def bodies_at(mesh, group):
    """Bodies with all corners of a face of a group."""
    faces = [set(face) for face in mesh.group_faces(group).tolist()]
    corners = [set(body) for body in mesh.tetrahedra.tolist()]
    return [n for n, body in enumerate(corners) if any(face <= body for face in faces)]


def test_values_of_a_run(blast):
    """Each by a formula of its own; sums of other orders round in the last digits."""
    mesh, last, history = blast.scene.mesh, blast.frames[-1], blast.series
    speeds = np.array([frame.speed for frame in blast.frames])
    work = history["gas_work_J"][-1]
    wanted = {
        goals.displacement("left"): moved_mm(blast, bodies_at(mesh, "left")).mean(),
        goals.body_displacement(BODY): moved_mm(blast, BODY + np.arange(1)).mean(),
        goals.broken_faces(): np.isfinite(blast.broken_time).sum(),
        goals.kinetic_energy(): blast.report.energy_balance["kinetic"],
        goals.peak_speed(BODY): speeds[:, BODY].max(),
        goals.energy_share("bond_dashpot"): history["bond_dashpot_J"][-1] / work,
    }
    for goal, value in wanted.items():
        assert goal.value(blast) == pytest.approx(value, rel=1e-12), goal
    assert blast.report.broken_faces > 1
    along = 0.5 * (blast.model.body_mass * (last.velocity**2).sum(axis=1)).sum()
    assert along < goals.kinetic_energy().value(blast) < 1.5 * along
