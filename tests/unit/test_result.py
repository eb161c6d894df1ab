"""Files of a result, also those for other programs, tell what it holds and no more."""

import csv
import dataclasses
import re

import meshio
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, Uniform, read_mesh, simulate, write_paraview
from taichi_dem.kit.display import BRIEF
from taichi_dem.kit.effect_table import EffectUse
from taichi_dem.mesh.shapes import bar
from taichi_dem.plot.block import TITLES
from tests.figures import clipped_words
from tests.made_result import made_result

NAN = float("nan")


@pytest.fixture(scope="module")
def flown(taichi_session):
    """A bar that flies and turns; every third bond is said to have broken at a time of its own."""
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [], velocity=(2, 0, 0), spin=(0, 9, 0))
    made = simulate(scene, method=Uniform(1e-7), until=4e-6, samples=4, frames=4, progress=None)
    time = np.linspace(1e-6, 4e-6, made.model.bond_count)
    time[np.arange(len(time)) % 3 > 0] = NAN
    return dataclasses.replace(made, broken_time=time)


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


@pytest.mark.parametrize("height", [0.02, 0.25, 0.31, 0.4, 1.0, 4.0])
@pytest.mark.parametrize("panels", [1, 4, 6])
def test_no_word_on_since_when_effects_act_is_cut_off(height, panels):
    """Of flat scenes and high ones, whatever the number of effects."""
    made = made_result(mesh=bar(1.0, height, (4, 1, 1)))
    since = np.linspace(0.0, 2e-5, made.model.body_count)
    made = dataclasses.replace(made, acting_since=dict.fromkeys(list(TITLES)[:panels], since))
    figure = made.plot.acting()
    FigureCanvasAgg(figure).draw()
    assert [*clipped_words(figure)] == []


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


def test_attenuation_is_fitted_to_what_there_is():
    """Velocities that fall as 30 r^-1.5 around the paper's hole: the law is found."""
    made = made_result(mesh=read_mesh(PAPER_BLOCK), frames=1)
    speed = 30.0 * made.attenuation().distance ** -1.5
    fall = dataclasses.replace(made, peak_speed=speed)
    law = fall.attenuation().power_law(4.0, inner_only=False)
    assert law == pytest.approx((-1.5, 30.0), rel=1e-9)
    assert np.isnan(fall.attenuation().power_law(4.0)).all()


@pytest.fixture(scope="module")
def result():
    made = made_result()
    since = np.where(np.arange(made.model.body_count) % 2, 1.5e-5, np.nan)
    return dataclasses.replace(made, acting_since={"softening": since})


def test_a_series_for_paraview_holds_bodies_and_their_stress(result, tmp_path):
    write_paraview(tmp_path, result.model, result.frames, "run", result.acting_since)
    for k, frame in enumerate(result.frames):
        vtu = meshio.read(tmp_path / f"run_{k:04d}.vtu")
        assert vtu.cells[0].data.shape == (result.model.body_count, 4)
        (stress,), (largest,) = (vtu.cell_data[f"{name}stress_Pa"] for name in ("", "largest_"))
        assert np.array_equal(stress.reshape(-1, 3, 3), frame.stress)
        assert largest == pytest.approx(np.linalg.eigvalsh(frame.stress)[:, 2], rel=1e-12)


def test_a_report_is_brief_and_loses_nothing(flown):
    report = flown.report
    lines = str(report).splitlines()
    assert [line.split()[0] for line in lines[:3]] == ["result", "error", "time"]
    assert len(lines) <= BRIEF and report.known_error in lines[1]
    told = dataclasses.replace(report, unresolved=tuple(map(str, range(30))))
    lines, details = str(told).splitlines(), told.details()
    assert len(lines) == BRIEF and all(f"warning: {k}\n" in f"{details}\n" for k in range(30))
    left = re.fullmatch(r"and (\d+) more lines: report.details\(\)", lines[-1])
    assert f"warning: {30 - int(left[1]) - 1}" == lines[-2]


def test_a_report_says_that_an_effect_acted_only_where_an_event_was_counted(flown):
    given = {"softening": (3, False), "bond_damping": (0, True), "friction": (0, False)}
    uses = [
        EffectUse(name, "events", n, energy_J=0.0, rounding=round_)
        for name, (n, round_) in given.items()
    ]
    (line,) = [
        line
        for line in str(dataclasses.replace(flown.report, effect_activity=tuple(uses))).splitlines()
        if line.startswith("effects")
    ]
    assert line.split(None, 1)[1] == (
        "softening acted; bond_damping not counted; friction never acted"
    )
