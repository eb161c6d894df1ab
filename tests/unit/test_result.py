"""What a result tells of its run: files, also for other programs, a report, fragments and cracks.

An observer sees the run as its result tells it and changes no bit. Fragments are a partition of
the bodies that conserves mass, momentum and energy.
"""

import csv
import dataclasses
import html

import meshio
import numpy as np
import pytest

from cases.blast import run_costs
from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    Checkpoint,
    Collector,
    Every,
    Receivers,
    Scene,
    Uniform,
    read_mesh,
    simulate,
    write_paraview,
)
from taichi_dem.kit.display import BRIEF
from taichi_dem.mesh.files import write_vtu
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import signed_volumes
from taichi_dem.output.fracture import fragment_of_body, strike_and_dip
from taichi_dem.output.record import body_corners, cell_data
from tests.made_result import made_result

NAN, SEED = float("nan"), 2


@pytest.fixture(scope="module")
def flown(taichi_session):
    """A bar that flies and turns; every third bond is said to have broken at a time of its own."""
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [], velocity=(2, 0, 0), spin=(0, 9, 0))
    made = simulate(scene, method=Uniform(1e-7), until=4e-6, samples=4, frames=4, progress=None)
    time = np.linspace(1e-6, 4e-6, made.model.bond_count)
    time[np.arange(len(time)) % 3 > 0] = NAN
    return dataclasses.replace(made, broken_time=time)


@pytest.fixture(scope="module")
def result():
    """One that is made up, with bonds broken at random."""
    return made_result(SEED)


def areas_of(model):
    """Areas of all bonds [m^2]."""
    a, b, c = model.mesh.points[model.topology.vertices].transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def test_times_of_breaking_are_written(flown, tmp_path):
    """A row a bond: its bodies, its face and when it broke, an empty cell while it holds."""
    flown.write(tmp_path)
    with open(tmp_path / "bonds.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    top = flown.model.topology
    assert [int(row["master"]) for row in rows] == top.master.tolist()
    assert [int(row["slave"]) for row in rows] == top.slave.tolist()
    times = [float(row["broken_time_s"] or NAN) for row in rows]
    assert np.array_equal(times, flown.broken_time, equal_nan=True)
    areas = [float(row["area_m2"]) for row in rows]
    assert areas == pytest.approx(areas_of(flown.model), rel=1e-14)


def files_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_folder_used_before_keeps_nothing_of_the_earlier_series(flown, tmp_path):
    """And all that is not of this series, however alike its name."""
    place, name = tmp_path / "run", "paraview/run"
    flown.write(place)
    others = {f"{name}.txt", f"{name}_1.vtu", f"{name}2_0001.vtu", "run_0001.vtu", "mine.txt"}
    for other in others:
        (place / other).write_text("mine")
    dataclasses.replace(flown, frames=flown.frames[:2]).write(place)
    tables = {"history.csv", "bonds.csv", "mesh.msh", "report.json"}
    series = {f"{name}_0000.vtu", f"{name}_0001.vtu", f"{name}.pvd"}
    assert files_in(place) == tables | series | others


def test_attenuation_is_fitted_to_what_there_is():
    """Velocities that fall as 30 r^-1.5 around the paper's hole: the law is found."""
    made = made_result(mesh=read_mesh(PAPER_BLOCK), frames=1)
    speed = 30.0 * made.attenuation().distance ** -1.5
    fall = dataclasses.replace(made, peak_speed=speed)
    law = fall.attenuation().power_law(4.0, inner_only=False)
    assert law == pytest.approx((-1.5, 30.0), rel=1e-9)
    assert np.isnan(fall.attenuation().power_law(4.0)).all()


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_a_series_for_paraview_holds_bodies_and_their_data(result, tmp_path, kind):
    given = result.model, result.frames, "run", result.acting_since
    write_paraview(tmp_path, *given, single=kind is np.float32)
    for k, frame in enumerate(result.frames):
        vtu = meshio.read(tmp_path / f"run_{k:04d}.vtu")
        assert vtu.cells[0].data.shape == (result.model.body_count, 4)
        points = body_corners(result.model, frame).reshape(-1, 3)
        assert np.array_equal(vtu.points, points.astype(kind))
        for name, wanted in cell_data(result.model, frame, result.acting_since).items():
            (found,) = vtu.cell_data[name]
            wanted = wanted.astype(kind) if wanted.dtype == float else wanted
            assert np.array_equal(found, wanted, equal_nan=wanted.dtype == kind), name
        largest = np.linalg.eigvalsh(frame.stress)[:, 2]
        assert frame.largest_stress == pytest.approx(largest, rel=1e-12)


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("count", range(1, 30))
def test_a_file_for_paraview_is_read_back_whatever_its_length(count, single, tmp_path):
    random = np.random.default_rng(count)

    def drawn(*shape):
        return random.normal(size=shape).astype(np.float32 if single else np.float64)

    points, cells = drawn(4 * count, 3), np.arange(4 * count).reshape(-1, 4)
    data = {"a": drawn(count), "b": drawn(count, 9), "c": cells[:, 0]}
    write_vtu(tmp_path / "one.vtu", points, cells.astype(np.int32), data, single)
    vtu = meshio.read(tmp_path / "one.vtu")
    assert np.array_equal(vtu.points, points) and np.array_equal(vtu.cells[0].data, cells)
    assert all(np.array_equal(vtu.cell_data[name][0], data[name]) for name in data)


def test_a_report_is_brief_and_loses_nothing(flown):
    told = dataclasses.replace(flown.report, unresolved=tuple(map(str, range(30))))
    assert len(str(told).splitlines()) == BRIEF
    assert all(f"warning: {k}\n" in f"{told.details()}\n" for k in range(30))


def vectors_of(fragments, name):
    """Three columns of a table as vectors (n, 3)."""
    return fragments.filter(regex=rf"^{name}_[xyz]_").to_numpy()


@pytest.mark.parametrize("share", [0.0, 0.7, 1.0])
def test_fragments_are_what_unbroken_bonds_join(share):
    """By sets of bodies, joined one bond after the other."""
    result = made_result(SEED, share=share)
    broken, top = np.isfinite(result.broken_time), result.model.topology
    part = [{body} for body in range(result.model.body_count)]
    for one, other in zip(top.master[~broken], top.slave[~broken]):
        joined = part[one] | part[other]
        for body in joined:
            part[body] = joined
    of_body = fragment_of_body(result.model, broken)
    groups = {frozenset(np.flatnonzero(of_body == k)) for k in range(of_body.max() + 1)}
    assert groups == {*map(frozenset, part)}


def test_mass_momentum_and_energy_of_fragments_are_those_of_the_bodies(result, flown):
    """To the rounding of sums of a hundred numbers; frames and samples are of one time."""
    model, frame, found = result.model, result.frames[-1], result.fragments()
    close = {"rel": 1e-13, "abs": 1e-13}
    assert found["mass_kg"].sum() == pytest.approx(model.body_mass.sum(), rel=1e-13)
    volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra).sum()
    assert found["volume_m3"].sum() == pytest.approx(volume, rel=1e-13)
    momentum = found["mass_kg"].to_numpy() @ vectors_of(found, "velocity")
    assert momentum == pytest.approx(model.body_mass @ frame.velocity, **close)
    for k in (2, -1):
        energy = flown.series["kinetic_J"][k]
        assert flown.fragments(k)["kinetic_J"].sum() == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.8, 1.0])
