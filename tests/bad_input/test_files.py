"""A checkpoint that is damaged anywhere is refused."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from taichi_dem.kit.checkpoint import read_checkpoint, write_checkpoint
from tests.bad_input.refusals import assert_refused, steady

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
