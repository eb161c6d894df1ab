"""A file that is damaged or forged anywhere is refused, or read as what it was before."""

import hashlib
import json
import re
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from taichi_dem import PAPER_BLOCK, read_mesh
from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import answer, assert_refused, steady

IDENTITY = {"version": "1", "mesh": "a cube"}
ARRAYS = {"field/a.b": np.arange(12.0).reshape(4, 3), "part/none": np.zeros((0, 2))}


@steady
@given(share=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
def test_a_checkpoint_that_is_changed_anywhere_is_refused(tmp_path_factory, share, bit, cut):
    """Its digest is of all bytes: also of dates, names, sums and unused room."""
    path = tmp_path_factory.mktemp("checkpoint") / "run.checkpoint"
    write_checkpoint(path, IDENTITY, ARRAYS)
    content = bytearray(path.read_bytes())
    place = int(share * len(content))
    if cut:
        del content[place:]
    else:
        content[place] ^= 1 << bit
    path.write_bytes(bytes(content))
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=3), part),
    max_leaves=6,
)
KINDS = ["<f8", "|b1", "<i4", "<U1", "<U2", "<U0", "|V0", "|O", "<M8[s]", ">f8", "f8,i4", "pickle"]
LENGTH = st.integers(-3, 4) | st.sampled_from([0.5, "2", 10**12, 2**80])
ARRAY = st.tuples(st.text(max_size=3), st.sampled_from(KINDS), st.lists(LENGTH, max_size=3))
HEAD = st.fixed_dictionaries(
    {"identity": st.just(IDENTITY) | ANYTHING, "arrays": st.lists(ARRAY, max_size=3) | ANYTHING}
)


def of_one(*shape, kind="<f8"):
    """Head of a checkpoint with one array."""
    return {"identity": IDENTITY, "arrays": [["a", kind, shape]]}


@settings(steady, max_examples=100)
@given(head=HEAD | ANYTHING, body=st.binary(max_size=40))
@example(head=b"", body=b"")
@example(head=b"PK\x03\x04", body=bytes(100))
@example(head=b"[" * 100_000, body=b"")
@example(head={"identity": IDENTITY}, body=b"")
@example(head=of_one(400_000_000_000), body=bytes(16))
@example(head=of_one(2**80), body=bytes(16))
@example(head=of_one(*[1] * 64, 2), body=bytes(16))
@example(head=of_one(10**12, kind="<U0"), body=b"")
@example(head=of_one(-1, -2), body=bytes(16))
@example(head={"identity": IDENTITY, "arrays": [["a", "<f8", [-1]], ["b", "<f8", []]]}, body=b"")
def test_any_head_is_refused_or_gives_arrays_of_the_bytes_that_follow(tmp_path_factory, head, body):
    """In a sentence and little memory, though the seal is right; head: JSON, or bytes."""
    path = tmp_path_factory.mktemp("forged") / "run.checkpoint"
    text = head if isinstance(head, bytes) else json.dumps(head).encode()
    content = text + b"\n" + body
    path.write_bytes(content + hashlib.sha256(content).hexdigest().encode())
    tracemalloc.start()
    found = answer(lambda: read_checkpoint(path, IDENTITY), str(path))
    if not isinstance(found, str):
        assert sum(one.nbytes for one in found.values()) <= len(body)
    assert tracemalloc.get_traced_memory()[1] < 2e7
    tracemalloc.stop()


NUMBERS = ("-1", "0", "2147483648", "99999999999999999999", "nan", "inf", "x", "1.5", "")


def read(path, lines):
    """The mesh of a file with these lines, or the sentence that refuses it under its own name."""
    path.write_text("\n".join(lines))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        found = answer(lambda: read_mesh(path), str(path))
    # meshio reads a copy of a Gmsh file, of whose place a user knows nothing.
    assert not isinstance(found, str) or {*re.findall(r"\S+\.msh", found)} == {str(path)}
    return found


@pytest.mark.parametrize("count", [12, pytest.param(500, marks=pytest.mark.attack)])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_a_changed_gmsh_file_is_refused_or_read_as_the_same_bodies(tmp_path, version, count):
    """Any word of the structure: heads, numbers and corners; places may be anywhere."""
    draw, path = np.random.default_rng(0), tmp_path / "mesh.msh"
    write_mesh(path, bar(0.2, 0.1, (2, 1, 1)))
    text = (path if version == "2.2" else Path(PAPER_BLOCK)).read_text(encoding="utf-8")
    lines = text.splitlines()
    whole = read(path, lines)
    first, last = lines.index("$Elements"), lines.index("$EndElements")
    for _ in range(count):
        row = draw.choice([*range(3), *range(first, last)])
        words = lines[row].split()
        words[draw.integers(len(words))] = draw.choice(NUMBERS)
        found = read(path, [*lines[:row], " ".join(words), *lines[row + 1 :]])
        if not isinstance(found, str):
            assert np.array_equal(found.points, whole.points), (row, words)
            assert np.array_equal(found.tetrahedra, whole.tetrahedra), (row, words)
    cut = int(draw.integers(1, text.index("$EndElements") + len("$EndElements") - 1))
    assert isinstance(read(path, [text[:cut]]), str)