def test_a_sieve_lets_its_share_of_the_mass_pass_and_no_smaller_one_does(result, share):
    found, size = result.fragments(), result.sieve_size(share)
    mass, sieve = found["mass_kg"].to_numpy(), found["sieve_m"].to_numpy()
    # To the rounding of the sums.
    assert mass[sieve <= size].sum() >= (share - 1e-12) * mass.sum()
    assert mass[sieve < size].sum() < (share + 1e-12) * mass.sum()


def test_a_notebook_shows_the_block_first_and_reports_in_full(flown):
    page = flown._repr_html_()
    assert page.index("The block") < page.index("What happened over time")
    assert html.escape(flown.report.details()) in flown.report._repr_html_()


def test_pieces_of_a_turning_bar_have_its_motion(flown):
    """Its spin w, and V + w x r; no part of the energy is vibration. At the start, to rounding."""
    at_once = np.where(np.isnan(flown.broken_time), NAN, 0.0)
    found = dataclasses.replace(flown, broken_time=at_once).fragments(0)
    (velocity, *_), (spin, *_) = map(flown.scene.initial_motion.get, ("velocity", "spin"))
    centre, near = vectors_of(found, "centre"), {"rel": 1e-12, "abs": 1e-12}
    velocity = velocity + np.cross(spin, centre - flown.model.centre[0])
    assert len(found) > 3
    assert vectors_of(found, "velocity") == pytest.approx(velocity, **near)
    assert vectors_of(found, "spin") == pytest.approx(np.tile(spin, (len(found), 1)), **near)
    rigid = (found["translation_J"] + found["rotation_J"]).to_numpy()
    assert rigid == pytest.approx(found["kinetic_J"].to_numpy(), rel=1e-9)


def test_crack_area_is_that_of_the_broken_bonds(result):
    broken, areas = np.isfinite(result.broken_time), areas_of(result.model)
    total, cracks = areas[broken].sum(), result.cracks()
    assert cracks["area_m2"].sum() == pytest.approx(total, rel=1e-13)
    assert sorted(cracks["bond"]) == np.flatnonzero(broken).tolist()
    assert (np.diff(cracks["time_s"]) >= 0.0).all()
    rose = result.rose()
    assert rose["area_m2"].sum() + rose.attrs["parallel_m2"] == pytest.approx(total, rel=1e-12)
    for time_s, area in zip(*map(result.crack_area().get, ("time_s", "crack_area_m2"))):
        wanted = areas[result.broken_time <= time_s].sum()
        assert area == pytest.approx(wanted, rel=1e-12, abs=1e-18)


