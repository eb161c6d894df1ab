"""A checkpoint that is damaged anywhere is refused, and a forged one whose seal is right."""

import hashlib
import json
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from taichi_dem.kit.errors import InputError
from tests.bad_input.refusals import assert_refused, steady

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


def sealed(path, head, body):
    """A file with the digest of a checkpoint; head: JSON, or bytes."""
    text = head if isinstance(head, bytes) else json.dumps(head).encode()
    content = text + b"\n" + body
    path.write_bytes(content + hashlib.sha256(content).hexdigest().encode())


def array(kind="<f8", shape=(2,)):
    return {"identity": IDENTITY, "arrays": [["a", kind, shape]]}


#: Heads and bodies that no run writes.
FORGED = {
    "no head": (b"", b""),
    "no JSON": (b"PK\x03\x04", bytes(100)),
    "no dict": ([IDENTITY], b""),
    "nested": (b"[" * 100_000, b""),
    "no arrays": ({"identity": IDENTITY}, b""),
    "no identity": ({"arrays": []}, b""),
    "identity of words": ({"identity": "version", "arrays": []}, b""),
    "arrays by number": ({"identity": IDENTITY, "arrays": [1, 2]}, b""),
    "objects": (array("|O"), bytes(16)),
    "text": (array("<U2"), bytes(16)),
    "text of no size": (array("<U0", (10**12,)), b""),
    "a record": (array("f8,i4"), bytes(24)),
    "no type": (array("pickle"), bytes(16)),
    "3 TB": (array(shape=(400_000_000_000,)), bytes(16)),
    "more than there is": (array(shape=(2**80,)), bytes(16)),
    "less than there is": (array(), bytes(24)),
    "negative": (array(shape=(-2,)), bytes(16)),
    "back and forth": (
        {"identity": IDENTITY, "arrays": [["a", "<f8", [-1]], ["b", "<f8", []]]},
        b"",
    ),
    "twice negative": (array(shape=(-1, -2)), bytes(16)),
    "halves": (array(shape=(0.5, 4)), bytes(16)),
    "65 axes": (array(shape=(1,) * 64 + (2,)), bytes(16)),
    "shape of words": (array(shape=("2",)), bytes(16)),
}


@pytest.mark.parametrize("forged", FORGED)
def test_a_forged_checkpoint_is_refused_in_a_sentence_and_little_memory(tmp_path, forged):
    path = tmp_path / "run.checkpoint"
    sealed(path, *FORGED[forged])
    tracemalloc.start()
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))
    assert tracemalloc.get_traced_memory()[1] < 2e7
    tracemalloc.stop()


def test_a_packed_archive_of_before_is_refused_unread(tmp_path):
    """Three megabytes of zeros that unpack to 3.2 GB: nothing is unpacked."""
    path = tmp_path / "run.npz"
    with open(path, "wb") as file:
        np.savez_compressed(file, a=np.zeros(4_000_000))
    content = path.read_bytes()
    path.write_bytes(content + hashlib.sha256(content).hexdigest().encode())
    tracemalloc.start()
    assert_refused(lambda: read_checkpoint(path, IDENTITY), str(path))
    assert tracemalloc.get_traced_memory()[1] < 4e6
    tracemalloc.stop()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=3), part),
    max_leaves=6,
)
KIND = st.sampled_from(["<f8", "|b1", "<i4", "<U1", "|V0", "O", "<M8[s]", ">f8", "f8,f8"])
LENGTH = st.integers(-3, 4) | st.integers()


@steady
@given(
    named=st.lists(st.tuples(st.text(max_size=3), KIND, st.lists(LENGTH, max_size=3)), max_size=3),
    other=st.none() | JSON,
    body=st.binary(max_size=40),
)
def test_any_head_is_refused_or_gives_arrays_of_the_bytes_that_follow(
    tmp_path_factory, named, other, body
):
    path = tmp_path_factory.mktemp("forged") / "run.checkpoint"
    sealed(path, {"identity": IDENTITY, "arrays": named if other is None else other}, body)
    try:
        arrays = read_checkpoint(path, IDENTITY)
    except InputError as error:
        assert str(path) in str(error)
        assert "\n" not in str(error)
    else:
        assert sum(one.nbytes for one in arrays.values()) <= len(body)
