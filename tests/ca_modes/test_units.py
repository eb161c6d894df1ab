"""Units on one structure: each group as if alone, boxes at one place as one, all blows together."""

import numpy as np
import pytest
import taichi as ti

from ca_damper import (
    Automaton,
    Batch,
    Box,
    RigidMass,
    SceneTable,
    Spheres,
    excitation,
    shake_structure,
)
from ca_damper.engine.mount import ModalMount
from ca_damper.errors import InputError
from ca_damper.filling import Blows
from tests.ca_modes.frames import frame, two_storeys

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


def test_grains_beyond_the_room_of_their_own_filling_are_refused():
    with pytest.raises(InputError, match=r"^particles must .* from 0 to 54, got 60"):
        shaken(Automaton(), Box(1, 60, filling=OTHER))


MASS = 0.1
ONE = Box(1, 1, seed=3)
NUMBERS = ti.types.ndarray(dtype=ti.f64, ndim=2)


def columns(share, boxes):
    """Columns of cells with a grain of a share of a mass each, driven at resonance for 3 s."""
    structure = two_storeys()
    grain = Automaton(columns=1, rows=7, particle_mass=share * MASS)
    sine = excitation.sines([structure.frequencies[0]], [3e-3], 3.0)
    return shake_structure(grain, structure, boxes, sine, seeds=1, progress=None)


@pytest.mark.parametrize(("count", "whole"), [(2, 0.1), (4, 0.8)])
def test_boxes_at_one_place_are_one_unit(count, whole):
    """To the bit, as halves and quarters add up without rounding."""
    unit, boxes = columns(whole, ONE), columns(whole / count, [ONE] * count)
    assert unit.force.any()
    assert np.array_equal(boxes.x, unit.x)
    assert np.array_equal(boxes.force.sum(axis=1), unit.force[:, 0])


@ti.kernel
def resolved(container: ti.template(), blows: NUMBERS, found: NUMBERS):
    """Velocity and share of every box; blows[s]: impulse, struck, rubbed, carried."""
    for _ in range(1):
        for s in range(blows.shape[0]):
            container.set_blows(s, Blows(blows[s, 0], blows[s, 1], blows[s, 2], blows[s, 3]))
        container.resolve(0)
        for s in range(blows.shape[0]):
            recoil = container.recoil_of(s)
            found[s, 0], found[s, 1] = recoil.velocity, recoil.share


def test_blows_at_several_places_act_on_the_mobility_of_the_structure():
    """(1 + S'(C + N) S) u = S' J for boxes with carried C, struck N and impulses J at places S."""
    structure, places = frame(2), [2, 0, 1, 2]
    batch = batch_on(structure, places)
    draw = np.random.default_rng(4)
    shapes = structure.shapes[places]
    for _ in range(50):
        blows = 10.0 ** draw.uniform(-2, 1, (4, 4)) * draw.integers(0, 2, (4, 4))
        blows[:, 0] *= draw.normal(size=4)
        blows[blows[:, 1] == 0.0, 0] = 0.0
        found = np.empty((4, 2))
        resolved(batch.engine.container, blows, found)
        impulse, struck, rubbed, carried = blows.T

        def mobility(masses):
            return shapes @ np.linalg.solve(np.eye(2) + shapes.T * masses @ shapes, shapes.T)

        wanted = mobility(carried + struck) @ impulse
        scale = np.abs(shapes).max() ** 2 * np.abs(impulse).sum()
        assert np.abs(found[:, 0] - wanted).max() <= 1e-12 * scale
        assert found[:, 1] == pytest.approx(np.abs(mobility(carried)) @ rubbed, rel=1e-9, abs=1e-12)


def batch_on(structure, places):
    """A batch of one group without gravity, on a base that stands still."""
    mount = ModalMount(structure, places)
    count = [1] * len(places) + [0] * (mount.group - len(places))
    base = {"excitation": excitation.sines(1.0, 0.0, 1.0), "recorded_samples": 1}
    grains = Automaton(gravity=0.0)
    batch = Batch(grains, SceneTable(count, 1, 1e-4, 1.0), structure=mount, **base)
    batch.start()
    return batch
