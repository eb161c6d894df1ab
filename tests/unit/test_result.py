"""A result in a notebook, whatever became of the run, and the files that it writes."""

import contextlib
import csv
import dataclasses
import os
import re
from xml.etree import ElementTree

import matplotlib
import matplotlib.pyplot as plt
import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    InputError,
    Scene,
    effects,
    read_mesh,
    runtime,
    simulate,
)
from taichi_dem.kit.files import write_text
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.output.record import series_name, write_bodies, write_paraview
from taichi_dem.plot import block, plot_steps
from taichi_dem.plot.summary import _draw_curves, scale, viewed_along
from taichi_dem.plot.view import View
from tests.bad_input.refusals import steady
from tests.notebook import shown

NAN = float("nan")


def run(mesh, *listed, **options):
    scene = Scene(mesh, CONCRETE, listed)
    return simulate(scene, method=ImplicitDashpots(), until=4e-6, **{"samples": 4, **options})


@pytest.fixture(scope="module")
def results():
    """A beam under gravity and a body alone; their session has ended, no field can be read."""
    beam = run(bar(0.4, 0.1, (4, 1, 1)), effects.Fixed("left"), effects.Gravity(), frames=2)
    alone = run(single(), samples=1)
    runtime.stop()
    return beam, alone


@pytest.fixture(scope="module")
def beam(results):
    return results[0]


@pytest.fixture(scope="module")
def broken(beam):
    """The same, with every third bond broken at a time of its own."""
    time = np.linspace(1e-6, 4e-6, beam.model.bond_count)
    time[np.arange(len(time)) % 3 > 0] = NAN
    history = {**beam.history, "broken_faces": np.arange(5)}
    report = dataclasses.replace(beam.report, broken_faces=int(np.isfinite(time).sum()))
    return dataclasses.replace(beam, broken_time=time, history=history, report=report)


def test_a_notebook_shows_picture_and_figures(beam):
    page, pixels = shown(beam)
    assert pixels.shape[1] > 600 and pixels.std() > 5.0
    for words in ("24 bodies", "gravity, fixed", "m/s", " J", "implicit", "0 of 30 bonds"):
        assert words in page.text, words
    assert str(beam.report) in page.text


def same_pictures(first, second):
    return np.array_equal(shown(first)[1], shown(second)[1])


def test_breaks_are_drawn(broken):
    page, _ = shown(broken)
    count = np.isfinite(broken.broken_time).sum()
    assert f"{count} of 30 bonds broken" in page.text
    whole = dataclasses.replace(broken, broken_time=np.full_like(broken.broken_time, NAN))
    assert not same_pictures(broken, whole)


def nothing_but_nan(result):
    history = {name: np.full(len(column), NAN) for name, column in result.history.items()}
    report = dataclasses.replace(
        result.report,
        energy_balance=dict.fromkeys(result.report.energy_balance, NAN),
        run_seconds=NAN,
    )
    frame = dataclasses.replace(
        result.frames[-1], displacement=NAN * result.frames[-1].displacement
    )
    speed = np.full(result.model.body_count, NAN)
    return dataclasses.replace(
        result, history=history, report=report, frames=(frame,), peak_speed=speed
    )


def flown_off(result):
    frame = result.frames[-1]
    far = dataclasses.replace(
        frame, displacement=frame.displacement + 1e30, position=frame.position + 1e30
    )
    return dataclasses.replace(result, frames=(far,), peak_speed=1e300 * result.peak_speed)


ODD = {
    "no frames": lambda beam: dataclasses.replace(beam, frames=()),
    "one frame, at rest": lambda beam: dataclasses.replace(beam, frames=beam.frames[:1]),
    "one sample": lambda beam: dataclasses.replace(
        beam, history={name: column[:1] for name, column in beam.history.items()}
    ),
    "no sample": lambda beam: dataclasses.replace(
        beam, history={name: column[:0] for name, column in beam.history.items()}
    ),
    "no history": lambda beam: dataclasses.replace(beam, history={}),
    "NaN": nothing_but_nan,
    "flown off": flown_off,
    "infinite speed": lambda beam: dataclasses.replace(
        beam, peak_speed=np.full(beam.model.body_count, np.inf), frames=()
    ),
    "all broken at once": lambda beam: dataclasses.replace(
        beam, broken_time=np.zeros(beam.model.bond_count)
    ),
    "hole": lambda beam: dataclasses.replace(
        beam, history={**beam.history, "hole_radial_displacement_mm": np.arange(5.0)}
    ),
}


