"""Every experiment runs with --quick as a user runs it; its key figures lie within their bars."""

import json
import math
from fnmatch import filter as matching
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image

from taichi_dem.kit.study.entries import ENTRIES, read_entries
from tests.experiments.contract import FOLDER, NAMES, rows_of, start
from tests.terminal import phases_of

ENTRY = {entry.name: entry for entry in read_entries(FOLDER / ENTRIES)}
#: Those that the fast suite runs: a blast, a damper, a study.
FAST = ("demo_sleeping", "damper_patterns", "demo_step_too_large")
#: Line on standard error of what is known to be outside the range of the paper's rules.
KNOWN = "rules 'paper' of the automaton are known to fail"


class Row(NamedTuple):
    """What a quick run must show.

    bars: figure -> (low, high), or a function of all figures that gives them, or the word wanted.
    files: beside summary.json, tables and the pictures of its entry. lacks: pictures and patterns
    of figures of its entry that a quick run has not.
    """

    bars: dict
    files: tuple = ()
    lacks: tuple = ()


def near(value, relative=0.0, absolute=0.0):
    """Bars around a value."""
    return value - absolute - relative * abs(value), value + absolute + relative * abs(value)


def same_as(name, relative=0.0):
    """Bars around another figure."""
    return lambda figures: near(figures[name], relative)


def below(name, share=1.0):
    """Bars from zero to a share of another figure."""
    return lambda figures: (0.0, share * figures[name])


def wanted(name):
    """Bars that the experiment gives itself."""
    return lambda figures: (figures[f"{name}_wanted_low"], figures[f"{name}_wanted_high"])


def each(pattern, words, bars):
    """The same bars for figures whose names differ by a word."""
    return {pattern.format(word): bars for word in words.split()}


ANY, NONE = (1, math.inf), (0, 0)
#: The hole at 0.08 ms by all methods that converge, 0.7372 mm, to half a percent [mm].
HOLE = near(0.7372, 0.005)
#: 84 um of way in 1000 samples: the peak may lie between two, the failure is seen one late.
SAMPLE = (22.0 + 26.0 + 36.0) / 1000
#: Trapezoids cut the corner at the peak, where the slope changes by 450 + 440 GPa/m.
CORNER = 890e9 * (1e-6 * SAMPLE) ** 2 / 8 / 99.67 + 1e-9
#: Dispersion (k h)^2 / 24 of a pulse of 0.76 m on cells of 0.1 m.
DISPERSION = (2.0 * math.pi * 0.1 / 0.76) ** 2 / 24.0
#: Ratio at which 30 grains of 0.2 g peak as a rigid mass, to half the distance of ratios.
RIGID = near(math.sqrt(86.0 / 92.0), absolute=0.01)
#: 6 fixed grams stretch the spring by this [mm], and the amplitude loses so much in a cycle.
SAG = 1e3 * 6e-3 * 9.8 / 123.4
LOSS = 0.08 / (2.0 * 92e-3) / math.sqrt(123.4 / 86e-3) * 2.0 * math.pi
#: Cycles from 30 to 10 mm: the amplitude after c + 1/2 is (30 mm + sag) exp(-loss (c + 1/2)).
CYCLES = near(math.log((30.0 + SAG) / 10.0) / LOSS, absolute=0.5)

