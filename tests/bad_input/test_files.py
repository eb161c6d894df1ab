"""Files that are cut off, of another kind, empty, folders, pipes; and files being written."""

import hashlib
import itertools
import json
import os
import random
import tracemalloc
import warnings
import zipfile

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import taichi_dem.mesh.files as mesh_files
from taichi_dem import PAPER_BLOCK, InputError, read_mesh
from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from taichi_dem.kit.files import output_folder, write_csv, write_text
from taichi_dem.mesh.files import write_mesh, write_vtu
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import Endless, assert_refused, ends_within, steady
from tests.scenes import ROOT

BAR = bar(0.2, 0.1, (2, 1, 1))
IDENTITY = {"version": "1", "mesh": "a cube"}
ARRAYS = {"field/a.b": np.arange(12.0).reshape(4, 3), "part/none": np.zeros((0, 2))}
#: Mesh formats of meshio that can be written here: ending and name.
FORMATS = {
    ".vtk": "vtk",
    ".inp": "abaqus",
    ".bdf": "nastran",
    ".mesh": "medit",
    ".vol": "netgen",
    ".xml": "dolfin-xml",
    ".avs": "avsucd",
    ".post": "permas",
    ".node": "tetgen",
    ".dat": "tecplot",
    ".off": "off",
    ".ply": "ply",
}


@pytest.fixture(scope="module")
def contents(tmp_path_factory):
    """Bytes of a good mesh file by ending; Gmsh of both versions and VTU among them."""
    folder, made = tmp_path_factory.mktemp("meshes"), {}
    write_mesh(folder / "mesh.msh", BAR)
    write_vtu(folder / "mesh.vtu", BAR.points, BAR.tetrahedra)
    faces = np.vstack(list(BAR.groups.values()))
    sides = np.repeat(np.arange(len(BAR.groups)), [len(f) for f in BAR.groups.values()])
    content = meshio.Mesh(
        BAR.points,
        [("tetra", BAR.tetrahedra), ("triangle", faces)],
        cell_data={"side": [np.zeros(BAR.body_count, int), sides]},
    )
    for ending, name in FORMATS.items():
        content.write(folder / f"mesh{ending}", file_format=name)
    for path in folder.glob("mesh.*"):
        made[path.suffix] = path.read_bytes()
    with open(PAPER_BLOCK, "rb") as file:
        made["4.1.msh"] = file.read()
    return made


def damaged(content, rng):
    """The content cut off at several places, with bytes changed, and with numbers out of range."""
    for share in (0.0, 0.02, 0.3, 0.6, 0.9, 0.99):
        yield content[: int(share * len(content))]
    for _ in range(4):
        changed = bytearray(content)
        changed[rng.randrange(len(changed))] = rng.randrange(256)
        yield bytes(changed)
    for number in (b"99999999999", b"-1", b"1e999", b"nan", b"4294967297"):
        words = content.split(b" ")
        words[rng.randrange(len(words))] = number
        yield b" ".join(words)


@pytest.mark.filterwarnings("error")
def test_a_damaged_mesh_is_read_as_a_mesh_or_refused(contents, tmp_path, monkeypatch, capsys):
    """Damage need not show: a comment may be cut off. What is read is whole and finite."""
    monkeypatch.setattr(mesh_files, "_PATIENCE_S", 0.3)
    rng, refused, read = random.Random(6), 0, 0
    for ending, content in sorted(contents.items()):
        path = tmp_path / f"damaged{ending[-4:] if ending == '4.1.msh' else ending}"
        for harmed in damaged(content, rng):
            path.write_bytes(harmed)
            try:
                with ends_within(20.0), warnings.catch_warnings():
                    # Damage may give one body another material's number, of which it is told.
                    warnings.simplefilter("ignore", UserWarning)
                    mesh = read_mesh(path)
            except InputError as error:
                assert str(path) in str(error) and "\n" not in str(error)
                refused += 1
            else:
                assert np.isfinite(mesh.points).all() and mesh.body_count > 0
                read += 1
        path.unlink()
    assert refused > 100
    assert capsys.readouterr() == ("", "")


