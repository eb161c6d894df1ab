"""All blows of a step on one structure are resolved together: boxes at one place are one unit."""

import numpy as np
import pytest
import taichi as ti

from ca_damper import Automaton, Batch, Box, ModalStructure, SceneTable, excitation, shake_structure
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


def batch_on(structure, places, filling=None, particles=1, seeds=1):
    """A batch of one group without gravity, on a base that stands still."""
    grains = Automaton(rules="place", gravity=0.0) if filling is None else filling
    mount = ModalMount(structure, places)
    count = [particles] * len(places) + [0] * (mount.group - len(places))
    base = {"excitation": excitation.sines(1.0, 0.0, 1.0), "recorded_samples": 1}
    batch = Batch(grains, SceneTable(count, seeds, 1e-4, 1.0), structure=mount, **base)
    batch.start()
    return batch


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
def test_energy_never_grows_for_any_mass():
    """Grains of 0.01 to 2 M in one to eight boxes, no gravity, soft springs, two places.

    In the first trials all boxes are alike, so that all blows of a step come together. Energy is
    compared as in ``test_place.py``: after a step, to what the springs take up.
    """
    draw = np.random.default_rng(5)
    structure = ModalStructure.from_matrices([0.6 * MASS, 0.4 * MASS], 1e-6 * np.eye(2), 1e-6)
    for trial in range(12):
        places = [int(place) for place in draw.integers(0, 2, draw.integers(1, 9))]
        grains = Automaton(
            rules="place", gravity=0.0, particle_mass=10.0 ** draw.uniform(-2, 0.3) * MASS
        )
        count, alike = int(draw.integers(1, 13)), trial < 8
        scenes = len(places) + 2 - len(set(places))
        batch = batch_on(structure, places, grains, count, 1 if alike else np.arange(scenes) + 1)
        set_moving(batch, draw, alike)
        total = []
        for _ in range(100):
            total.append(energy(batch, structure))
            batch.advance(20)
        assert total[0] > 0.0
        assert np.diff(total).max() <= 1e-6 * total[0]
        assert total[-1] < 0.9 * total[0]


def set_moving(batch, draw, alike):
    """Give grains velocities across and up; alike: those of one grain number in all boxes."""
    cells = batch.device.cells
    grain = cells.kind.to_numpy() < 6
    for field in (cells.across, cells.speed):
        values = field.to_numpy()
        given = draw.normal(size=values.shape)
        values[grain] = (np.broadcast_to(given[0], values.shape) if alike else given)[grain]
        field.from_numpy(values)


def energy(batch, structure):
    """Of the grains of all boxes and of the modes."""
    now, places = batch.sample(), batch.modal.scene_places
    speed = [now["v"][places.index(k)] for k in range(structure.place_count)]
    return now["energy"].sum() + 0.5 * (structure.modal(np.array(speed)) ** 2).sum()
