"""Fragments: a partition of the bodies that conserves mass, momentum and energy."""

import dataclasses

import numpy as np
import pytest

from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import signed_volumes
from taichi_dem.output.fragments import fragment_of_body, rigid_motion
from tests.made_result import made_result, moved_rigidly

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
    momentum = found["mass_kg"] @ found.vectors("velocity")
    assert momentum == pytest.approx(model.body_mass @ frame.velocity, **close)
    spins = np.linalg.inv(frame.rotation @ model.body_inertia @ np.swapaxes(frame.rotation, 1, 2))
    turning = np.einsum("ni,nij,nj->n", frame.angular_momentum, spins, frame.angular_momentum)
    energy = 0.5 * (model.body_mass * frame.speed**2 + turning)
    assert found["kinetic_J"].sum() == pytest.approx(energy.sum(), rel=1e-12)


def test_pieces_that_move_rigidly_have_their_motion():
    result = made_result(SEED)
    of_body = result.fragments().of_body
    moved, rotation, velocity, spin = moved_rigidly(result, of_body, np.random.default_rng(SEED))
    found, near = moved.fragments(), {"rel": 1e-9, "abs": 1e-9}
    assert found.vectors("velocity") == pytest.approx(velocity, **near)
    assert found.vectors("spin") == pytest.approx(spin, **near)
    # What is left in a fragment is vibration, and here there is none.
    rigid = found["translation_J"] + found["rotation_J"]
    assert rigid == pytest.approx(found["kinetic_J"], rel=1e-12)
    centre, turns = rigid_motion(moved.model, moved.frames[-1], of_body)
    assert turns == pytest.approx(rotation, abs=1e-12)
    assert centre == pytest.approx(found.vectors("centre"), abs=1e-15)


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
    counts = [result.fragments(k).row_count for k in range(len(result.frames))]
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] > 1
