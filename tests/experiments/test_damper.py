"""Every experiment of the damper with --quick, what it must show, and what it refuses."""

import json
import math
import re

import numpy as np
import pytest

from _measured_motion import HEADER, RECORD, record
from ca_damper import Spheres, plot
from ca_damper.bouncing import Fall, RecordedFall
from ca_damper.lattice import Geometry
from ca_damper.measures import first_harmonic
from tests.experiments.contract import (
    NAMES,
    QuickRun,
    assert_refused,
    quick_runs,
    rows_of,
    start,
)
from tests.paper import paper

READINGS = ("signed", "signed_through_walls", "reset", "kept")
FILLED = [f"{filling}_N{count}" for filling in ("ca", "dem") for count in (20, 40)]
#: Rows of the automaton's range of validity, and what stands beside the value.
VALIDITY = (
    *(f"{row}_N{count}" for count in (40, 20, 5) for row in ("gap_mm", "swing_mm", "lag_deg")),
    *(f"{row}_{gravity}g" for gravity in (2, 5) for row in ("loss", "mass")),
    *(f"plug_energy_{amplitude}mm" for amplitude in (16, 20, 24, 30)),
    *(f"{row}_N{count}" for count in (30, 50) for row in ("peak_ratio", "peak_rms_mm")),
    *("impact_rms_mm", "plug_jump_mm", "late_by_early_N10"),
)
VALIDITY_ENDS = ("_exact", "_paper", "_wanted_low", "_wanted_high")
FIGURES = {
    "damper_rebound": {
        f"{error}{end}"
        for error in ("impact_error_ms", "apex_error_mm")
        for end in ("", "_dem", *(f"_{reading}" for reading in READINGS))
    },
    "damper_patterns": {
        *(
            f"{figure}_{end}"
            for end in FILLED
            for figure in (
                *("height_amplitude_mm", "height_lag_deg", "height_above_floor_mm"),
                *("floor_share_least", "floor_share_most"),
            )
        ),
        *(
            f"{figure}_N{count}"
            for count in (20, 40)
            for figure in ("amplitude_difference_mm", "lag_difference_deg", "height_difference_mm")
        ),
    },
    "damper_validity": {
        *(f"{row}{end}" for row in VALIDITY for end in ("", *VALIDITY_ENDS)),
        *("rows", "rows_met", "trusted_share_paper", "trusted_share_place"),
    },
    "damper_response": {
        f"{figure}_{label}_N{count}"
        for figure in ("peak_ratio", "peak_rms_mm")
        for label in ("dem", "ca_landing", "ca_ejection", "ca_static")
        for count in (10, 30)
    },
    "damper_cost": {
        *(f"longest_step_{label}" for label in ("dem", "ca_static", "ca_landing")),
        *(f"growth_{label}" for label in ("dem_pairs", "dem_cells", "ca_scan_1e-4")),
        *(f"cycle_ms_{label}_N50" for label in ("dem_pairs", "dem_cells", "ca_scan_2e-5")),
    },
    "cost_of_accuracy_damper": {
        *("cheapest_seconds_at_1_percent", "cheapest_method_at_1_percent"),
        *("seconds_at_0.1_percent", "chaos_floor", "distance_to_spheres_ca_static"),
        *(f"check_force_{label}" for label in ("ca_static", "ca_landing", "dem_tsuji", "dem_soft")),
    },
    "damper_measured_motion": {
        f"{figure}_{end}"
        for figure in ("rms_mm", "peak_mm", "damping_ratio")
        for end in ("empty", "dem_N30", "ca_place_N30")
    },
    "damper_maps": {
        f"{figure}_{label}"
        for figure in ("jump_ratio", "plateau_share", "largest_loss", "largest_loss_at_g")
        for label in ("dem", "ca_static")
    },
    "hard_cases": {"cases", "passed", "refused", "failed"},
    "demo_damper": {
        "amplitude_at_1g_mm",
        *(f"cycles_{one}_N{n}" for one in ("rigid", "ca_place", "dem") for n in (10, 30, 50)),
        *(
            f"decrement_{side}_{one}_N30"
            for side in ("above_12mm", "below_6mm")
            for one in ("rigid", "ca_place", "dem")
        ),
        *("cycles_rigid_N30_expected", *(f"cycles_N{n}_expected" for n in (10, 30, 50))),
        *(f"decrement_{side}_N30_expected" for side in ("above_12mm", "below_6mm")),
    },
}
FILES = {
    "damper_rebound": ("rebound.png", "heights.csv", "impacts.csv"),
    "damper_patterns": (
        *("patterns_20.png", "patterns_40.png", "cycle.png", "patterns.gif"),
        *("cycles.csv", "particles.csv"),
    ),
    "damper_validity": ("trust.png", "validity.csv", "trust.csv", "validity.md"),
    "damper_response": (
        *("response.png", "measures.png", "hysteresis.png", "peaks.csv", "response_dem.csv"),
        *("response_ca_static.csv", "sweep_up_ca_static.csv", "sweep_down_dem.csv"),
    ),
    "damper_cost": ("cost.png", "steps.png", "cost.csv", "steps.csv"),
    "cost_of_accuracy_damper": (
        *("work_precision.png", "against_spheres.png", "rk45.png", "curves.png"),
        *("points.csv", "points_against_spheres.csv", "points_empty.csv", "answers.csv"),
        "curves.csv",
    ),
    "damper_measured_motion": ("motion.png", "damping.png", "motion.csv", "damping.csv"),
    "damper_maps": (
        *("collect_and_collide.png", "maps.png", "weightless_dem.csv", "gravity_dem.csv"),
        *("weightless_ca_static.csv", "gravity_ca_static.csv"),
    ),
    "hard_cases": (
        "hard_cases.csv",
        "hard_cases_damper.png",
        "hard_cases_blast.png",
        "full_box.png",
    ),
    "demo_damper": (
        "damper.gif",
        "view.html",
        "decay.png",
        "decay.csv",
        "report.json",
        "caption.txt",
    ),
}

