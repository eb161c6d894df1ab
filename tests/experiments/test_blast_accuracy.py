"""Errors of blast runs on outcomes made by hand, and what a quick run must show."""

import csv
import json

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
