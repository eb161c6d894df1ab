"""The triangular lattice of the container: who is whose neighbour, and where cells lie."""

import numpy as np
import pytest

from ca_damper.automaton.lattice import (
    DIRECTIONS,
    DOWN,
    EMPTY,
    UP,
    Geometry,
    alignments,
    unit_vectors,
)

BOX = Geometry(10, 16)
WIDTH = 6e-3


def test_inner_cells_have_six_neighbours_where_the_triangles_put_them():
    """Vertical neighbours one width away, oblique ones one column aside and half a width up."""
    ahead, centres = BOX.neighbours(), BOX.centres(WIDTH)
    inner = np.flatnonzero(BOX.blank()[:-1] == EMPTY)
    assert len(inner) == 160
    for cell in inner:
        way = (centres[ahead[cell, :DIRECTIONS]] - centres[cell]) / WIDTH
        expected = np.column_stack([np.sign(unit_vectors()[:, 0].round(9)), unit_vectors()[:, 1]])
        assert way == pytest.approx(expected, abs=1e-12)


def test_projections_are_exact():
    """cos 60 degrees is 1/2 to the last bit: gravity on oblique flights is g / 2."""
    assert np.array_equal(alignments()[:, UP], [1.0, 0.5, -0.5, -1.0, -0.5, 0.5])
    assert np.array_equal(alignments()[DOWN], -alignments()[UP])
