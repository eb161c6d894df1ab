"""Cracks by area, time and direction, and what the energy went into."""

import dataclasses

import numpy as np
import pytest

from taichi_dem import CONCRETE
from taichi_dem.kit.fixed_order import length
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.output.cracks import rose_of, strike_and_dip
from taichi_dem.state.model import Model
from tests.made_result import made_result, turned


@pytest.fixture(scope="module")
def result():
    return made_result()


def areas_of(model):
    """Areas of all bonds [m^2]."""
    return length(area_vectors(model.mesh.points, model.topology.vertices))


def test_crack_area_is_that_of_the_broken_bonds(result):
    broken = np.isfinite(result.broken_time)
    total, cracks = areas_of(result.model)[broken].sum(), result.cracks()
    assert cracks["crack_area_m2"].iloc[-1] == pytest.approx(total, rel=1e-13)
    assert cracks["area_m2"].sum() == pytest.approx(total, rel=1e-13)
    assert sorted(cracks["bond"]) == np.flatnonzero(broken).tolist()
    assert (np.diff(cracks["time_s"]) >= 0.0).all()
    rose = result.rose()
    assert rose["area_m2"].sum() + rose.attrs["parallel_m2"] == pytest.approx(total, rel=1e-12)
    over_time = result.crack_area()
    for time_s, area in zip(over_time["time_s"], over_time["crack_area_m2"]):
        wanted = areas_of(result.model)[result.broken_time <= time_s].sum()
        assert area == pytest.approx(wanted, rel=1e-12, abs=1e-18)


def test_of_a_face_that_is_half_bonded_half_breaks(result):
    model = Model(result.scene.mesh, CONCRETE, result.scene.effects)
    half = np.full(model.bond_count, 0.5)
    model.topology = dataclasses.replace(model.topology, bonded_share=half)
    weak = dataclasses.replace(result, model=model)
    whole = result.cracks()["crack_area_m2"]
    assert np.array_equal(weak.cracks()["crack_area_m2"], 0.5 * whole)
    half_rose = weak.rose()["area_m2"].to_numpy()
    assert half_rose == pytest.approx(0.5 * result.rose()["area_m2"].to_numpy(), rel=1e-13)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0)])
@pytest.mark.parametrize("steps", [1, 7])
def test_a_turned_block_has_a_turned_rose(result, axis, steps):
    """By whole sectors, counter-clockwise as seen along the axis."""
    mesh, broken = result.scene.mesh, np.isfinite(result.broken_time)
    turn = turned(np.array([axis], dtype=float), np.radians([5.0 * steps]))[0]
    model = Model(
        dataclasses.replace(mesh, points=mesh.points @ turn.T), CONCRETE, result.scene.effects
    )
    first, second = result.rose(axis), rose_of(model, broken, axis)
    assert second["area_m2"].to_numpy() == pytest.approx(np.roll(first["area_m2"], steps), rel=1e-9)
    assert np.array_equal(second["faces"], np.roll(first["faces"], steps))


@pytest.mark.parametrize(
    ("normal", "strike", "dip"),
    [
        ((0, 0, 1), 0.0, 0.0),
        ((1, 0, 0), 0.0, 90.0),
        ((0, -0.5, np.sqrt(0.75)), 90.0, 30.0),
        ((0.5, 0, np.sqrt(0.75)), 0.0, 30.0),
        ((-0.5, 0, np.sqrt(0.75)), 180.0, 30.0),
        ((0, 0.5, np.sqrt(0.75)), 270.0, 30.0),
    ],
)
def test_strike_and_dip_follow_the_right_hand(normal, strike, dip):
    """x is east, y north, z up: a face that dips south strikes east."""
    found = strike_and_dip(np.array([normal], dtype=float))
    assert [float(one[0]) for one in found] == pytest.approx([strike, dip], abs=1e-9)


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
    assert sum(closed[name].to_numpy() for name in terms) == pytest.approx(
        np.ones(len(given)), rel=1e-12
    )