quick = quick_runs([name for name in NAMES if "damper" in name or name == "hard_cases"])


class TestQuickRun(QuickRun):
    figures, files = FIGURES, FILES


@pytest.fixture(scope="module")
def shown(quick_run):
    """``shown(name, *options)``: folder of a quick run, and its figures' values."""

    def run(name, *options):
        folder, done = quick_run(name, *options)
        assert done.returncode == 0, done.stderr
        figures = json.loads((folder / "summary.json").read_text())["figures"]
        return folder, {name: figure["value"] for name, figure in figures.items()}

    return run


@pytest.mark.slow
def test_rebound_stays_within_two_milliseconds_to_the_fourth_impact(shown):
    folder, figures = shown("damper_rebound")
    assert figures["impact_error_ms"] < 2.0
    assert figures["impact_error_ms_dem"] < 2.0
    # The readings differ, or comparing them would say nothing.
    assert figures["impact_error_ms_reset"] > 10.0
    assert figures["impact_error_ms_kept"] > 10.0
    # t_1 (1 + 2 e + 2 e^2 + 2 e^3) with t_1 = sqrt(2 h / g), h = 15 cells and e = 0.75.
    fourth = math.sqrt(2.0 * 0.09 / 10.0) * (1.0 + 2.0 * (0.75 + 0.75**2 + 0.75**3))
    rows = [row for row in rows_of(folder / "impacts.csv") if row["filling"] == "signed"]
    assert float(rows[3]["closed_form_s"]) == pytest.approx(fourth, rel=1e-12)
    assert float(rows[3]["closed_form_apex_m"]) == pytest.approx(0.09 * 0.75**8, rel=1e-12)
    late = abs(float(rows[3]["time_s"]) - fourth)
    assert late <= 1e-3 * figures["impact_error_ms"] * (1.0 + 1e-12)