@pytest.mark.parametrize("how", ODD)
def test_an_odd_result_is_shown_all_the_same(beam, how):
    """Warnings are errors here: nothing is divided by zero on the way."""
    odd = ODD[how](beam)
    shown(odd)
    assert "nan" not in repr(odd) and len(repr(odd)) < 500


@pytest.mark.parametrize("how", [nothing_but_nan, flown_off])
def test_a_frame_that_cannot_be_drawn_gives_way_to_the_speeds(beam, how):
    without = dataclasses.replace(beam, frames=())
    assert not same_pictures(beam, without)
    assert same_pictures(how(beam), dataclasses.replace(how(beam), frames=()))


def test_a_body_alone_is_shown(results):
    """No bonds, no effects, no frames."""
    page, _ = shown(results[1])
    assert "0 bonds" in page.text and "none" in page.text


def test_what_went_wrong_is_said_as_it_stands(beam):
    """Text is escaped: nothing in it can become a tag."""
    sentence = 'diverged at t = 1 s: speed > 1e4 & <script>alert("x")</script>'
    page, _ = shown(dataclasses.replace(beam, diverged=sentence))
    assert sentence in page.text and "script" not in page.tags
    report = dataclasses.replace(beam.report, unresolved=("a <i> b",), effects=("<i>", "&amp;"))
    page, _ = shown(dataclasses.replace(beam, report=report))
    assert str(report) in page.text and "<i>, &amp;" in page.text and "i" not in page.tags


def test_a_picture_leaves_no_trace(beam):
    """Neither in matplotlib's settings nor among pyplot's figures; and it is the same again."""
    before = dict(matplotlib.rcParams)
    first = beam._repr_html_()
    import matplotlib.pyplot as plt

    assert plt.get_fignums() == []
    assert dict(matplotlib.rcParams) == before
    assert beam._repr_html_() == first


@pytest.mark.parametrize("axis", range(3))
def test_a_bar_is_seen_from_its_side(axis):
    """Whichever way it lies, its length is in the picture; a cube is seen along z."""
    points = np.roll(bar(1.0, 0.1, (6, 1, 1)).points, axis, axis=1)
    flat = View(viewed_along(points)).project(points)
    assert np.ptp(flat, axis=0).max() == pytest.approx(1.0)
    assert viewed_along(bar(0.1, 0.1, (1, 1, 1)).points).tolist() == [0.0, 0.0, 1.0]


@given(st.floats(1e-11, 1e13))
@steady
def test_units_leave_one_to_three_digits(value):
    factor, unit = scale(value, "m")
    assert 1.0 - 1e-6 <= factor * value < 1000.0 + 1e-6
    assert unit.endswith("m")


def test_units_of_what_no_prefix_fits():
    assert scale(0.0, "J") == (1.0, "J")
    assert scale(1e-3, "s") == (1e3, "ms") and scale(2e-7, "s")[1] == "ns"
    assert scale(1e-40, "J")[1] == "pJ" and scale(1e300, "m/s")[1] == "Tm/s"


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_times_of_breaking_are_written(broken, tmp_path):
    """A row a bond: its bodies, its face and when it broke, an empty cell while it holds."""
    broken.write(tmp_path)
    rows, top = rows_of(tmp_path / "bonds.csv"), broken.model.topology
    assert [int(row["bond"]) for row in rows] == list(range(top.bond_count))
    assert [int(row["master"]) for row in rows] == top.master.tolist()
    assert [int(row["slave"]) for row in rows] == top.slave.tolist()
    assert [row["broken_time_s"] == "" for row in rows] == np.isnan(broken.broken_time).tolist()
    times = [float(row["broken_time_s"]) for row in rows if row["broken_time_s"]]
    assert times == broken.broken_time[~np.isnan(broken.broken_time)].tolist()
    a, b, c = broken.model.mesh.points[top.vertices].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert [float(row["area_m2"]) for row in rows] == pytest.approx(area, rel=1e-14)
    centre = np.array([[float(row[f"{axis}_m"]) for axis in "xyz"] for row in rows])
    assert centre == pytest.approx((a + b + c) / 3.0, abs=1e-15)


def test_bodies_of_all_frames_are_written(beam, tmp_path):
    write_bodies(tmp_path / "bodies.csv", beam.frames)
    rows, count = rows_of(tmp_path / "bodies.csv"), beam.model.body_count
    assert [int(row["body"]) for row in rows] == [*range(count)] * len(beam.frames)
    frame, last = beam.frames[-1], rows[-count:]
    assert [float(row["time_s"]) for row in last] == [frame.time_s] * count
    assert [int(row["level"]) for row in last] == frame.level.tolist()
    assert [float(row["speed_m_s"]) for row in last] == frame.speed.tolist()
    moved = np.linalg.norm(frame.displacement, axis=1)
    assert [float(row["displacement_m"]) for row in last] == moved.tolist() and moved.any()


