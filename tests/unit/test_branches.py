"""Values of seeds that fall into clusters, and those that only look so."""

import numpy as np
import pytest

from taichi_dem.kit.bars.answer import branches_of
from taichi_dem.kit.bars.chance import clusters_of

SEEDS = tuple(range(1, 13))


def test_two_motions_are_told_apart_with_their_shares():
    rng = np.random.default_rng(1)
    values = np.where(np.arange(12) % 3 == 0, 7.5, 9.3) + 0.02 * rng.normal(size=12)
    clusters = clusters_of(values, 0.02, 0.05)
    assert [len(one) for one in clusters] == [8, 4]
    first, second = branches_of(values, clusters, SEEDS, 0.02, 2.0)
    assert first.value == pytest.approx(9.3, abs=0.05) and second.seeds == (1, 4, 7, 10)
    assert first.error >= abs(first.value - 9.3) and 0.0 < first.error < 0.05
    # Wilson's interval of 8 in 12 at 95 %: 0.39 to 0.86.
    assert first.share == pytest.approx(8 / 12) and first.share_error == pytest.approx(
        0.235, abs=5e-3
    )


@pytest.mark.parametrize("seed", range(5))
def test_one_motion_with_chance_is_one_cluster(seed):
    values = np.random.default_rng(seed).normal(size=12)
    assert len(clusters_of(values, 0.3, 0.0)) == 1
    # A gap has to stand out from the errors of the seeds, and to matter.
    pair = np.where(np.arange(12) < 6, 0.0, 1.0)
    assert len(clusters_of(pair, 0.25, 0.0)) == len(clusters_of(pair, 0.0, 1.5)) == 1