@pytest.mark.slow
def test_rebound_error_falls_with_the_step(shown):
    # The blow falls one to two steps late, and a particle 1.5 dt late is 1.5 g dt too fast, which
    # lengthens the next flight by 2 e 1.5 dt: three blows make at most 3 (2 + 3 e) dt, plus the
    # scatter of the last by as much as a step.
    for dt in (1e-4, 2.5e-5):
        options = ("--ca-dt", dt) if dt != 1e-4 else ()
        _, figures = shown("damper_rebound", *options)
        assert figures["impact_error_ms"] <= 1e3 * dt * (3.0 * (2.0 + 3.0 * 0.75) + 1.0)


@pytest.mark.slow
def test_patterns_show_all_particles_inside_the_box(shown):
    folder, figures = shown("damper_patterns")
    rows = rows_of(folder / "particles.csv")
    across, up = (np.array([float(row[name]) for row in rows]) for name in ("across_mm", "up_mm"))
    # 32 frames of 20 and 40 particles in two fillings.
    assert len(rows) == 32 * 2 * (20 + 40)
    # Every other column of the lattice stands half a cell higher, and a flight may be a cell deep.
    assert across.min() > 0.0
    assert across.max() < 60.0
    assert up.min() > 0.0
    assert up.max() < 96.0 + 3.0
    # Thrown higher than the container moves, and never all on the floor.
    for end in FILLED:
        assert figures[f"floor_share_least_{end}"] < 0.05
        assert 10.0 < figures[f"height_amplitude_mm_{end}"] < 40.0


@pytest.mark.slow
def test_rules_of_place_agree_with_spheres(shown):
    """Rows that few seeds know well enough; the first edition is outside all of them."""
    _, figures = shown("damper_validity")
    rows = ("gap_mm_N40", "lag_deg_N40", "impact_rms_mm", "loss_2g", "plug_jump_mm")
    for row in rows:
        low, high = (figures[f"{row}_wanted_{end}"] for end in ("low", "high"))
        assert low <= figures[row] <= high, row
        assert not low <= figures[f"{row}_paper"] <= high, row
    # The grain's RMS of the closed form, to the share of a step that a blow may be late.
    assert figures["impact_rms_mm"] == pytest.approx(figures["impact_rms_mm_exact"], rel=0.01)


@pytest.mark.slow
def test_demo_counts_the_cycles_that_damping_takes(shown):
    """Let go at 30 mm, where nothing is detuned, both fillings are within 3 % of the figures."""
    _, figures = shown("demo_damper")
    for label in ("ca_place", "dem"):
        for count in (10, 30, 50):
            assert figures[f"cycles_{label}_N{count}"] == figures[f"cycles_N{count}_expected"]
        for side in ("above_12mm", "below_6mm"):
            found = figures[f"decrement_{side}_{label}_N30"]
            assert found == pytest.approx(figures[f"decrement_{side}_N30_expected"], rel=0.03)
    # The amplitude of a cycle with 6 g fixed, c + 1/2 cycles of the empty container after the
    # start, is 30.5 mm exp(-0.0721 (c + 1/2)): the weight of 6 g stretches the spring by 0.48 mm.
    sag, loss = 6e-3 * 9.8 / 123.4, 0.08 / (2.0 * 92e-3) / math.sqrt(123.4 / 86e-3) * 2.0 * math.pi
    exact = math.log((30.0 + 1e3 * sag) / 10.0) / loss
    assert abs(figures["cycles_rigid_N30"] - exact) <= 0.5


@pytest.mark.slow
def test_demo_without_particles_is_the_empty_container(shown):
    folder, figures = shown("demo_damper", "--particles", "0")
    for row in rows_of(folder / "decay.csv"):
        empty, *others = (float(row[f"amplitude_mm_{one}_N0"]) for one in ("rigid", "ca_place"))
        assert others == pytest.approx([empty], rel=1e-9)
    assert figures["cycles_ca_place_N0"] == figures["cycles_rigid_N0"]