EVERY = {
    "accuracy_on_request": Row({"coverage_percent": (75.0, 100.0), "price_ratio_worst": (0, 20)}),
    "blast_block": Row(
        {
            "linear_momentum_error": (0.0, 1e-11),
            "ledger_residual_fraction": (0.0, 0.01),
            "broken_faces": ANY,
            "ppv_exponent": (-3.0, -0.5),
        },
        files=("mesh.msh", "checkpoint.npz", "paraview/out.pvd"),
    ),
    "blast_ensemble": Row(
        {
            "failed_members": NONE,
            "hole_displacement_mean_mm": HOLE,
            "faces_in_all": below("broken_faces_mean"),
        }
    ),
    "blast_fracture": Row(
        {
            **each("{}_momentum_error", "linear angular", (0.0, 1e-11)),
            "hole_radial_displacement_mm": HOLE,
            "ledger_residual_fraction": (0.0, 0.001),
            "audit_misses": NONE,
        },
        files=("mesh.msh", "report.json", "view.html", "paraview/out.pvd", "paraview/out_0000.vtu"),
    ),
    "blast_methods": Row(
        {
            **each("displacement_error_{}", "explicit_limited implicit", (0.0, 0.01)),
            **each("ledger_residual_fraction_{}", "explicit_limited implicit", (0.0, 0.01)),
        },
        lacks=("levels_multirate_controlled.png",),
    ),
    "blast_multirate": Row(
        {
            **each("multirate_held_{}_displacement_difference", "early late", (-0.05, 0.05)),
        }
    ),
    "blast_scaling": Row(
        {"imbalance_24_rebalanced": below("imbalance_24_static"), "speedup_24_due": (1.0, 24.0)}
    ),
    # Bond after bond takes no more sweeps than all at once.
    "blast_sweeps": Row(
        {f"sweeps_gauss_seidel_{x}": below(f"sweeps_jacobi_{x}") for x in ("0.05", "0.01", "0.001")}
    ),
    "calibrate_material": Row({f"{name}_misfit": (-0.02, 0.02) for name in ("young", "poisson")}),
    # An independent method, also of first order, at a step known to be converged.
    "cost_of_accuracy_blast": Row(
        {
            "reference_check": (0.0, 1e-3),
            "chaos_floor": (0.0, 1e-6),
            "cheapest_method_at_1_percent": "implicit",
        },
        lacks=("paper_rule*",),
    ),
    # The motion by the measured force must be the motion measured; the sums take x at n points a
    # cycle, which misses its change over the cycles by their n-th part.
    "cost_of_accuracy_damper": Row(
        each("check_force_{}", "ca_static ca_landing dem_tsuji dem_soft", (0.0, 1e-3))
    ),
    # Another run with the same effects costs the same, on a busy machine too.
    "cost_of_effects": Row(
        {"overhead_absent_percent": (-50.0, 50.0), "blast_seconds": (0.0, 60.0)}
    ),
    "damper_cost": Row(
        {"longest_step_dem": below("longest_step_ca_static"), "longest_step_ca_static": (0, 1.2e-3)}
    ),
    "damper_maps": Row(
        {
            "jump_ratio_dem": near(1.0, 0.15),
            "jump_ratio_ca_place": same_as("jump_ratio_dem", 0.05),
            "plateau_share_dem": near(0.97, 0.03),
            "largest_loss_ca_place": same_as("largest_loss_dem", 0.15),
        }
    ),
    "damper_measured_motion": Row(
        {
            "damping_ratio_empty": near(0.01228, absolute=1e-5),
            **each("rms_mm_{}_N30", "dem ca_place", below("rms_mm_empty", 0.85)),
            **each("damping_ratio_{}_N30", "dem ca_place", (1.5 * 0.01228, 0.1)),
        }
    ),
    # Thrown higher than the container moves, and never all on the floor.
    "damper_patterns": Row(
        {
            **each("floor_share_least_{}", "ca_N20 ca_N40 dem_N20 dem_N40", (0.0, 0.05)),
            **each("height_amplitude_mm_{}", "ca_N20 ca_N40 dem_N20 dem_N40", (10.0, 40.0)),
        }
    ),
    # The readings differ, or comparing them would say nothing.
    "damper_rebound": Row(
        {
            **each("impact_error_ms{}", "_signed _dem", (0.0, 2.0)),
            **each("impact_error_ms{}", "_reset _kept", (10.0, 100.0)),
        }
    ),
    "damper_response": Row(
        {
            **each("peak_ratio_{}_N30", "dem ca_static", RIGID),
            "peak_rms_mm_ca_static_N30": same_as("peak_rms_mm_dem_N30", 0.05),
        },
        lacks=("peak_ratio_*_N50",),
    ),
    # The grain's RMS of the closed form, to the share of a step that a blow may be late.
    "damper_validity": Row(
        {
            **{
                row: wanted(row) for row in ("gap_mm_N40", "lag_deg_N40", "loss_2g", "plug_jump_mm")
            },
            "impact_rms_mm": same_as("impact_rms_mm_exact", 0.01),
        }
    ),
    # Let go at 30 mm, where nothing is detuned, both fillings agree.
    "demo_damper": Row(
        {
            **each("cycles_{}_N10", "ca_place dem", same_as("cycles_N10_expected")),
            **each("cycles_{}_N50", "ca_place dem", same_as("cycles_N50_expected")),
            **each(
                *("decrement_above_12mm_{}_N30", "ca_place dem"),
                same_as("decrement_above_12mm_N30_expected", 0.03),
            ),
            "cycles_rigid_N30": CYCLES,
        },
        files=("view.html", "report.json"),
    ),
    # Openings are known to 8 eps of 0.8 m, the bench's size.
    "demo_fracture_law": Row(
        {
            "peak_MPa_error": (-SAMPLE / 14.80, 1e-9),
            "failure_opening_um_error": (-1e-9, SAMPLE / 29.93),
            "energy_J_m2_error": (-CORNER, CORNER),
            **each("plateau_at_{}_MPa_error", "0 5 10 15", (-1e-9, 1e-9)),
        }
    ),
    "demo_contact": Row(
        {
            **each("bodies_{}_injected_kJ", "4 9", NONE),
            **each("bodies_{}_residual", "4 9", (0.0, 1e-3)),
            **each("spheres_{}_injected_kJ", "3 6", (0.1, 10.0)),
            "bodies_spread_mm": below("spheres_spread_mm", 0.5),
        }
    ),
    "demo_multirate": Row({"held_fewer_evaluations": (3, 99), "held_difference": (0.0, 2e-3)}),
    # A share of 1e-6 of the impulse moves nothing by more than some of that.
    "demo_sleeping": Row(
        {
            "audit_misses": NONE,
            "left_out_impulse": (0.0, 1e-6),
            "error_by_sleep_percent": (0.0, 1e-2),
            "asleep_percent": (50.0, 100.0),
        }
    ),
    # Half of the energy given is what the divergence check lets pass.
    "demo_step_too_large": Row(
        {
            "dashpots_0.9_diverged": NONE,
            "dashpots_1.3_diverged": (1, 1),
            "dashpots_0.9_unexplained": (0.0, 0.01),
            "dashpots_1.3_unexplained": (0.5, math.inf),
        }
    ),
    # And the depth of the last cell's middle.
    "demo_wave_and_spall": Row(
        {
            **each("spall_{}_error_cells", "1.5 2", (-1.0, 1.0)),
            "free_end_over_wave": (2.0 * (1.0 - 4.0 * DISPERSION), 2.0 + 2.0 * DISPERSION),
        }
    ),
    "hard_cases": Row({"failed": NONE, "passed": ANY}),
    "trust": Row(
        {
            "rotation_spin_error_percent": (-1.0, 1.0),
            "bar_wave_20_value": same_as("bar_wave_20_published", 0.05),
            "joint_45_value": (0.99, 1.01),
        },
        lacks=tuple(f"{name}.png" for name in "branching spall disc crack blast slope".split()),
    ),
}
QUICK = pytest.mark.experiment
CASES = [name if name in FAST else pytest.param(name, marks=QUICK) for name in NAMES]


