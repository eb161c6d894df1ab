"""Errors of blast runs on outcomes made by hand, and what a quick run must show."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import ImplicitDashpots, Uniform, simulate
from taichi_dem.outcome import (
    SPLIT,
    Outcome,
    displacement_error,
    energy_error,
    faces_error,
    outcome_of,
)
from taichi_dem.step_study import StepStudy
from tests.bar_blast import bar_scene


def outcome(moved=((3.0, 0.0, 0.0), (0.0, 4.0, 0.0)), broken=(1, 2), **energy):
    terms = {**dict.fromkeys(SPLIT, 0.0), "load_work": 10.0, **energy}
    figures = {
        "evaluations": 1,
        "cpu_s": 1.0,
        "wall_s": 1.0,
        "compile_seconds": 0.0,
        "residual": 0.0,
    }
    return Outcome(moved=moved, broken=broken, energy=terms, reached_s=1.0, **figures)


def test_displacement_error_is_the_rms_of_the_difference_over_that_of_the_reference():
    """Difference (0, 0, 1) of one body over sqrt(9 + 16)."""
    run = outcome(moved=((3.0, 0.0, 1.0), (0.0, 4.0, 0.0)))
    assert displacement_error(run, outcome()) == pytest.approx(0.2, rel=1e-15)
    assert displacement_error(outcome(), outcome()) == 0.0


def test_a_face_too_many_and_one_too_few_do_not_cancel():
    assert faces_error(outcome(broken=(1, 3)), outcome()) == 1.0
    assert faces_error(outcome(broken=(1, 2, 3)), outcome()) == 0.5


def test_energy_moved_from_one_term_to_another_counts_once():
    """1 J of 10 J is booked as kinetic instead of as strain: 10 %."""
    run = outcome(kinetic=3.0, bond_strain=1.0)
    assert energy_error(run, outcome(kinetic=2.0, bond_strain=2.0)) == pytest.approx(0.1)


@pytest.fixture
def study():
    """Runs at steps of 4, 2 and 1 s; the first diverged half way, the others have twins."""
    made = StepStudy("some", None, None, 2.0)
    failed = replace(outcome(), failure="diverged", evaluations=3)
    made.runs = {4.0: failed, 2.0: replace(outcome(), evaluations=8, cpu_s=3.0), 1.0: outcome()}
    near = ((3.0, 0.0, 0.0), (0.0, 4.0, 0.5))
    made.twins = {2.0: replace(outcome(near), cpu_s=2.0), 1.0: outcome()}
    return made


def test_the_floor_is_the_distance_of_the_finest_twin(study):
    assert study.spread == pytest.approx({2.0: 0.1, 1.0: 0.0})
    del study.twins[1.0]
    assert study.floor == pytest.approx(0.1)
    study.twins.clear()
    assert study.floor == 0.0


def test_points_have_the_times_of_twins_and_failed_ones_the_work_of_the_next(study):
    failed, coarse, fine = study.points(outcome())
    assert (failed.failure, failed.evaluations) == ("diverged at 1000000 µs", 4.0)
    assert (coarse.seconds.low, coarse.seconds.high, coarse.seconds.count) == (2.0, 3.0, 2)
    assert (fine.error, fine.label, fine.evaluations) == (0.0, "1 s", 1)
    study.runs = {4.0: study.runs[4.0]}
    assert study.points(outcome())[0].evaluations == 6.0


@pytest.mark.slow
def test_a_twin_is_run_where_the_first_was_fast_enough():
    made = StepStudy("implicit", ImplicitDashpots, bar_scene(), 1.6e-5)
    made.run(1.6e-6)
    made.run(8e-7, enough=1e3)
    assert [*made.runs] == [1.6e-6, 8e-7] and [*made.twins] == [8e-7]
    assert 0.0 < made.floor < 1e-6 and len(made.outcomes) == 3


@pytest.fixture(scope="module")
def ends():
    """Outcomes of the blown bar, undisturbed and disturbed, and by a step that is too long."""
    scene, method = bar_scene(), ImplicitDashpots(8e-7)
    small = outcome_of(scene, method, 5.6e-5, disturbance=1e-12)
    return outcome_of(scene, method, 5.6e-5), small, outcome_of(scene, Uniform(1e-6), 5.6e-5)


def test_outcome_is_that_of_the_run_and_survives_a_file(ends):
    plain, *_ = ends
    result = simulate(bar_scene(), method=ImplicitDashpots(8e-7), until=5.6e-5, progress=None)
    assert plain.broken == np.flatnonzero(~np.isnan(result.broken_time)).tolist() != []
    assert plain.energy == result.report.energy_balance and plain.failure == ""
    assert Outcome(**json.loads(json.dumps(plain.as_dict()))) == plain
    assert plain.reached_s == pytest.approx(5.6e-5)


def test_runs_that_differ_by_round_off_end_near_each_other(ends):
    plain, disturbed, _ = ends
    assert 0.0 < displacement_error(disturbed, plain) < 1e-6


def test_a_run_that_diverges_has_an_outcome_too(ends):
    *_, failed = ends
    assert "diverged" in failed.failure
    assert failed.reached_s < 5.6e-5


@pytest.mark.slow
def test_quick_run_agrees_with_its_reference_and_keeps_every_run(quick_run):
    folder, done = quick_run("cost_of_accuracy_blast")
    assert done.returncode == 0, done.stderr
    figures = json.loads((folder / "summary.json").read_text())["figures"]
    # An independent method, also of first order, at a step that the specification calls converged.
    assert figures["reference_check"]["value"] < 1e-3
    assert figures["chaos_floor"]["value"] < 1e-6
    assert figures["cheapest_method_at_1_percent"]["value"] == "implicit"
    with open(folder / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows[0]["method"] == "reference"
    assert {row["disturbed"] for row in rows} == {"0", "1"}
    assert all(float(row["displacement_error"]) < 0.01 for row in rows)