@pytest.mark.slow
def test_cost_of_accuracy_knows_its_reference_and_names_what_diverged(shown):
    folder, figures = shown("cost_of_accuracy_damper")
    # The motion by the measured force must be the motion measured; the sums take x at n points a
    # cycle, which misses its change over the cycles by their n-th part.
    for label in ("ca_static", "ca_landing", "dem_tsuji", "dem_soft"):
        assert figures[f"check_force_{label}"] < 1e-3
    points = {(row["method"], row["label"]): row for row in rows_of(folder / "points.csv")}
    assert points["dem_tsuji", "100 µs"]["failure"] == "diverged"
    assert points["ca_static", "2 ms"]["failure"] == "refused"
    assert points["ca_static", "2 ms"]["error"] == ""
    # 30 particles, 3 frequencies, 2 seeds, 20 cycles of 1 / (f dt) steps.
    ratios = np.array([0.95, 0.98, 1.0])
    steps = np.ceil(1.0 / (ratios * math.sqrt(123.4 / 0.086) / (2.0 * math.pi) * 2e-4)).sum()
    assert float(points["ca_static", "200 µs"]["evaluations"]) == 30 * 2 * 20 * steps
    # The reference is kept and used again.
    assert len(list((folder / "references").glob("*.json"))) == 4


@pytest.mark.slow
def test_no_hard_case_of_the_quick_run_fails(shown):
    folder, figures = shown("hard_cases")
    rows = rows_of(folder / "hard_cases.csv")
    assert figures["failed"] == 0, [row["words"] for row in rows if row["status"] == "failed"]
    assert figures["passed"] + figures["refused"] == len(rows)
    assert {"value", "bound", "margin", "formula", "words"} <= set(rows[0])


def test_impacts_are_found_between_samples():
    fall = Fall(height=0.09, restitution=0.75, gravity=10.0)
    # Samples of the closed form itself; the times are none of its impacts.
    time = np.arange(0.0, 0.7, 1.7e-3)
    starts = np.array([-fall.first_s, *(fall.impact_s(k) for k in range(1, 8))])
    flight = np.searchsorted(starts, time, side="right") - 1
    speed = 10.0 * (fall.first_s * 0.75**flight - (time - starts[flight]))
    mass, height = 2e-4, fall.heights(time)
    history = {
        "time_s": time,
        "force": np.zeros(len(time)),
        "momentum": mass * speed,
        "energy": mass * (0.5 * speed**2 + 10.0 * height),
    }
    late, high = RecordedFall.of(history, fall, mass).errors(4)
    # Two parabolas cross where they do: nothing but rounding, 1e-16 over speeds near 1 m/s.
    assert np.abs(late).max() < 1e-12
    # The highest sample misses the apex by g (half a sample)^2 / 2 at most.
    assert np.abs(high).max() <= 0.5 * 10.0 * (0.5 * 1.7e-3) ** 2


@pytest.mark.slow
def test_particle_that_comes_to_rest_early_is_compared_as_far_as_it_bounced(shown):
    # The second apex, 0.09 x 0.5^4 m = 5.6 mm, lies within the lowest cell: held there.
    _, figures = shown("damper_rebound", "--restitution", "0.5")
    # Two blows, by the bound of the test above with e = 0.5.
    assert figures["impact_error_ms"] <= 0.1 * (2.0 * (2.0 + 3.0 * 0.5) + 1.0)


def test_harmonic_gives_amplitude_and_lag():
    phase = np.arange(32) * 52 / 1667
    lag = np.radians(47.0)
    values = 3.0 + 2.0 * np.sin(2.0 * np.pi * phase - lag)
    amplitude, degrees = first_harmonic(phase, values)
    assert amplitude == pytest.approx(2.0, rel=1e-12)
    assert degrees == pytest.approx(47.0, rel=1e-12)


