"""No bit depends on the search for contacts, left and right, launches, or what is in the batch."""

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

SHAKEN = {"dt": 2e-5, "frequency": 6.0, "amplitude": 0.02}
TURNING = {"friction_law": "history", "rotation": True}


def final(rig, s=0):
    return np.concatenate([*rig.state(s), [[rig.impulse[s], rig.energy(s)]]])


def test_both_searches_give_the_same_bits():
    # Pairs come in the same order, and those that do not touch add nothing.
    cells, pairs = (
        Rig(Spheres(search=search, **TURNING), [2, 50, 160], **SHAKEN).run(10_000)
        for search in ("cells", "all_pairs")
    )
    for s in range(3):
        assert np.array_equal(final(cells, s), final(pairs, s))
        assert cells.divergence_code(s) == 0


@pytest.mark.parametrize("law", [{}, TURNING])
def test_mirrored_start_runs_mirrored_bit_for_bit(law):
    rig = Rig(Spheres(**law), 50, seed=[3, 3], **SHAKEN)
    rig.mirror(0, to=1)
    (place, mirrored), (velocity, turned) = (array[:, :50] for array in rig.run(10_000).states())
    assert np.array_equal(velocity * [-1.0, 1.0], turned)
    # Places are counted from the left here: the sum of two rounds.
    assert place[:, 0] + mirrored[:, 0] == pytest.approx(0.06, abs=1e-16)
    assert np.array_equal(place[:, 1], mirrored[:, 1])


def test_launches_and_neighbours_in_a_batch_change_no_bit():
    filling = Spheres(**TURNING)
    together = Rig(filling, [10, 50, 0, 33], seed=[5, 6, 7, 8], **SHAKEN).run(6000)
    alone = Rig(filling, 50, seed=6, **SHAKEN)
    for steps in (1, 7, 1992, 4000):
        alone.run(steps)
    assert np.array_equal(final(together, 1), final(alone))