def test_point_numbers_beyond_32_bits_do_not_wrap_around(tmp_path, monkeypatch):
    far = meshio.Mesh(BAR.points, [("tetra", BAR.tetrahedra.astype(np.int64) + 2**32)])
    monkeypatch.setattr(meshio, "read", lambda path: far)
    (tmp_path / "mesh.vtu").write_text("x")
    assert_refused(lambda: read_mesh(tmp_path / "mesh.vtu"), "point numbers must lie in")


def test_a_reader_that_finds_no_end_is_stopped(contents, tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_files, "_PATIENCE_S", 0.2)
    (tmp_path / "mesh.dat").write_bytes(contents[".dat"][: len(contents[".dat"]) // 2])
    with ends_within(10.0):
        assert_refused(lambda: read_mesh(tmp_path / "mesh.dat"), "cannot be read", "no end in 0.2")


def test_calls_that_take_too_long_are_noticed_by_these_tests():
    with pytest.raises(Endless), ends_within(0.05):
        while True:
            pass


def harm_checkpoint(path, how):
    """Do to a checkpoint what its name says."""
    content = path.read_bytes()
    path.unlink()
    if how == "folder":
        path.mkdir()
    elif how == "pipe":
        os.mkfifo(path)
    elif how == "loop":
        path.symlink_to(path)
    elif how == "text":
        path.write_text("checkpoint")
    elif how == "mesh":
        write_mesh(path, BAR)
    elif how == "json":
        path.write_text(json.dumps({"about": {"format": 1}}))
    elif how == "npy":
        with open(path, "wb") as file:
            np.save(file, np.zeros(3))
    elif how == "stranger":
        np.savez(path, about=np.array("[1]"))
    elif how == "half about":
        np.savez(path, about=np.array('{"format": 1}'))
    elif how == "pickle":
        np.savez(path, about=np.array([{"format": 1}], dtype=object))
    elif how == "twice":
        path.write_bytes(content + content[:50])
    elif how == "not readable":
        path.write_bytes(content)
        path.chmod(0)


HARMS = (
    "absent",
    "folder",
    "pipe",
    "loop",
    "text",
    "mesh",
    "json",
    "npy",
    "stranger",
    "half about",
)


@pytest.mark.parametrize("how", [*HARMS, "pickle", "not readable"])
def test_what_is_no_checkpoint_is_refused(tmp_path, how):
    if how == "pipe" and not hasattr(os, "mkfifo"):
        pytest.skip("this system has no pipes with names")
    if how == "not readable" and (not hasattr(os, "geteuid") or os.geteuid() == 0):
        pytest.skip("an administrator may read everything")
    path = tmp_path / "run.npz"
    write_checkpoint(path, IDENTITY, ARRAYS)
    harm_checkpoint(path, how)
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))


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


def resealed(content):
    """A changed content with a digest that fits, as only somebody who wants to can make it."""
    return content[:-64] + hashlib.sha256(content[:-64]).hexdigest().encode()


@steady
@given(data=st.data())
def test_a_checkpoint_made_to_deceive_is_read_as_arrays_or_refused(tmp_path_factory, data):
    """Bytes changed at some places under a fitting digest: sizes and types are not believed."""
    path = tmp_path_factory.mktemp("checkpoint") / "run.npz"
    write_checkpoint(path, IDENTITY, ARRAYS)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 65))] = data.draw(st.integers(0, 255))
    path.write_bytes(resealed(bytes(content)))
    tracemalloc.start()
    try:
        found = read_checkpoint(path, IDENTITY)
    except InputError as error:
        assert str(path) in str(error) and "\n" not in str(error)
    else:
        assert all(array.dtype.kind in "?biufcU" for array in found.values())
    finally:
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert most < 50 * len(content) + 1_000_000


