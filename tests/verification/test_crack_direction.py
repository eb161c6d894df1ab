"""A crack of known direction: along the rows of a structured mesh, straight in a scattered one."""

import pytest

from crack_direction import ALLOWED, TURN, broken_plate


@pytest.mark.slow
def test_a_crack_follows_rows_and_runs_straight_where_there_are_none():
    """Pulled across its notch a plate breaks along it, by symmetry."""
    assert abs(broken_plate(5e-3).angle) > TURN - 3.0
    assert abs(broken_plate(4e-3, scatter=3).angle) < ALLOWED
