"""Pages of blocks and dampers: what they hold, where they go, how a notebook shows them."""

import dataclasses
import html
import os
import re
import sys
import webbrowser

import numpy as np
import pytest

from ca_damper import Empty, Spheres
from ca_damper.plot import Box
from taichi_dem.kit.viewer import WebPage, page
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import LOCAL_FACES
from tests.bad_input.refusals import assert_names, assert_refused
from tests.notebook import Page
from tests.viewer.made import MESH, block, damper, data_of, of_frames, unpacked


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A result and its page."""
    result = block()
    return result, result.show(tmp_path_factory.mktemp("view") / "block.html")


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A film and its page."""
    film = damper()
    return film, film.show(tmp_path_factory.mktemp("view") / "damper.html")


@pytest.mark.parametrize("which", ["shown", "played"])
def test_a_page_asks_for_nothing_and_is_whole(request, which):
    _, made = request.getfixturevalue(which)
    # The name of the format of drawings is no address that anything is fetched from.
    text = made.text.replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?://|//cdn|@import|url\(", text)
    assert not re.search(r"<(link|script|img)[^>]*(src|href)=(?!\"data:)", text)
    assert "default-src 'none'" in text
    parsed = Page(re.sub(r"<(meta|link|input|path|!doctype)[^>]*>", "", text, flags=re.IGNORECASE))
    assert not parsed.open
    with open(made, encoding="utf-8") as file:
        assert file.read() == made.text


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
    for name, values in (("speed", "speed"), ("damage", "damage")):
        found, half = of_frames(modes[name]["values"])
        expected = [getattr(frame, values) for frame in result.frames]
        assert (np.abs(found - expected) <= half * (1.0 + 1e-9)).all()
    levels = unpacked(modes["level of the step"]["values"])
    assert np.array_equal(levels, np.concatenate([frame.level for frame in result.frames]))
    assert len(modes["level of the step"]["names"]) == levels.max() + 1
    since = unpacked(modes["since when: slip of a bond"]["values"])
    assert since == pytest.approx(1e6 * result.acting_since["slip"], nan_ok=True)
    for mode in modes.values():
        assert unpacked(mode["table"]).shape == (768,)
        assert mode["low"] < mode["high"] and re.search(r"\[.+\]|step", mode["label"])


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


def test_grains_on_a_page_are_those_of_the_film(played):
    film, made = played
    data = data_of(made)
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
    curves = data["curves"]
    assert [curve["name"] for curve in curves] == ["0: 3 particles", "1: 5 particles"]
    assert curves[1]["values"] == pytest.approx([1e3 * frame.x for frame in film.frames[1]])


def test_many_scenes_are_shown_in_part(tmp_path):
    made = damper(range(1, 9), 2).show(tmp_path / "view.html")
    assert len(data_of(made)["containers"]) == 6
    assert "Scenes 0, 1, 2, 3, 4, 5 of 8 shown." in made.text
    two = damper(range(1, 9), 2).show(tmp_path / "view.html", scenes=[7, 0])
    assert [one["title"] for one in data_of(two)["containers"]] == [
        "7: 8 particles",
        "0: 1 particle",
    ]


@pytest.mark.parametrize("filling", [Spheres(), Empty()])
def test_any_filling_is_drawn(tmp_path, filling):
    made = damper((0,), 2, filling, mount="base").show(tmp_path / "view.html")
    (one,) = data_of(made)["containers"]
    assert one["width"] == pytest.approx(1e3 * Spheres().width)


def test_a_notebook_shows_the_page_in_a_frame(shown):
    _, made = shown
    source = re.fullmatch(
        r'<iframe title="Viewer" .* srcdoc="([^"]*)"></iframe>', made._repr_html_()
    )
    assert html.unescape(source[1]) == made.text
    assert str(made) == os.fspath(made) == made.path and os.path.isabs(made.path)
    assert repr(made).startswith("<WebPage: ")


def test_text_of_a_run_is_no_markup(shown):
    _, made = shown
    assert "&lt;10&gt; of 30 bonds broken" in made.text


def test_a_page_without_a_name_is_a_file_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setattr(page.tempfile, "tempdir", str(tmp_path))
    first, second = block(1).show(), block(1).show()
    assert first.path != second.path and os.path.isfile(first) and os.path.isfile(second)


@pytest.mark.parametrize("change", ["none", "pipe", "CI", "test", "no display", "False"])
def test_a_browser_opens_only_on_a_desktop(monkeypatch, tmp_path, change):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: change != "pipe", raising=False)
    for name in ("CI", "PYTEST_CURRENT_TEST", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if change != "no display":
        monkeypatch.setenv("DISPLAY", ":0")
    if change in ("CI", "test"):
        monkeypatch.setenv({"CI": "CI", "test": "PYTEST_CURRENT_TEST"}[change], "1")
    monkeypatch.setattr(sys, "platform", "linux")
    wanted = False if change == "False" else None
    made = block(1).show(tmp_path / "view.html", open_browser=wanted)
    assert opened == ([(tmp_path / "view.html").as_uri()] if change == "none" else [])
    block(1).show(tmp_path / "view.html", open_browser=True)
    assert len(opened) == (2 if change == "none" else 1) and isinstance(made, WebPage)


def test_what_cannot_be_shown_is_refused_in_words(tmp_path):
    result, film = block(2), damper((2,), 2)
    for value in ("", 3, b"x", "a\0b"):
        assert_names(lambda value=value: result.show(value), "path", value)
    assert_refused(
        lambda: result.show(tmp_path / "none" / "view.html"), "cannot write", "no folder"
    )
    assert_refused(lambda: result.show(tmp_path), "cannot write", "directory")
    assert_names(lambda: result.show(tmp_path / "a.html", open_browser=1), "open_browser", 1)
    no_frames = dataclasses.replace(result, frames=())
    assert_refused(no_frames.show, "frames must be at least 1", "frames=20")
    assert_refused(dataclasses.replace(film, frames=()).show, "frame_every=20")
    assert_refused(lambda: film.show(scenes=[1]), "scenes must be a whole number from 0 to 0")
    many = damper(range(9), 1)
    assert_refused(lambda: many.show(scenes=range(7)), "scenes must be at most 6, got 7")
    assert not list(tmp_path.iterdir())


def test_frames_that_are_not_finite_are_left_out(tmp_path):
    result = block(3)
    bad = dataclasses.replace(result.frames[1], velocity=np.full((MESH.body_count, 3), np.inf))
    frames = (result.frames[0], bad, result.frames[2])
    made = dataclasses.replace(result, frames=frames).show(tmp_path / "view.html")
    assert len(data_of(made)["times"]) == 2
    assert "1 frame with infinite values left out." in made.text
