"""What a page holds is what was recorded, within half a step of its quantisation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from taichi_dem import InputError
from taichi_dem.kit.viewer import MOST_BYTES, pack, quantise, select_frames, time_unit
from taichi_dem.viewer.block import rotation_vectors
from tests.bad_input.refusals import assert_refused, steady
from tests.turns import matrix, quaternion
from tests.viewer.made import of_frames, unpacked

UNIT = st.floats(-1.0, 1.0)


@steady
@given(arrays(float, (3, 4), elements=st.floats(-1e30, 1e30)))
def test_quantised_values_differ_by_at_most_half_a_step(values):
    found, half = of_frames(quantise(list(values)))
    # And by the rounding of the division and the product.
    assert (np.abs(found - values) <= half * (1.0 + 1e-11)).all()
    largest = np.abs(values).max(axis=1)
    assert half[:, 0] * 2.0 == pytest.approx(largest / 32767, abs=1e-320)


@pytest.mark.parametrize("kind", ["uint8", "int16", "uint32", "float32"])
def test_packed_arrays_come_back(kind):
    values = np.arange(12).reshape(3, 4)
    assert np.array_equal(unpacked(pack(values, kind)), values.ravel())


@steady
@given(st.tuples(UNIT, UNIT, UNIT), st.floats(-np.pi, np.pi))
def test_a_rotation_vector_turns_as_its_matrix(axis, angle):
    axis = np.array(axis) if np.linalg.norm(axis) > 1e-3 else np.array([0.0, 0.0, 1.0])
    turn = matrix(quaternion(axis, angle))
    (vector,) = rotation_vectors(turn[None])
    found = np.linalg.norm(vector)
    assert found <= np.pi * (1.0 + 1e-15)
    again = matrix(quaternion(vector, found)) if found > 0.0 else np.eye(3)
    # The sine of half an angle of about pi is known to the rounding of one.
    assert again == pytest.approx(turn, abs=1e-14)


def test_a_half_turn_keeps_its_axis():
    for axis in (*np.eye(3), [1.0, 1.0, 0.0], [1.0, -2.0, 3.0]):
        turn = matrix(quaternion(axis, np.pi))
        (vector,) = rotation_vectors(turn[None])
        assert np.linalg.norm(vector) == pytest.approx(np.pi)
        assert matrix(quaternion(vector, np.pi)) == pytest.approx(turn, abs=1e-14)


def test_times_have_a_unit_in_which_they_are_readable():
    assert [time_unit(t)[0] for t in (2.0, 5e-4, 1e-3, 3e-8, 0.0)] == ["s", "µs", "ms", "ns", "ns"]


def test_a_page_that_would_be_too_large_holds_frames_evenly():
    frames = list(range(101))
    kept, (note,) = select_frames(frames, [True] * 101, MOST_BYTES // 40, 0)
    # 30 frames of a fortieth, times 4/3, fill the page.
    assert len(kept) == 30 and kept[0] == 0 and kept[-1] == 100
    assert set(np.diff(kept)) <= {3, 4}
    assert note == "30 of 101 frames shown: a page has at most 30 MB."


def test_frames_that_are_not_finite_are_left_out():
    kept, (note,) = select_frames([1, 2, 3], [True, False, True], 1, 0)
    assert kept == [1, 3] and note.startswith("1 frame with infinite values")
    assert_refused(lambda: select_frames([1], [False], 1, 0), "frames must", "none")


def test_a_scene_of_which_two_frames_do_not_fit_is_refused():
    with pytest.raises(InputError, match=r"scene must fit a page of 30 MB, got 40 MB"):
        select_frames([1, 2], [True, True], MOST_BYTES // 2, 0)
