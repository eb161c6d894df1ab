"""What users give: refused in words, or taken; starts without overlap; codes of divergence."""

import math

import numpy as np
import pytest

from ca_damper import InputError
from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

DT = 2e-5
NAN = math.nan


@pytest.mark.parametrize(
    ("option", "value", "allowed"),
    [
        ("damping", "linear", "tsuji, printed"),
        ("search", "tree", "cells, all_pairs"),
        ("rotation", "yes", "True or False"),
        ("restitution", -0.1, r"\[0, 1\]"),
        ("restitution", 1.1, r"\[0, 1\]"),
        ("wall_restitution", NAN, r"\[0, 1\]"),
        ("restitution", 0.0, r"\[0.01, 1\]"),
        ("friction", -1.0, "zero or a positive"),
        ("wall_friction", NAN, "zero or a positive"),
        ("particle_mass", 0.0, "positive"),
        ("particle_mass", -1e-3, "positive"),
        ("young", 0.0, "positive"),
        ("wall_young", math.inf, "positive"),
        ("poisson", 0.6, "up to 0.5"),
        ("wall_poisson", NAN, "up to 0.5"),
        ("diameter", 0.0, "positive"),
        ("reference_speed", 0.0, "positive"),
        ("gravity", NAN, "zero or a positive"),
        ("width", 5e-3, "at least the diameter"),
        ("height", NAN, "positive"),
        ("start", [(0.03, 0.002)], "off the walls"),
        ("start", [(0.03, NAN)], "off the walls"),
        ("start", [(0.03, 0.01), (0.03, 0.0155)], "overlap"),
        ("start", [(0.03, 0.01, 0.0)], "two coordinates"),
        ("start", "here", "two coordinates"),
    ],
)
def test_bad_options_are_named_with_what_is_allowed(option, value, allowed):
    with pytest.raises(InputError, match=allowed) as caught:
        Spheres(**{option: value})
    assert option in str(caught.value)


@pytest.mark.parametrize(
    ("particles", "dt", "name"),
    [(161, DT, "particles"), (-1, DT, "particles"), (1.5, DT, "particles"), (10, 0.0, "dt")]
    + [(10, dt, "dt") for dt in (-1e-5, NAN, math.inf)],
)
def test_bad_scenes_are_refused(particles, dt, name):
    with pytest.raises(InputError, match=name):
        Spheres().check(particles, dt)


def test_long_steps_are_not_refused_but_may_diverge():
    Spheres().check(160, 1e-3)


def test_number_of_spheres_must_be_that_of_the_places():
    filling = Spheres(start=[(0.03, 0.01), (0.03, 0.02)])
    filling.check(2, DT)
    with pytest.raises(InputError, match="particles must be 2"):
        filling.check(3, DT)


def test_full_box_holds_sixteen_rows_of_ten():
    assert Spheres().lattice == (10, 16)
    assert Spheres().capacity == 160
    assert Spheres(diameter=12e-3).capacity == 40


def test_options_are_plain_values():
    assert Spheres() == Spheres()
    assert hash(Spheres(start=[[0.03, 0.01]])) == hash(Spheres(start=[(0.03, 0.01)]))


def test_random_starts_fill_the_box_without_overlap():
    counts = np.arange(161)
    rig = Rig(Spheres(), counts, DT, seed=counts + 1)
    for place, count in zip(rig.states()[0], counts):
        place = place[:count]
        room = np.minimum(place, [0.06, 0.096] - place)
        # Rows that fill the box touch; places are sums of a few roundings of 0.1 m.
        assert np.all(room > 3e-3 - 1e-16)
        gaps = np.linalg.norm(place[:, None] - place[None, :], axis=2)
        assert np.all(gaps[np.triu_indices(count, 1)] > 6e-3 - 1e-16)


def test_random_starts_use_the_whole_box():
    # Means of 200 seeds x 20 sites scatter by the box / sqrt(12 x 4000): 4 sigma.
    rig = Rig(Spheres(), 20, DT, seed=np.arange(200))
    place = rig.states()[0][:, :20].reshape(-1, 2)
    size = np.array([0.06, 0.096])
    assert np.all(np.abs(place.mean(axis=0) - 0.5 * size) < 4 * size / np.sqrt(12 * 4000))
    assert np.all(np.ptp(place, axis=0) > 0.95 * (size - 6e-3))


