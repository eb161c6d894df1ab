"""The error of a filling's step is told apart from the floor that seeds make."""

from types import SimpleNamespace

import numpy as np
import pytest

from ca_damper import Spheres
from ca_damper.accuracy.step_study import StepStudy


def test_the_floor_is_the_spread_of_means_over_the_seeds():
    # Seeds 2 and 4 at one of two frequencies: variance 2, over both 1, over the peak squared 1 / 9;
    # the run has none, so that half of it is left.
    study = StepStudy("dem", Spheres(), 2, range(1, 3), ratios=(0.95, 1.0))
    study.reference = {"rms": [[2.0, 4.0], [1.0, 1.0]]}
    study.runs = {2e-5: [SimpleNamespace(rms=np.full((1, 2, 2), 3.0))]}
    assert study.seed_spread == pytest.approx((0.5 / 9.0) ** 0.5)
    assert study.floor == pytest.approx(study.seed_spread * (1.0 / 2.0 + 1.0 / 2.0) ** 0.5)
