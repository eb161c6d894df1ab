"""A page of a block holds what was recorded, to half a step of its quantisation."""

import base64
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from taichi_dem.kit.viewer import quantise
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import steady
from tests.made_result import made_result

MESH = bar(0.4, 0.1, (4, 1, 1))


def data_of(page):
    """Data of a page by name."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.text)
    return json.loads(found[1], parse_constant=no_number)


def no_number(text):
    """JSON has no infinity and no NaN: a browser refuses them."""
    raise AssertionError(text)


def unpacked(packed):
    """Array of what ``pack`` made."""
    kind = np.dtype(packed["kind"]).newbyteorder("<")
    return np.frombuffer(base64.b64decode(packed["data"], validate=True), kind)


def of_frames(packed):
    """Values of what ``quantise`` made, (frames, n), and half a step of each frame, (frames, 1)."""
    scale = np.array(packed["scale"])[:, None]
    return unpacked(packed).reshape(len(scale), -1) * scale, 0.5 * scale


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
    report = SimpleNamespace(outcome="implicit, 4e-05 s simulated, <10> of 30 bonds broken")
    slipped = {"slip": np.where(np.arange(MESH.body_count) % 2, 2e-5, np.nan)}
    result = replace(made_result(mesh=MESH, frames=5), report=report, acting_since=slipped)
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


def test_stresses_on_a_page_are_the_largest_principal_ones(shown):
    """In MPa, on a scale that has zero in its middle."""
    result, made = shown
    (mode,) = [one for one in data_of(made)["modes"] if one["name"] == "stress"]
    found, half = of_frames(mode["values"])
    largest = [1e-6 * np.linalg.eigvalsh(frame.stress)[:, 2] for frame in result.frames]
    assert (np.abs(found - largest) <= half * (1.0 + 1e-9)).all()
    assert mode["low"] == -mode["high"]


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


def test_a_page_asks_for_nothing_from_elsewhere(shown):
    _, made = shown
    # The name of the format of drawings is no address that anything is fetched from.
    text = made.text.replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|//cdn|@import|url\(", text)
    assert not re.search(r"<(link|script|img)[^>]*(src|href)=(?!\"data:)", text)