def test_box_of_the_automaton_is_staggered_and_moves_by_cells():
    box = plot.Box.of_automaton(paper())
    plain = plot.Box.of_spheres(Spheres())
    assert (plot.Box.of(paper()), plot.Box.of(Spheres())) == (box, plain)
    assert (box.width, box.height) == pytest.approx((plain.width, plain.height), rel=1e-12)
    displaced = np.array([-0.0031, -0.0029, 0.0, 0.0029, 0.0031])
    assert box.lift(displaced) == pytest.approx([-6e-3, 0.0, 0.0, 0.0, 6e-3], abs=1e-15)
    assert np.array_equal(plain.lift(displaced), displaced)
    # Lowest and highest cells of the first two columns, as the lattice places them.
    lattice = Geometry(10, 16)
    cells = [lattice.cell_of(*place) for place in ((0, 0), (1, 0), (0, 15), (1, 15))]
    below, above = box.gaps(lattice.centres(6e-3)[cells])
    assert below == pytest.approx([0.0, 0.0, 0.09, 0.09], abs=1e-15)
    assert above == pytest.approx([0.09, 0.09, 0.0, 0.0], abs=1e-15)
    # A closed line around 10 x 16 cells: area by the shoelace formula.
    for one in (box, plain):
        x, y = one.outline().T
        area = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
        assert area == pytest.approx(60e-3 * 96e-3, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("damper_rebound", ("--dt", "2e-4")),
        ("damper_patterns", ("--dt", "2e-4")),
        ("demo_damper", ("--filling", "spheres", "--dt", "2e-4")),
    ],
)
def test_spheres_beyond_their_limit_end_as_diverged(tmp_path, name, options):
    done = start(name, "--quick", "--out", tmp_path, *options)
    assert done.returncode == 3, done.stderr
    # One particle is outside the range of the paper's rules, as a line before it says.
    *_, last = done.stderr.splitlines()
    assert len(done.stderr.splitlines()) == (2 if name == "damper_rebound" else 1)
    for word in ("diverged by step", "dt must be at most", "was 0.0002 s"):
        assert word in last
    # A step of which a contact at the speed of a fall through the box has five.
    advised = float(re.search(r"dt must be at most ([0-9.e-]+) s", done.stderr).group(1))
    assert advised == Spheres().safe_step()
    assert not (tmp_path / "summary.json").exists()


@pytest.mark.slow
def test_peaks_are_found_to_an_accuracy(shown, quick_run):
    """30 grains of 0.2 g as a rigid mass peak at sqrt(86 / 92) f0; bars are as narrow as asked."""
    options = "--accuracy 5% --fillings ca_static --particles 30".split()
    folder, figures = shown("damper_response", *options)
    for name, unit in (("ratio", ""), ("rms", "_mm")):
        value, error = (figures[f"peak_{name}{e}{unit}_ca_static_N30"] for e in ("", "_error"))
        assert 0.0 < error <= 0.05 * value
    assert figures["peak_ratio_ca_static_N30"] == pytest.approx((86.0 / 92.0) ** 0.5, abs=0.01)
    assert len((folder / "accuracy.csv").read_text().splitlines()) == 3
    # The fixture keeps the run.
    said = quick_run("damper_response", *options)[1].stdout
    assert said.count("5 % was reached") == 2 and said.count("10 %: ") == 2


def test_the_record_in_the_repository_is_that_of_its_formula():
    time, pull = record()
    lines = RECORD.read_text().splitlines()
    assert [line for line in lines if line[0] == "#"] == HEADER.splitlines()
    read = np.array([line.split(",") for line in lines[len(HEADER.splitlines()) + 1 :]], float)
    assert read.T == pytest.approx(np.stack([time, pull]), abs=5.1e-6)
    assert RECORD.stat().st_size < 60_000


