"""All blows of a step on one structure are resolved together: boxes at one place are one unit."""

import numpy as np
import pytest
import taichi as ti

from ca_damper import Automaton, Batch, Box, SceneTable, excitation, shake_structure
from ca_damper.engine.modal_mount import ModalMount
from ca_damper.filling import Blows
from tests.ca_modes.frames import frame, two_storeys

MASS = 0.1
ONE = Box(1, 1, seed=3)
NUMBERS = ti.types.ndarray(dtype=ti.f64, ndim=2)


def shaken(share, boxes):
    """Columns of cells with a grain of a share of a mass each, driven at resonance for 3 s."""
    structure = two_storeys()
    grain = Automaton(rules="place", columns=1, rows=7, particle_mass=share * MASS)
    sine = excitation.sines([structure.frequencies[0]], [3e-3], 3.0)
    return shake_structure(grain, structure, boxes, sine, seeds=1, progress=None)


@pytest.mark.parametrize(("count", "whole"), [(2, 0.1), (4, 0.8)])
def test_boxes_at_one_place_are_one_unit(count, whole):
    """To the bit, as halves and quarters add up without rounding."""
    unit, boxes = shaken(whole, ONE), shaken(whole / count, [ONE] * count)
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
    grains = Automaton(rules="place", gravity=0.0)
    batch = Batch(grains, SceneTable(count, 1, 1e-4, 1.0), structure=mount, **base)
    batch.start()
    return batch