@pytest.mark.parametrize(("count", "drawn"), [(3, 3), (6, 6), (7, 6), (40, 6)])
def test_steps_are_drawn_at_six_times_at_most(beam, tmp_path, monkeypatch, count, drawn):
    frames = [dataclasses.replace(beam.frames[0], time_s=1e-3 * k) for k in range(count)]
    titles, levels = [], block._levels
    monkeypatch.setattr(
        block, "_levels", lambda *given: titles.append(given[3].time_s) or levels(*given)
    )
    plot_steps(tmp_path / "steps.png", beam.model, frames, 1e-6)
    assert len(titles) == drawn and titles[-1] == frames[-1].time_s


def test_a_body_alone_leaves_a_table_without_rows(results, tmp_path):
    results[1].write(tmp_path)
    assert rows_of(tmp_path / "bonds.csv") == []
    assert not (tmp_path / "paraview").exists()


def names_in(folder):
    """Name of the only series in a folder; all files that it lists are there and no others."""
    series = list(folder.glob("*.pvd"))
    assert len(series) == 1
    listed = [node.get("file") for node in ElementTree.parse(series[0]).iter("DataSet")]
    assert sorted(listed) == sorted(path.name for path in folder.glob("*.vtu"))
    for name in listed:
        meshio.read(folder / name)
    return series[0].stem


@pytest.mark.parametrize(
    ("folder", "name"),
    [
        ("mine", "mine"),
        ("mine/", "mine"),
        ("deep/mine//", "mine"),
        ("mine/../other/.", "other"),
        (".", "here"),
        ("my run", "my_run"),
        ("Bruch 1 (größer)", "Bruch_1_größer"),
        ('a&b"c', "a_b_c"),
        (".hidden", "hidden"),
        ("-x", "x"),
        ("v1.2", "v1.2"),
        ("???", "run"),
        ("line\nbreak", "line_break"),
        ("x" * 200, "x" * 50),
        ("字" * 80, "字" * 50),
    ],
)
def test_a_series_is_named_after_its_folder(beam, tmp_path, monkeypatch, folder, name):
    (tmp_path / "here" / "mine").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here")
    with contextlib.suppress(FileExistsError):
        os.makedirs(os.path.normpath(folder))
    beam.write(folder)
    place = (tmp_path / "here" / folder).resolve()
    assert names_in(place / "paraview") == name


def test_write_paraview_takes_the_name_of_its_folder_or_one_given(beam, tmp_path):
    write_paraview(tmp_path / "frames", beam.model, beam.frames)
    assert names_in(tmp_path / "frames") == "frames"
    write_paraview(tmp_path / "named", beam.model, beam.frames, "mine")
    assert names_in(tmp_path / "named") == "mine"


@given(st.text(st.characters(blacklist_characters="\0"), max_size=80))
@steady
def test_a_series_name_is_a_file_name_whatever_the_folder(text):
    name = series_name(f"/results/{text}")
    assert re.fullmatch(r"[\w.-]{1,50}", name)
    assert name[0] not in ".-_" and name[-1] not in ".-_"
    # With number, ending, and the letters of a temporary name beside it.
    assert len(name.encode()) + 30 < 255


def test_the_root_is_no_name():
    assert series_name("/") == "run"


@pytest.mark.parametrize("folder", ["", None, 3, b"results", "a\0b"])
def test_a_folder_that_is_none_is_refused(beam, folder):
    with pytest.raises(InputError, match="output folder must be"):
        beam.write(folder)


def files_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("frames", [0, 1, 2])
def test_a_folder_used_before_keeps_nothing_of_the_earlier_series(beam, tmp_path, frames):
    """And all that is not of this series, however alike its name."""
    place, name = tmp_path / "run", "paraview/run"
    dataclasses.replace(beam, frames=beam.frames * 4).write(place)
    others = {f"{name}.txt", f"{name}_1.vtu", f"{name}2_0001.vtu", f"{name}_0001_0001.vtu"}
    others |= {"run_0001.vtu", "mine.txt", "paraview/other.pvd", "paraview/xrun.pvd"}
    for other in others:
        (place / other).write_text("mine")
    (place / name).with_name("run_0099.vtu").mkdir()
    dataclasses.replace(beam, frames=beam.frames[:frames]).write(place)
    tables = {"history.csv", "bonds.csv", "mesh.msh", "report.json"}
    series = {f"{name}_{k:04d}.vtu" for k in range(frames)} | ({f"{name}.pvd"} if frames else set())
    assert files_in(place) == tables | series | others


