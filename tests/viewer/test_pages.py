"""A page of a block or a damper holds what was recorded, to half a step of its quantisation."""

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ca_damper.plot import Box
from taichi_dem.kit.viewer import quantise
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
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


def test_colours_on_a_page_are_those_of_the_frames(shown):
    result, made = shown
    modes = {mode["name"]: mode for mode in data_of(made)["modes"]}
    for name in ("speed", "damage"):
        found, half = of_frames(modes[name]["values"])
        expected = [getattr(frame, name) for frame in result.frames]
        assert (np.abs(found - expected) <= half * (1.0 + 1e-9)).all()
    levels = unpacked(modes["level of the step"]["values"])
    assert np.array_equal(levels, np.concatenate([frame.level for frame in result.frames]))
    since = unpacked(modes["since when: slip of a bond"]["values"])
    assert since == pytest.approx(1e6 * result.acting_since["slip"], nan_ok=True)


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


def test_edges_are_cracked_from_the_first_break_at_them(shown):
    """By looking at each bond for each edge."""
    result, made = shown
    data, top = data_of(made), result.model.topology
    body, face = unpacked(data["faceBody"]), unpacked(data["faceLocal"])
    found = unpacked(data["edgeBreaks"]).reshape(-1, 3)
    for row, corners in enumerate(MESH.tetrahedra[body[:, None], LOCAL_FACES[face]]):
        for k in range(3):
            edge = set(np.delete(corners, k))
            at = [edge <= set(vertices) for vertices in top.vertices]
            expected = np.fmin.reduce(result.broken_time[at], initial=np.nan)
            assert found[row, k] == pytest.approx(1e6 * expected if expected > 0.0 else 3e38)


def test_bodies_that_never_show_are_left_out(tmp_path):
    mesh = bar(0.3, 0.3, (3, 3, 3))
    made = data_of(block(2, mesh, breaks=False).show(tmp_path / "view.html"))
    count = len(unpacked(made["centres"])) // 3
    assert count < mesh.body_count
    assert set(unpacked(made["faceBody"])) == set(range(count))
    assert len(unpacked(made["displacement"])) == 3 * count * len(made["times"])


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


def test_frames_that_are_not_finite_are_left_out_and_it_is_said(tmp_path):
    """JSON has no infinity: a browser would show nothing at all."""
    result = block(3)
    bad = dataclasses.replace(result.frames[1], velocity=np.full((MESH.body_count, 3), np.inf))
    frames = (result.frames[0], bad, result.frames[2])
    made = dataclasses.replace(result, frames=frames).show(tmp_path / "view.html")
    assert len(data_of(made)["times"]) == 2
    assert "1 frame with infinite values left out." in made.text