def test_every_experiment_has_a_row_and_an_entry_of_the_gallery():
    assert sorted(EVERY) == NAMES == sorted(ENTRY)


@pytest.mark.parametrize("name", CASES)
def test_a_quick_run_ends_well_and_its_key_figures_lie_within_their_bars(name, tmp_path):
    row, folder, report = EVERY[name], tmp_path / "out", tmp_path / "figures.json"
    options = ENTRY[name].options.split()
    done = start(name, "--quick", "--out", folder, *options, report=report)
    assert done.returncode == 0, done.stderr
    # No progress bar, no banner, no warning: a pipe gets a line a phase, and a file stays readable.
    phases, others = phases_of(done.stderr)
    assert [line for line in others if KNOWN not in line] == []
    assert len(set(phases)) == len(phases)
    assert len(done.stdout.splitlines()) > 5 and "\x1b" not in done.stdout
    figures = figures_of(name, folder)
    for pattern in set(ENTRY[name].figures) - set(row.lacks):
        assert matching(figures, pattern), f"the gallery's {pattern} is no figure"
    for figure, bars in row.bars.items():
        assert is_within(figures[figure], bars, figures), f"{figure} is {figures[figure]}"
    pictures = set(ENTRY[name].pictures) - set(row.lacks)
    for file in (*pictures, *row.files):
        assert (folder / file).is_file(), file
    assert list(folder.glob("*.csv")) and not list(folder.rglob("*.part*"))
    for picture in folder.glob("*.png"):
        assert is_drawn(picture), picture.name
    assert json.loads(report.read_text())["defects"] == []


def figures_of(name, folder):
    """Values of the summary of a quick run; JSON has no NaN, so that none can be told as true."""
    text = (folder / "summary.json").read_text()
    summary = json.loads(text, parse_constant=pytest.fail)
    assert summary["experiment"] == name and summary["quick"] is True
    # Cases that run in processes of their own compile nothing here.
    assert max(summary["seconds"].values()) > 0.0 and summary["versions"] and summary["machine"]
    assert all(set(figure) == {"value", "unit", "paper"} for figure in summary["figures"].values())
    return {key: figure["value"] for key, figure in summary["figures"].items()}


def is_within(value, bars, figures):
    """Whether a figure lies within its bars, or is the word wanted."""
    if isinstance(bars, str):
        return value == bars
    low, high = bars(figures) if callable(bars) else bars
    return low <= value <= high


def is_drawn(picture):
    """Whether a picture is more than a blank canvas, which has one colour."""
    with Image.open(picture) as image:
        return min(image.size) >= 300 and len(np.unique(np.asarray(image.convert("L")))) > 20


@pytest.mark.slow
def test_a_quick_bench_measures_waits_and_shares_of_the_floors(tmp_path):
    done = start("bench", "--quick", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / "bench.json").read_text())
    assert content["first_scene_cold_seconds"] > content["second_scene_seconds"] > 0.0
    assert any(one["share_of_floor"] for one in content["figures"])


@QUICK
def test_a_diverging_run_names_body_and_step_and_keeps_the_last_good_output(tmp_path):
    light = "--without", "body_contact,sticking_friction", "--out", tmp_path
    done = start("blast_fracture", "--method", "fixed", "--dt0", "1e-6", *light)
    phases, others = phases_of(done.stderr)
    assert phases == ["blasting: compiling", "blasting: stepping"]
    assert done.returncode == 3 and len(others) == 1, done.stderr
    for word in ("diverged at t = ", "body ", "try a step of "):
        assert word in done.stderr
    rows = rows_of(tmp_path / "history.csv")
    assert all(math.isfinite(float(value)) for row in rows for value in row.values())
    assert not (tmp_path / "summary.json").exists()
