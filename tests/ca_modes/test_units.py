"""Units on one structure: each box with a filling of its own, each group as if it were alone."""

import numpy as np
import pytest

from ca_damper import Automaton, Box, RigidMass, Spheres, excitation, shake_structure
from ca_damper.errors import InputError
from tests.ca_modes.frames import two_storeys

OTHER = Automaton(columns=6, rows=9, width=4e-3, particle_mass=0.5e-3, wall_restitution=0.5)
HEAVY = Automaton(columns=14, rows=20, particle_mass=0.02e-3, gravity=9.0)


def shaken(filling, boxes, amplitude=6e-3, **options):
    sine = excitation.sines([two_storeys().frequencies[0]], [amplitude], 0.6)
    job = {"seeds": 2, "progress": None, **options}
    return shake_structure(filling, two_storeys(), boxes, sine, **job)


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("x", "force"))


def test_a_group_is_the_same_alone_and_among_others():
    boxes = [Box(1, 20), Box(0, 7)]
    together = shaken(Automaton(), boxes, seeds=[5, 6, 7])
    for j, seed in enumerate(together.seeds):
        alone = shaken(Automaton(), boxes, seeds=[seed])
        for name in ("x", "v", "force", "rms", "peak"):
            assert np.array_equal(getattr(alone, name)[..., 0], getattr(together, name)[..., j])
    assert not np.array_equal(together.x[..., 0], together.x[..., 1])


@pytest.mark.parametrize("place", [0, 1])
def test_a_box_with_its_own_filling_is_that_of_a_run_of_this_filling(place):
    own = shaken(Automaton(), Box(place, 20, filling=OTHER))
    assert own.force.any() and same(own, shaken(OTHER, Box(place, 20)))
    both = [Box(1, 20, filling=OTHER), Box(0, 7, filling=OTHER)]
    assert same(shaken(Automaton(), both), shaken(OTHER, [Box(1, 20), Box(0, 7)]))


@pytest.mark.parametrize(
    "fillings",
    [(Automaton(), OTHER, HEAVY), (Spheres(), Spheres(diameter=4e-3, particle_mass=1e-3))],
    ids=["place", "spheres"],
)
def test_momentum_of_each_of_several_sizes_at_one_place_closes(fillings):
    boxes = [Box(1, 20, seed=k, filling=one) for k, one in enumerate(fillings)]
    made = shaken(fillings[0], boxes)
    assert np.abs(made.force).max(axis=(0, 2)).min() > 0.01
    assert made.report.momentum_error < 1e-9


def test_fixed_grains_of_several_sizes_load_each_place_by_their_own_mass_and_gravity():
    """At the beginning the place falls by a = -m g / (M + m), and the grains press by m (g + a)."""
    fixed = [RigidMass(1e-3, gravity=4.0), RigidMass(0.1e-3, gravity=0.0)]
    boxes = [Box(1, 30, filling=fixed[0]), Box(0, 100, filling=fixed[1])]
    made = shaken(RigidMass(), boxes, amplitude=0.0, seeds=1)
    assert made.force[1, 0, 0] == pytest.approx(-0.12 * 0.15 / (0.15 + 0.03), rel=1e-3)
    assert abs(made.force[1, 1, 0]) < 1e-4 and made.report.momentum_error < 1e-9


def test_a_filling_of_another_kind_is_refused_in_a_sentence():
    with pytest.raises(InputError, match=r"^filling must be of one class, with the same rules"):
        shaken(Automaton(), [Box(1, 3), Box(0, 3, filling=Spheres())])
    with pytest.raises(InputError, match=r"^filling must be one such as Automaton"):
        Box(1, 3, filling=3)
    with pytest.raises(InputError, match=r"^particles must .* from 0 to 54, got 60"):
        shaken(Automaton(), Box(1, 60, filling=OTHER))
