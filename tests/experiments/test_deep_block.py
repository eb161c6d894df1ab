"""Parts of ``blast_block.py``: the mesh without Gmsh, sections of cracks, peaks and their fall."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    Scene,
    effects,
    read_mesh,
    simulate,
)
from taichi_dem.engine.model import Model
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.mesh.shapes import bar, mirrored_copies
from taichi_dem.mesh.topology import topology_of
from taichi_dem.output.attenuation import Attenuation
from taichi_dem.plot.deep import crossings


@pytest.fixture(scope="module")
def block(script):
    """The experiment's module."""
    return script("blast_block")


@pytest.mark.parametrize("copies", [1, 2, 3])
def test_mirrored_copies_are_one_block(copies):
    """All bonds of each copy and one for every face of a seam; nothing stands alone between."""
    flat = read_mesh(PAPER_BLOCK)
    deep = mirrored_copies(flat, copies)
    bonds = [topology_of(mesh).bond_count for mesh in (flat, deep)]
    seams = sum(len(flat.groups[("front", "back")[k % 2]]) for k in range(copies - 1))
    assert bonds[1] == copies * bonds[0] + seams
    assert deep.body_count == copies * flat.body_count
    assert deep.points.max(axis=0)[2] == pytest.approx(0.2 * copies, rel=1e-12)
    # Points are rounded to 1e-12 m: an area of 2 m by 3 m then moves by some 1e-11 m2.
    assert volumes(deep).sum() == pytest.approx(copies * volumes(flat).sum(), abs=1e-10)
    assert group_area(deep, "hole") == pytest.approx(copies * group_area(flat, "hole"), abs=1e-10)
    for name in ("back", "front"):
        assert group_area(deep, name) == pytest.approx(group_area(flat, name), abs=1e-10)
    assert not [note for note in deep.notes if "turned" not in note]


def test_sizes_of_elements_follow_the_measured_counts(block):
    scale_for = block.scale_for
    for scale, count in zip(block.SCALES, block.COUNTS):
        assert scale_for(count) == pytest.approx(scale, rel=1e-12)
    assert 0.585 < scale_for(50000) < 1.0 and scale_for(200000) < 0.585 and scale_for(3000) > 1.9


def test_section_cuts_triangles_where_the_plane_is():
    """A triangle with one corner at z = 2 and two at 0 and 1, cut at 1.5 and at 0.5."""
    triangle = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [0.0, 4.0, 2.0]]])
    for place, ends in (
        (1.5, [(2.0, 2.0, 1.5), (0.0, 3.0, 1.5)]),
        (0.5, [(2.0, 0.0, 0.5), (0.0, 1.0, 0.5)]),
    ):
        lines, which = crossings(triangle, 2, place)
        assert which.tolist() == [0]
        assert {tuple(end) for end in lines[0].tolist()} == set(ends)
    for place in (-0.1, 2.1):
        assert len(crossings(triangle, 2, place)[0]) == 0


def test_power_law_of_inner_bodies_is_found():
    """Speeds of 3 r^-1.5, those of the others ten times as large: least squares to round-off."""
    distance = np.linspace(2.0, 60.0, 200)
    inner = distance < 32.0
    speed = 3.0 * distance**-1.5 * np.where(inner, 1.0, 10.0)
    law = Attenuation(distance, speed, inner).power_law(4.0)
    assert law == pytest.approx((-1.5, 3.0), rel=1e-10)
    assert np.isnan(Attenuation(distance, speed, distance < 5.0).power_law(4.0)).all()


def test_distances_are_those_from_the_axis_of_the_hole():
    """The paper's hole lies at (1.6, 1.0) in a block of 2 m by 2 m by 0.2 m."""
    model = Model(read_mesh(PAPER_BLOCK), CONCRETE, [])
    made = Attenuation.of(model, np.ones(model.body_count), 0.025)
    x, y, z = model.centre.T
    away = np.hypot(x - 1.6, y - 1.0)
    assert made.distance == pytest.approx(away / 0.025, rel=1e-9)
    sides = np.min([x, 2.0 - x, y, 2.0 - y, z, 0.2 - z], axis=0)
    assert np.array_equal(made.inner, away < sides) and made.inner.any()


@pytest.mark.slow
def test_peaks_are_the_largest_of_all_samples():
    """The largest peak of all bodies is the largest of all rows; nobody is above it at the end."""
    gas = effects.GasPressure(group="left", peak=1e6, rise=2e-5)
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [effects.BondDamping(), gas])
    result = simulate(scene, method=ImplicitDashpots(1e-6), until=2e-4, samples=50, frames=50)
    assert result.peak_speed.shape == (24,)
    assert result.peak_speed.max() == result.history["largest_speed_m_s"].max()
    frames = np.max([frame.speed for frame in result.frames], axis=0)
    assert np.array_equal(result.peak_speed, frames)
    assert (result.peak_speed > result.frames[-1].speed).any()
