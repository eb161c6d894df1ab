"""A result is shown whatever became of the run, and its files tell what it holds and no more.

The record of bodies' motion has the energy and momentum of a free flight in closed form.
"""

import csv
import dataclasses

import numpy as np
import pytest

from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, Simulation, Uniform, read_mesh, simulate
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.simulate import run_simulation
from tests.made_result import made_result
from tests.motion_record import MotionRecord
from tests.notebook import shown

NAN = float("nan")


@pytest.fixture(scope="module")
def flown(taichi_session):
    """A bar that flies and turns; every third bond is said to have broken at a time of its own."""
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [], velocity=(2, 0, 0), spin=(0, 9, 0))
    made = simulate(scene, method=Uniform(1e-7), until=4e-6, samples=4, frames=4, progress=None)
    time = np.linspace(1e-6, 4e-6, made.model.bond_count)
    time[np.arange(len(time)) % 3 > 0] = NAN
    return dataclasses.replace(made, broken_time=time)


def test_a_notebook_shows_picture_and_figures(flown):
    page, pixels = shown(flown)
    assert pixels.shape[1] > 600 and pixels.std() > 5.0
    assert str(flown.report) in page.text and "24 bodies" in page.text


def nothing_but_nan(result):
    history = {name: np.full(len(column), NAN) for name, column in result.series.items()}
    ledger = dict.fromkeys(result.report.energy_balance, NAN)
    report = dataclasses.replace(result.report, energy_balance=ledger, run_seconds=NAN)
    frame = dataclasses.replace(
        result.frames[-1], displacement=NAN * result.frames[-1].displacement
    )
    speed = np.full(result.model.body_count, NAN)
    more = {"series": history, "report": report, "frames": (frame,), "peak_speed": speed}
    return dataclasses.replace(result, **more)


def without_rows(result):
    history = {name: column[:0] for name, column in result.series.items()}
    return dataclasses.replace(result, series=history, frames=())


@pytest.mark.parametrize("how", [nothing_but_nan, without_rows])
def test_an_odd_result_is_shown_all_the_same(flown, how):
    """Warnings are errors here: nothing is divided by zero on the way."""
    shown(how(flown))


def test_times_of_breaking_are_written(flown, tmp_path):
    """A row a bond: its bodies, its face and when it broke, an empty cell while it holds."""
    flown.write(tmp_path)
    with open(tmp_path / "bonds.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    top, points = flown.model.topology, flown.model.mesh.points
    assert [int(row["master"]) for row in rows] == top.master.tolist()
    assert [int(row["slave"]) for row in rows] == top.slave.tolist()
    times = [float(row["broken_time_s"] or NAN) for row in rows]
    assert np.array_equal(times, flown.broken_time, equal_nan=True)
    a, b, c = points[top.vertices].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert [float(row["area_m2"]) for row in rows] == pytest.approx(area, rel=1e-14)


def files_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("frames", [0, 2])
def test_a_folder_used_before_keeps_nothing_of_the_earlier_series(flown, tmp_path, frames):
    """And all that is not of this series, however alike its name."""
    place, name = tmp_path / "run", "paraview/run"
    flown.write(place)
    others = {f"{name}.txt", f"{name}_1.vtu", f"{name}2_0001.vtu", "run_0001.vtu", "mine.txt"}
    for other in others:
        (place / other).write_text("mine")
    dataclasses.replace(flown, frames=flown.frames[:frames]).write(place)
    tables = {"history.csv", "bonds.csv", "mesh.msh", "report.json"}
    series = {f"{name}_{k:04d}.vtu" for k in range(frames)} | ({f"{name}.pvd"} if frames else set())
    assert files_in(place) == tables | series | others


def test_fragments_hold_the_kinetic_energy_of_the_account(flown):
    """Frames and samples are of one time; the share that bodies turn with is in both."""
    energy = flown.series["kinetic_J"]
    assert flown.fragments()["kinetic_J"].sum() == pytest.approx(energy[-1], rel=1e-12)
    assert flown.fragments(2)["kinetic_J"].sum() == pytest.approx(energy[2], rel=1e-12)


@pytest.mark.parametrize(("size", "words"), [(1e-3, "round-off"), (1e3, "% of the energy held")])
def test_energy_not_explained_is_a_share_only_where_there_is_some(flown, size, words):
    """Without work and motion all energies are round-off, and a share of them says nothing."""
    unit = flown.report.round_off_J
    ledger = dict.fromkeys(flown.report.energy_balance, 0.0)
    ledger.update(kinetic=size * unit, residual=0.3 * unit)
    assert words in dataclasses.replace(flown.report, energy_balance=ledger).unexplained


def test_attenuation_is_fitted_to_what_there_is():
    """Velocities that fall as 30 r^-1.5 around the paper's hole: the law is found."""
    made = made_result(mesh=read_mesh(PAPER_BLOCK), frames=1)
    speed = 30.0 * made.attenuation().distance ** -1.5
    fall = dataclasses.replace(made, peak_speed=speed)
    law = fall.attenuation().power_law(4.0, inner_only=False)
    assert law == pytest.approx((-1.5, 30.0), rel=1e-9)
    assert np.isnan(fall.attenuation().power_law(4.0)).all()


def test_two_free_bodies_are_recorded_as_they_move_and_turn():
    velocity = np.array([[3.0, 0.0, 0.0], [0.0, -1.0, 2.0]])
    mesh = placed_together({"a": (single(), np.zeros(3)), "b": (single(), np.ones(3))})
    spin = np.array([[0.0, 0.0, 50.0], [0.0, 0.0, 0.0]])
    simulation = Simulation(Scene(mesh, CONCRETE, velocity=velocity, spin=spin), Uniform(1e-6))
    both, second = made = MotionRecord(), MotionRecord(slice(1, 2))
    run_simulation(simulation, until=1e-4, samples=5, progress=None, observers=made)
    # A hundred steps round a place near 1 m.
    assert both.moved == pytest.approx(np.multiply.outer(both.time_s, velocity), abs=2e-14)
    assert second.kinetic_energy == pytest.approx(0.5 * second.mass[0] * 5.0, rel=1e-12)
    # A regular tetrahedron turns about any axis as a ball does.
    spun = 0.5 * both.inertia[0, 0, 0] * 50.0**2
    assert both.rotational_energy == pytest.approx(spun, rel=1e-9)
    assert both.momentum == pytest.approx(np.tile(both.mass @ velocity, (6, 1)), rel=1e-12)
    orbit = np.cross([1.0, 1.0, 1.0], both.mass[1] * velocity[1])
    whole = orbit + np.array([0.0, 0.0, 50.0 * both.inertia[0, 0, 0]])
    assert both.angular_momentum == pytest.approx(np.tile(whole, (6, 1)), rel=1e-9)