def test_strike_and_dip_follow_the_right_hand():
    """x is east, y north, z up: what dips south strikes east, and so on by one turn."""
    strike, dip = np.array([0.0, 90.0, 180.0, 270.0]), np.array([90.0, 30.0, 30.0, 30.0])
    a, b = np.radians(strike), np.radians(dip)
    normal = np.column_stack([np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)])
    assert strike_and_dip(normal) == pytest.approx(np.array([strike, dip]), abs=1e-9)


def test_shares_of_energy_add_up_where_the_balance_does(result):
    history = dict(result.series)
    held = sum(history[f"{name}_J"][0] for name in ("kinetic", "bond_strain", "sphere_strain"))
    given = held + history["load_work_J"] + history["support_work_J"] + history["injected_J"]
    shares = result.energy_shares()
    terms = [name for name in shares if name.endswith("_share")]
    taken = sum(history[name.replace("_share", "_J")] for name in terms if "residual" not in name)
    history["residual_J"] = given - taken
    closed = dataclasses.replace(result, series=history).energy_shares()
    assert closed["given_J"].to_numpy() == pytest.approx(given, rel=1e-13)
    whole = sum(closed[name].to_numpy() for name in terms)
    assert whole == pytest.approx(np.ones(len(given)), rel=1e-12)


V, W, STEP = np.array([0.5, -0.2, 0.1]), np.array([0.0, 0.0, 400.0]), 1e-7
POINTS = {"corner": (0.2, 0.1, 0.1), "inside": (0.05, 0.03, 0.06)}


def flight(*observers, steps=200, **options):
    """A bar that flies and turns as one rigid body; its bonds hardly stretch."""
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [], velocity=V, spin=W)
    options = {"method": Uniform(STEP), "until": steps * STEP, "samples": 4, **options}
    return simulate(scene, progress=None, observers=list(observers), **options)


def test_an_observer_sees_the_run_as_its_result_tells_it_and_changes_no_bit():
    alone = flight(frames=4)
    seen = Collector(
        Every(steps=50),
        kinetic=lambda view: view.energy_balance()["kinetic"],
        rows=lambda view: len(view.history()["time_s"]),
        place=lambda view: view.motion()["position"],
    )
    costs = run_costs()
    watched = flight(seen, costs, frames=4)
    assert seen["kinetic"].tolist() == alone.series["kinetic_J"].tolist()
    assert seen["rows"].tolist() == [1, 2, 3, 4, 5]
    assert seen["place"][-1].tobytes() == alone.frames[-1].position.tobytes()
    for name, column in alone.series.items():
        assert column.tobytes() == watched.series[name].tobytes(), name
    assert costs["evaluations"][-1] == alone.report.contact_evaluations


def test_a_resumed_run_calls_for_what_is_left(tmp_path):
    path = tmp_path / "run.checkpoint"
    flight(steps=10, checkpoint=Checkpoint(path))
    left = Collector(Every(steps=5), step=lambda view: view.step)
    flight(left, steps=20, resume=path)
    assert left["step"].tolist() == [15, 20]


def test_points_of_a_turning_bar_move_on_their_circles():
    """x = m + R(wt)(X - m) + V t. Bonds that carry the turn stretch by (w L)^2 rho / k of length.

    That is 400^2 0.1^2 2390 / 450e9 = 8e-6 m of 45e9 Pa/m; of a way of 8e-4 m it is below 2 %.
    """
    result, middle = flight(Receivers(POINTS)), np.array([0.1, 0.05, 0.05])
    for name, at in POINTS.items():
        got, arm = result.receivers[name], np.array(at) - middle
        assert got.time_s.tobytes() == result.series["time_s"].tobytes()
        cos, sin = np.cos(W[2] * got.time_s), np.sin(W[2] * got.time_s)
        x, y = cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]
        turned = np.stack([x, y, np.full_like(x, arm[2])], axis=1)
        np.testing.assert_allclose(
            got.displacement, turned - arm + V * got.time_s[:, None], atol=8e-6
        )
        assert not got.displacement[0].any()
        np.testing.assert_allclose(got.velocity[0], V + np.cross(W, arm), rtol=1e-12)
    source, charge = (0.0, 0.0, 0.0), 4.0
    peaks = result.peak_velocities(source, charge)
    assert (
        sorted(peaks["receiver"]) == sorted(POINTS) and peaks["distance_m"].is_monotonic_increasing
    )
    for row in peaks.itertuples():
        away, velocity = (
            np.linalg.norm(POINTS[row.receiver]),
            result.receivers[row.receiver].velocity,
        )
        assert row.distance_m == pytest.approx(away, rel=1e-15)
        assert row.scaled_distance_m_kg05 == pytest.approx(away / 2.0, rel=1e-15)
        assert row.peak_m_s == np.sqrt((velocity**2).sum(axis=1)).max()
        assert row.peak_y_m_s == abs(velocity[:, 1]).max()
