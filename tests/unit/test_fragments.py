"""Fragments: a partition of the bodies that conserves mass, momentum and energy.

Cracks by area, time and direction, and what the energy went into.
"""

import dataclasses

import numpy as np
import pytest

from taichi_dem.kit.fixed_order import length
from taichi_dem.mesh.tetrahedra import area_vectors, signed_volumes
from taichi_dem.output.cracks import strike_and_dip
from taichi_dem.output.fragments import fragment_of_body
from tests.made_result import made_result, moved_rigidly

SEED = 2


def vectors_of(fragments, name):
    """Three columns of a table as vectors (n, 3)."""
    return fragments.filter(regex=rf"^{name}_[xyz]_").to_numpy()


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
    moved, velocity, spin = moved_rigidly(result, of_body, np.random.default_rng(SEED))
    found, near = moved.fragments(), {"rel": 1e-9, "abs": 1e-9}
    assert vectors_of(found, "velocity") == pytest.approx(velocity, **near)
    assert vectors_of(found, "spin") == pytest.approx(spin, **near)
    # What is left in a fragment is vibration, and here there is none.
    rigid = (found["translation_J"] + found["rotation_J"]).to_numpy()
    assert rigid == pytest.approx(found["kinetic_J"].to_numpy(), rel=1e-12)


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