HEADERS = {
    "huge shape": "{'descr': '<f8', 'fortran_order': False, 'shape': (281474976710000,)}",
    "negative": "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (1,)}",
    "nested type": "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,)}",
    "nested": "(" * 3000,
    "bytes": "b'" + "x" * 2000,
    "no shape": "{'descr': '<f8'}",
    "truth": "{'descr': '<f8', 'fortran_order': False, 'shape': (True,)}",
    "longer": "{'descr': '<f8', 'fortran_order': False, 'shape': (3,)}",
    "code": "__import__('os').abort()",
    "no type": "{'descr': 'hello', 'fortran_order': False, 'shape': (1,)}",
    "long": "{'descr': '<f8', 'fortran_order': False, 'shape': (" + "1," * 40 + ")}",
}


@pytest.mark.parametrize("name", HEADERS)
def test_an_announced_array_is_checked_before_it_is_read(tmp_path, name):
    path, text = tmp_path / "run.npz", HEADERS[name].encode()
    array = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(8)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("field/a.npy", array)
        archive.comment = b"sha256 " + b"0" * 64
    path.write_bytes(resealed(path.read_bytes()))
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))


@pytest.mark.parametrize("way", ["bomb", "two of a name", "another ending"])
def test_an_archive_of_another_make_is_refused(tmp_path, way):
    """Compressed members may be any size; two of a name leave open which is meant."""
    path = tmp_path / "run.npz"
    kind = zipfile.ZIP_DEFLATED if way == "bomb" else zipfile.ZIP_STORED
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w", kind) as archive:
        warnings.simplefilter("ignore")
        for _ in range(2):
            name = "field/a" if way == "another ending" else "field/a.npy"
            archive.writestr(name, bytes(10**6))
        archive.comment = b"sha256 " + b"0" * 64
    path.write_bytes(resealed(path.read_bytes()))
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"null", b"3", b'"x"', b"\xff\xfe", b"[" * 100_000, b"\0" * 9]
)
def test_a_kept_result_that_is_none_is_refused_and_left_alone(tmp_path, monkeypatch, content):
    monkeypatch.syspath_prepend(os.path.join(ROOT, "experiments"))
    from taichi_dem.kit import study
    from taichi_dem.kit.study.results_page import read_json

    path = tmp_path / f"job-{study.digest((), ())}.json"
    path.write_bytes(content)
    call = lambda: study.cached(tmp_path, "job", (), (), dict)  # noqa: E731
    assert_refused(call, str(path), "delete it")
    assert path.read_bytes() == content
    assert read_json(path) == {}


WRITERS = {
    "mesh": lambda path: write_mesh(path, BAR),
    "vtu": lambda path: write_vtu(path, BAR.points, BAR.tetrahedra),
    "csv": lambda path: write_csv(path, {"a": [1.0], "b": [2.0]}),
    "text": lambda path: write_text(path, "x"),
    "checkpoint": lambda path: write_checkpoint(path, IDENTITY, ARRAYS),
}
BAD_PLACES = ("", "folder", "file/below", "none/below", "a\0b", "x" * 300, None, 3)


@pytest.mark.parametrize("what", WRITERS)
def test_a_file_that_cannot_be_written_is_refused_and_leaves_nothing(tmp_path, what):
    (tmp_path / "folder" / "full").mkdir(parents=True)
    (tmp_path / "file").write_text("old")
    before = sorted(tmp_path.rglob("*"))
    for place in BAD_PLACES:
        path = os.path.join(tmp_path, place) if isinstance(place, str) and place else place
        assert_refused(lambda path=path: WRITERS[what](path))
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "old"


def test_a_folder_that_cannot_be_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    for path in ("", None, 3, "a\0b", tmp_path / "file", tmp_path / "file" / "below", "x" * 300):
        assert_refused(lambda path=path: output_folder(path), "output folder")


def test_writers_and_places_make_more_than_thirty_cases():
    cases = set(itertools.product(WRITERS, map(repr, BAD_PLACES)))
    assert len(cases) + len(HARMS) > 30
