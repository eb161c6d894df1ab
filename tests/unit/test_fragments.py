"""Fragments: a partition of the bodies that conserves mass, momentum and energy.

Cracks by area, time and direction, and what the energy went into.
"""

import dataclasses

import numpy as np
import pytest

from taichi_dem import CONCRETE
from taichi_dem.kit.fixed_order import length
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import area_vectors, signed_volumes
from taichi_dem.output.cracks import rose_of, strike_and_dip
from taichi_dem.output.fragments import fragment_of_body, rigid_motion, vectors_of
from taichi_dem.state.model import Model
from tests.made_result import made_result, moved_rigidly, turned

SEED = 2


def by_hand(model, broken):
    """Sets of bodies that bonds join, one bond after the other."""
    part = [{body} for body in range(model.body_count)]
    for one, other, gone in zip(model.topology.master, model.topology.slave, broken):
        if not gone and part[one] is not part[other]:
            joined = part[one] | part[other]
            for body in joined:
                part[body] = joined
    return {frozenset(one) for one in part}


@pytest.mark.parametrize("share", [0.0, 0.7, 1.0])
def test_fragments_are_what_unbroken_bonds_join(share):
    result = made_result(SEED, share=share)
    broken = np.isfinite(result.broken_time)
    of_body = fragment_of_body(result.model, broken)
    groups = {frozenset(np.flatnonzero(of_body == k)) for k in range(of_body.max() + 1)}
    assert groups == by_hand(result.model, broken)


def test_mass_momentum_and_energy_are_those_of_the_bodies():
    """To the rounding of sums of a hundred numbers."""
    result = made_result(SEED)
    model, frame, found = result.model, result.frames[-1], result.fragments()
    close = {"rel": 1e-13, "abs": 1e-13}
    assert found["mass_kg"].sum() == pytest.approx(model.body_mass.sum(), rel=1e-13)
    volume = signed_volumes(model.mesh.points, model.mesh.tetrahedra).sum()
    assert found["volume_m3"].sum() == pytest.approx(volume, rel=1e-13)
    momentum = found["mass_kg"].to_numpy() @ vectors_of(found, "velocity")
    assert momentum == pytest.approx(model.body_mass @ frame.velocity, **close)
    spins = np.linalg.inv(frame.rotation @ model.body_inertia @ np.swapaxes(frame.rotation, 1, 2))
    turning = np.einsum("ni,nij,nj->n", frame.angular_momentum, spins, frame.angular_momentum)
    energy = 0.5 * (model.body_mass * frame.speed**2 + turning)
    assert found["kinetic_J"].sum() == pytest.approx(energy.sum(), rel=1e-12)


def test_pieces_that_move_rigidly_have_their_motion():
    result = made_result(SEED)
    of_body = result.fragment_of_body()
    moved, rotation, velocity, spin = moved_rigidly(result, of_body, np.random.default_rng(SEED))
    found, near = moved.fragments(), {"rel": 1e-9, "abs": 1e-9}
    assert vectors_of(found, "velocity") == pytest.approx(velocity, **near)
    assert vectors_of(found, "spin") == pytest.approx(spin, **near)
    # What is left in a fragment is vibration, and here there is none.
    rigid = (found["translation_J"] + found["rotation_J"]).to_numpy()
    assert rigid == pytest.approx(found["kinetic_J"].to_numpy(), rel=1e-12)
    centre, turns = rigid_motion(moved.model, moved.frames[-1], of_body)
    assert turns == pytest.approx(rotation, abs=1e-12)
    assert centre == pytest.approx(vectors_of(found, "centre"), abs=1e-15)


def test_sizes_of_a_cuboid_are_its_own():
    """The sieve takes its middle edge, whichever way it lies; the diameter is that of a ball."""
    flat = bar(0.4, 0.1, (4, 1, 1))
    flat = dataclasses.replace(flat, points=flat.points * [1.0, 1.0, 2.5])
    result = made_result(mesh=flat, share=0.0)
    found = result.fragments()
    sides = np.sort(np.ptp(result.model.mesh.points, axis=0))
    assert found["sieve_m"][0] == pytest.approx(sides[1], rel=1e-12)
    volume = sides.prod()
    assert np.pi / 6.0 * found["diameter_m"][0] ** 3 == pytest.approx(volume, rel=1e-12)


def test_bonds_that_break_later_still_join():
    result = made_result()
    counts = [len(result.fragments(k)) for k in range(len(result.frames))]
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] > 1


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
