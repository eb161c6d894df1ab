"""A page of a block or a damper holds what was recorded, to half a step of its quantisation."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ca_damper.plot import Box
from taichi_dem.kit.viewer import quantise
from tests.bad_input.refusals import steady
from tests.viewer.made import MESH, block, damper, data_of, of_frames, unpacked


@steady
@given(arrays(float, (3, 4), elements=st.floats(-1e30, 1e30)))
def test_quantised_values_differ_by_at_most_half_a_step(values):
    found, half = of_frames(quantise(list(values)))
    # And by the rounding of the division and the product.
    assert (np.abs(found - values) <= half * (1.0 + 1e-11)).all()
    largest = np.abs(values).max(axis=1)
    assert half[:, 0] * 2.0 == pytest.approx(largest / 32767, abs=1e-320)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A result and its page."""
    result = block()
    return result, result.show(tmp_path_factory.mktemp("view") / "block.html")


def test_motion_on_a_page_is_that_of_the_frames(shown):
    result, made = shown
    data, frames = data_of(made), result.frames
    assert data["times"] == pytest.approx([1e6 * frame.time_s for frame in frames])
    assert data["unit"] == "µs"
    centre = unpacked(data["centres"]).reshape(-1, 3)
    moved, half = of_frames(data["displacement"])
    place = centre + moved.reshape(len(frames), -1, 3)
    # Rest positions have 24 bits.
    bound = half[:, :, None] * (1.0 + 1e-9) + 2.0**-24 * np.abs(centre).max()
    assert (np.abs(place - [frame.position for frame in frames]) <= bound).all()


def test_faces_show_from_when_their_bond_breaks(shown):
    result, made = shown
    data, top = data_of(made), result.model.topology
    body, face = unpacked(data["faceBody"]), unpacked(data["faceLocal"])
    breaks = unpacked(data["faceBreaks"])
    broken = np.flatnonzero(np.isfinite(result.broken_time))
    assert len(body) == top.outer_count + 2 * len(broken)
    assert (breaks < 0.0).sum() == top.outer_count
    # Every body of the bar has a face that shows: numbers on the page are those of the mesh.
    points = unpacked(data["points"]).reshape(-1, 3)[unpacked(data["tetrahedra"]).reshape(-1, 4)]
    assert points == pytest.approx(MESH.points[MESH.tetrahedra], abs=1e-7)
    for bond in broken:
        own = np.isclose(breaks, 1e6 * result.broken_time[bond])
        assert set(zip(body[own], face[own])) == {
            (top.master[bond], top.master_face[bond]),
            (top.slave[bond], top.slave_face[bond]),
        }


def test_grains_on_a_page_are_those_of_the_film(tmp_path):
    film = damper()
    data = data_of(film.show(tmp_path / "damper.html"))
    assert data["times"] == pytest.approx([1e3 * frame.time_s for frame in film.frames[0]])
    for one, frames in zip(data["containers"], film.frames):
        place, half = of_frames(one["position"])
        expected = np.array([1e3 * frame.position for frame in frames]).reshape(len(frames), -1)
        assert (np.abs(place - expected) <= half * (1.0 + 1e-9)).all()
        speed, half = of_frames(one["speed"])
        expected = [frame.velocity[:, 1] for frame in frames]
        assert (np.abs(speed - expected) <= half * (1.0 + 1e-9)).all()
        assert one["base"] == pytest.approx([1e3 * frame.y for frame in frames])
        assert one["outline"] == pytest.approx(1e3 * Box.of(film.filling).outline())
    assert data["curves"][1]["values"] == pytest.approx([1e3 * f.x for f in film.frames[1]])


def test_a_page_asks_for_nothing_from_elsewhere(shown):
    _, made = shown
    # The name of the format of drawings is no address that anything is fetched from.
    text = made.text.replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|//cdn|@import|url\(", text)
    assert not re.search(r"<(link|script|img)[^>]*(src|href)=(?!\"data:)", text)