@pytest.mark.slow
def test_grains_damp_a_measured_motion_alike_by_spheres_and_by_automaton(shown):
    _, figures = shown("damper_measured_motion")
    assert figures["damping_ratio_empty"] == pytest.approx(0.01228, abs=1e-5)
    for label in ("dem", "ca_place"):
        assert figures[f"rms_mm_{label}_N30"] < 0.85 * figures["rms_mm_empty"]
        assert figures[f"damping_ratio_{label}_N30"] > 1.5 * figures["damping_ratio_empty"]


BAD_OPTIONS = [
    ("damper_measured_motion", ("--scale", "-1"), ("--scale", "'-1'")),
    ("damper_measured_motion", ("--record", "nowhere.csv"), ("nowhere.csv", "can be read")),
    ("damper_rebound", ("--restitution", "1.2"), ("--restitution", "'1.2'", "(0.3, 1)")),
    ("damper_rebound", ("--restitution", "nan"), ("--restitution", "'nan'")),
    ("damper_rebound", ("--dt", "0"), ("--dt", "'0'")),
    ("damper_rebound", ("--ca-dt", "2e-3"), ("dt", "0.0012", "0.002")),
    ("damper_rebound", ("--dt", "0.1"), ("dt", "0.1", "10 Hz")),
    ("damper_rebound", ("--driver", "auto"), ("--driver",)),
    ("damper_patterns", ("--accounting", "magic"), ("--accounting", "magic", "all")),
    ("damper_patterns", ("--amplitude", "-1"), ("--amplitude", "'-1'", "(0, 100)")),
    ("damper_patterns", ("--frequency", "nan"), ("--frequency", "'nan'")),
    ("damper_patterns", ("--seeds", "0"), ("--seeds", "'0'", "1 to")),
    ("damper_patterns", ("--dt", "0.1"), ("dt", "0.1")),
    ("damper_patterns", ("--driver", "auto"), ("--driver",)),
    ("demo_damper", ("--particles", "161"), ("--particles", "'161'", "0 to 160")),
    ("demo_damper", ("--particles", "-1"), ("--particles", "'-1'")),
    ("demo_damper", ("--filling", "dust"), ("--filling", "dust", "spheres")),
    ("demo_damper", ("--effects", "some"), ("--effects", "some", "listed, auto")),
    ("demo_damper", ("--amplitude", "inf"), ("--amplitude", "'inf'")),
    ("demo_damper", ("--amplitude", "10"), ("--amplitude", "'10'", "(20, 100)")),
    ("demo_damper", ("--dt", "2e-3"), ("dt", "0.0012")),
    ("cost_of_accuracy_damper", ("--methods", "dust"), ("--methods",)),
    ("hard_cases", ("--only", "dust"), ("dust", "case must be one of")),
    ("hard_cases", ("--columns", "0"), ("--columns", "'0'", "1 to")),
    ("demo_damper", ("--threads", "0"), ("--threads", "'0'")),
    ("damper_response", ("--resume",), ("resume", "no checkpoint")),
    ("damper_response", ("--checkpoint-every", "-1"), ("--checkpoint-every", "'-1'", "600s")),
]


@pytest.mark.parametrize(("name", "options", "words"), BAD_OPTIONS)
def test_bad_option_is_one_sentence(main, capsys, tmp_path, name, options, words):
    folder = tmp_path / "out"
    code = main(name, ["--quick", *options, "--out", folder])
    assert_refused(code, capsys.readouterr(), folder, *words)


@pytest.mark.parametrize("name", ["damper_rebound", "damper_patterns", "demo_damper"])
def test_folder_below_a_file_is_refused_before_anything_runs(main, capsys, tmp_path, name):
    (tmp_path / "file").write_text("x")
    folder = tmp_path / "file" / "out"
    code = main(name, ["--quick", "--out", folder])
    assert_refused(code, capsys.readouterr(), folder, str(folder), "writable")