def test_given_places_are_taken_and_lie_in_the_container():
    places = [(0.01, 0.02), (0.03, 0.05)]
    rig = Rig(Spheres(start=places), 2, DT, seed=[1, 2])
    assert rig.states()[0][1, :2] == pytest.approx(np.array(places), abs=1e-17)


def test_spheres_board_a_moving_container():
    # At the first step the container passes x = 0 at A w; spheres at rest in it move with it.
    places = [(0.03, 0.05)]
    rig = Rig(Spheres(gravity=0.0, start=places), 1, DT, frequency=6.0, amplitude=0.02).run(1)
    speed = 0.02 * 2 * math.pi * 6.0
    assert rig.state()[1][0] == pytest.approx([0.0, speed], rel=1e-15)
    assert rig.state()[0][0] == pytest.approx(places[0], abs=1e-15)


def test_change_of_step_keeps_places_and_the_motion():
    # A sphere in free flight: the leapfrog is exact but for g dt^2 / 8 of its start, so the fall
    # shows any place lost at the change. Velocity 1 m/s times half a step would be 1e-5 m.
    rig = Rig(Spheres(start=[(0.03, 0.09)]), 1, DT)
    rig.run(1000)
    place, velocity = rig.state()
    rig.drive(6.0, 2.5e-6)
    rig.run(1)
    moved, now = rig.state()
    assert moved[0] - place[0] == pytest.approx(velocity[0] * 2.5e-6, abs=9.8 * DT**2)
    assert now[0, 1] - velocity[0, 1] == pytest.approx(-9.8 * 2.5e-6, rel=1e-9)


UNWELL = (
    ("velocity", [NAN, 0.0], "finite"),
    ("velocity", [0.0, math.inf], "finite"),
    ("velocity", [0.0, 400.0], "radius in a step"),
    ("position", [0.031, 0.05], "outside"),
    ("position", [0.0, -0.001], "outside"),
    ("position", [0.01, 0.052], "overlap"),
    ("position", [0.0, 0.01], ""),
)


@pytest.mark.parametrize("search", ["cells", "all_pairs"])
def test_divergence_code_finds(search):
    # One change a scene, to the first of two spheres so soft that they stay where they are put;
    # the second is at (0.01, 0.05) from the middle of the floor.
    soft = {"young": 1e3, "wall_young": 1e3}
    filling = Spheres(start=[(0.02, 0.05), (0.04, 0.05)], search=search, **soft)
    rig = Rig(filling, [2] * len(UNWELL), DT).run(1)
    bodies = rig.device.bodies
    for s, (name, value, _) in enumerate(UNWELL):
        assert rig.divergence_code(s) == 0
        getattr(bodies, name)[s * bodies.stride] = value
    # Spheres that were put elsewhere are not in the list of pairs; a change of dt makes it anew.
    rig.drive(6.0, 0.5 * DT)
    rig.run(1)
    for s, (_, _, word) in enumerate(UNWELL):
        code = rig.divergence_code(s)
        assert (code != 0) == bool(word)
        if word:
            words, dt = filling.divergence(code, 2, DT)
            assert word in words
            assert 0.0 < dt <= 0.5 * DT


def test_a_list_that_is_full_counts_as_overlap(monkeypatch):
    # A full box has nearly two pairs a sphere that touch, so a list of one a sphere runs full.
    assert Rig(Spheres(), 160, DT).run(1).divergence_code() == 0
    monkeypatch.setattr("ca_damper.spheres.search._PAIRS_PER_SPHERE", 1)
    words, _ = Spheres().divergence(Rig(Spheres(), 160, DT).run(1).divergence_code(), 160, DT)
    assert "overlap" in words


def test_safe_step_is_near_the_papers():
    # A fifth of a contact of two spheres at the speed of a fall through the box; the paper's 2e-5.
    assert Spheres().safe_step() == pytest.approx(2e-5, rel=0.1)
    # Softer spheres stay in touch for longer: like E^(-2/5).
    ratio = Spheres(young=0.5e7).safe_step() / Spheres().safe_step()
    assert ratio == pytest.approx(100**0.4, rel=0.05)
