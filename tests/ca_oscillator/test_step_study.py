"""Study of a filling's step: failures in words, the floor that seeds make, points and rows."""

from types import SimpleNamespace

import numpy as np
import pytest

from ca_damper import Spheres
from ca_damper.step_study import FIRST_SEED, StepStudy

JOB = {"ratios": (0.95, 1.0), "transient_cycles": 1, "measured_cycles": 1, "progress": None}


@pytest.fixture
def study():
    return StepStudy("dem", Spheres(), 2, range(1, 3), **JOB)


@pytest.fixture
def known(study):
    study.reference = {"rms": [[2.0, 4.0], [1.0, 1.0]], "step": 1e-5, "force_check": 0.0}
    report = SimpleNamespace(run_seconds=0.5)
    force = np.full((1, 2, 2), -2 * study.filling.particle_mass * study.filling.gravity)
    run = SimpleNamespace(rms=np.full((1, 2, 2), 3.0), mean_force=0.5 * force, report=report)
    study.runs, study.failures = {2e-5: [run, run]}, {1e-4: "diverged"}
    return study


def test_a_reference_and_runs_by_seeds_of_their_own(study):
    study.reference = study.make_reference(2e-5, 2)
    study.run(2e-5, repeats=2)
    study.run(1e-2)
    study.measure_roundoff(2e-5)
    assert study.failures == {1e-2: "refused"} and len(study.runs[2e-5]) == 2
    assert study.rms.shape == (2, 2) and study.reference["force_check"] < 0.1
    assert 0.0 < study.roundoff < 1e-3 and study.compile_s >= 0.0
    assert {row[3] for row in study.rows()} == {1, 2, FIRST_SEED, FIRST_SEED + 1}


def test_repeats_end_when_they_took_long_enough(study):
    study.run(2e-5, repeats=3, enough=0.0)
    assert study.runs[2e-5] == []


def test_the_floor_is_the_spread_of_means_over_the_seeds(known):
    # Seeds 2 and 4 at one of two frequencies: variance 2, over both 1, over the peak squared 1 / 9;
    # the run has none, so that half of it is left.
    assert known.seed_spread == pytest.approx((0.5 / 9.0) ** 0.5)
    assert known.floor == pytest.approx(known.seed_spread * (1.0 / 2.0 + 1.0 / 2.0) ** 0.5)


def test_points_have_error_cost_and_missing_weight(known):
    failed, good = known.points(known.mean)
    assert (failed.failure, failed.label, failed.seconds) == ("diverged", "100 µs", None)
    assert (good.seconds.low, good.seconds.count) == (0.5, 2)
    assert good.residual == pytest.approx(0.5)
    # At the second frequency 3 for 1, over the peak of 3: its RMS over both frequencies.
    assert good.error == pytest.approx(2.0 / 3.0 / 2.0**0.5)
    assert good.evaluations > failed.evaluations
