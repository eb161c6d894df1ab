"""Goals: their values by formulas of a test's own."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    InputError,
    Scene,
    effects,
    goals,
    read_mesh,
    simulate,
)
from taichi_dem.result import Result
from taichi_dem.state.model import Model
from tests.accuracy.small_bar import BROKEN_UNTIL, broken_bar, struck_bar

BODY = 5
#: Axis of the hole of the paper's block [m].
AXIS = np.array([1.6, 1.0])


@pytest.fixture(scope="module")
def blast():
    """A bar that breaks into parts, with a frame at every sample."""
    looks = {"until": BROKEN_UNTIL, "samples": 100, "frames": 100, "progress": None}
    return simulate(broken_bar(), method=ImplicitDashpots(4e-7), **looks)


@pytest.fixture(scope="module")
def block():
    """The paper's block: its scene and its model."""
    scene = Scene(read_mesh(PAPER_BLOCK), CONCRETE, [effects.GasPressure()])
    return scene, Model(scene.mesh, scene.material, scene.effects)


def resulting(**parts):
    """A Result with no more parts than a goal looks at."""
    made = Result.__new__(Result)
    vars(made).update(parts)
    return made


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


def test_a_bar_cut_in_the_middle_has_a_fragment_of_a_half(blast):
    model = blast.model
    ends = model.centre[:, 0][np.stack([model.topology.master, model.topology.slave])] > 0.05
    whole = replace(blast, broken_time=np.full(model.bond_count, np.nan))
    cut = replace(blast, broken_time=np.where(ends[0] != ends[1], 1e-5, np.nan))
    found = [goals.largest_fragment().value(one) for one in (whole, cut)]
    assert found == pytest.approx([1.0, 0.5], rel=1e-12)


def test_bodies_at_a_hole_that_go_outward_by_a_length_have_that_displacement(block):
    """Bodies anywhere else go inward by ten times as much; along the axis counts nothing."""
    _, model = block
    away = model.centre[:, :2] - AXIS
    outward = away / np.linalg.norm(away, axis=1)[:, None]
    way = np.full(model.body_count, -2e-2)
    way[bodies_at(model.mesh, "hole")] = 2e-3
    position = model.centre + np.column_stack([way[:, None] * outward, way])
    result = resulting(model=model, frames=[SimpleNamespace(position=position)])
    # The axis is known from the wall's normals to 1e-10, of a way of 2e-3 along it.
    assert goals.hole_displacement().value(result) == pytest.approx(2.0, rel=1e-8)


def test_a_goal_that_the_scene_lacks_is_refused():
    with pytest.raises(InputError, match="body must be a whole number from 0 to 71, got 72"):
        goals.peak_speed(72).mean().check_scene(struck_bar())
