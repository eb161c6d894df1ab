"""Files lose nothing: what is damaged is refused and left alone, what fails leaves the old file."""

import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem.kit import study
from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from taichi_dem.kit.files import output_folder, write_csv, write_text
from taichi_dem.mesh.files import write_mesh, write_vtu
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import assert_refused, steady

BAR = bar(0.2, 0.1, (2, 1, 1))
IDENTITY = {"version": "1", "mesh": "a cube"}
ARRAYS = {"field/a.b": np.arange(12.0).reshape(4, 3), "part/none": np.zeros((0, 2))}


@steady
@given(share=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
def test_a_checkpoint_that_is_changed_anywhere_is_refused(tmp_path_factory, share, bit, cut):
    """Its digest is of all bytes: also of dates, names, sums and unused room."""
    path = tmp_path_factory.mktemp("checkpoint") / "run.npz"
    write_checkpoint(path, IDENTITY, ARRAYS)
    content = bytearray(path.read_bytes())
    place = int(share * len(content))
    if cut:
        del content[place:]
    else:
        content[place] ^= 1 << bit
    path.write_bytes(bytes(content))
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))


@pytest.mark.parametrize("content", [b"", b"[]", b"3", b"\xff\xfe", b"[" * 100_000])
def test_a_kept_result_that_is_none_is_refused_and_left_alone(tmp_path, content):
    path = tmp_path / f"job-{study.digest((), ())}.json"
    path.write_bytes(content)
    assert_refused(lambda: study.cached(tmp_path, "job", (), (), dict), str(path), "delete it")
    assert path.read_bytes() == content


WRITERS = {
    "mesh": lambda path: write_mesh(path, BAR),
    "vtu": lambda path: write_vtu(path, BAR.points, BAR.tetrahedra, {}),
    "csv": lambda path: write_csv(path, {"a": [1.0], "b": [2.0]}),
    "text": lambda path: write_text(path, "x"),
    "checkpoint": lambda path: write_checkpoint(path, IDENTITY, ARRAYS),
    "folder": output_folder,
}


@pytest.mark.parametrize("what", WRITERS)
def test_a_place_that_cannot_be_written_to_is_refused_and_stays_as_it_is(tmp_path, what):
    (tmp_path / "folder" / "full").mkdir(parents=True)
    (tmp_path / "file").write_text("old")
    before = sorted(tmp_path.rglob("*"))
    places = ["file/below", "a\0b", "x" * 300]
    places += ["file"] if what == "folder" else ["folder", "none/below"]
    for place in [os.path.join(tmp_path, place) for place in places] + ["", None, 3]:
        assert_refused(lambda place=place: WRITERS[what](place))
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "old"