def test_a_shorter_series_of_a_given_name_replaces_its_own(beam, tmp_path):
    write_paraview(tmp_path, beam.model, beam.frames, "a+b")
    write_paraview(tmp_path, beam.model, beam.frames, "c")
    write_paraview(tmp_path, beam.model, beam.frames[:1], "a+b")
    count = len(beam.frames)
    kept = {"c.pvd", *(f"c_{k:04d}.vtu" for k in range(count))}
    assert files_in(tmp_path) == kept | {"a+b.pvd", "a+b_0000.vtu"}


def test_a_tilde_is_the_users_home(beam, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    beam.write("~/run")
    assert names_in(tmp_path / "home" / "run" / "paraview") == "run"
    write_paraview("~/frames", beam.model, beam.frames)
    assert names_in(tmp_path / "home" / "frames") == "frames"
    write_text("~/a.txt", "x")
    write_mesh("~/a.msh", beam.scene.mesh)
    assert read_mesh("~/a.msh").source == str(tmp_path / "home" / "a.msh")
    assert Checkpoint("~/a.npz").path == str(tmp_path / "home" / "a.npz")
    assert list((tmp_path / "here").iterdir()) == []


def test_fragments_hold_the_kinetic_energy_of_the_account(beam):
    """Frames and samples are of one time; the share that bodies turn with is in both."""
    energy = beam.history["kinetic_J"]
    assert beam.fragments()["kinetic_J"].sum() == pytest.approx(energy[-1], rel=1e-12)
    assert beam.fragments(1)["kinetic_J"].sum() == pytest.approx(energy[2], rel=1e-12)
    assert all(beam.history.units.values())


def figures(result):
    return dict(result._figures())


def test_energy_not_explained_is_a_share_only_where_there_is_some(results):
    """Without work and motion all energies are round-off, and a share of them says nothing."""
    beam, alone = results
    assert beam.report.round_off_J > 0.0
    share = beam.report.energy_residual_fraction
    assert figures(beam)["energy not explained"].startswith(f"{100.0 * share:.3g} % of ")
    for size, words in ((1e-3, "round-off"), (1e3, "% of the energy held")):
        ledger = dict.fromkeys(beam.report.energy_balance, 0.0)
        ledger.update(
            kinetic=size * beam.report.round_off_J, residual=0.3 * beam.report.round_off_J
        )
        idle = dataclasses.replace(
            beam, report=dataclasses.replace(beam.report, energy_balance=ledger)
        )
        assert words in figures(idle)["energy not explained"] and words in str(idle.report)
    assert "%" not in figures(alone)["energy not explained"]
    ledger = {**beam.report.energy_balance, "load_work": 2.0, "residual": 0.01}
    pushed = dataclasses.replace(beam.report, energy_balance=ledger)
    assert pushed.unexplained == "0.5 % of it"


def test_broken_bonds_are_counted_in_whole_numbers():
    """Whatever their number."""
    for count in range(1, 12):
        _, panels = plt.subplots(1, 2)
        history = {"time_s": np.arange(2.0), "broken_faces": np.array([0, count])}
        _draw_curves(dict(zip(("energy", "events"), panels)), history)
        ticks = panels[1].get_yticks()
        plt.close("all")
        assert np.array_equal(ticks, np.round(ticks))


@pytest.mark.parametrize(
    "name",
    [
        "../x",
        "a/b",
        "/x",
        "a\\b",
        "c:x",
        "",
        ".",
        "..",
        ".x",
        "a\nb",
        "x\0",
        "x\udcff",
        201 * "x",
        3,
    ],
)
def test_a_series_name_that_is_no_file_of_its_folder_is_refused(beam, tmp_path, name):
    folder = tmp_path / "inner"
    with pytest.raises(InputError, match=r"^name must be a name for files of one folder, .*, got"):
        write_paraview(folder, beam.model, beam.frames, name)
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == []


def test_numpy_text_names_a_folder_as_any_text(beam, tmp_path):
    names = []
    for kind in (str, np.str_):
        folder = tmp_path / f"of {kind.__name__}" / "run"
        beam.write(kind(folder))
        names.append(sorted(str(path.relative_to(folder)) for path in folder.rglob("*")))
    assert names[0] == names[1] and len(names[0]) > 5
