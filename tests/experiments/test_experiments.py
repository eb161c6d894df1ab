"""Every experiment of blasting with --quick, and what each refuses."""

import json
import math
import os
import re
import signal

import numpy as np
import pytest
from PIL import Image

from taichi_dem import CONCRETE, PAPER_BLOCK
from taichi_dem.mesh import shapes as mesh_shapes
from taichi_dem.mesh.files import read_mesh, write_mesh
from taichi_dem.plot.film import write_mp4
from tests.experiments.contract import (
    NAMES,
    QuickRun,
    assert_refused,
    quick_runs,
    rows_of,
    start,
)

HISTORY = (
    "time_s,hole_radial_displacement_mm,monitor_displacement_mm,broken_faces,kinetic_J,"
    "bond_strain_J,sphere_strain_J,gas_work_J,bond_dashpot_J,softening_J,release_J,slip_J,"
    "sphere_dashpot_J,friction_J,injected_J,residual_J,smallest_step_s"
).split(",")
FIGURES = {
    "blast_fracture": {
        "hole_radial_displacement_mm",
        "monitor_displacement_mm",
        "broken_faces",
        "ledger_residual_fraction",
        "linear_momentum_error",
        "angular_momentum_error",
        "smallest_step_s",
        "contact_evaluations",
        "seconds_per_simulated_ms",
    },
    "trust": {
        *("numbers", "numbers_that_hold", "rotation_spin_value", "rotation_spin_error_percent"),
        *("bar_wave_20_value", "bar_wave_20_error_percent", "bar_wave_20_published"),
    },
    "blast_methods": {
        f"{what}_{method}"
        for method in ("explicit_limited", "implicit")
        for what in (
            *("seconds", "displacement_error", "broken_faces", "ledger_residual_fraction"),
            "largest_stable_step_s",
        )
    },
    "blast_multirate": {
        f"{method}_{instant}_{what}"
        for method in ("multirate_held", "multirate_drifted")
        for instant in ("early", "late")
        for what in (
            *("cpu_s", "evaluations", "displacement_mm", "displacement_difference"),
            *("ideal_gain", "boundary_gain", "realised_gain"),
        )
    },
    "blast_sweeps": {
        f"sweeps_{way}_{tolerance}"
        for way in ("gauss_seidel", "jacobi", "momentum")
        for tolerance in ("0.05", "0.01", "0.001")
    },
    "blast_block": {
        *("tetrahedra", "broken_faces", "ppv_exponent", "ms_a_step", "seconds_per_simulated_ms"),
        *("memory_MB", "fields_MB", "ledger_residual_fraction", "linear_momentum_error"),
    },
    "blast_ensemble": {
        *("members", "failed_members", "faces_in_all", "faces_in_some", "broken_faces_mean"),
        *("broken_faces_sd", "hole_displacement_mean_mm", "hole_displacement_sd_mm"),
    },
    "blast_scaling": {
        *("imbalance_24_static", "imbalance_24_rebalanced", "imbalance_24_polyline"),
        *("speedup_24_simulated", "speedup_24_static", "speedup_24_due", "speedup_2_threads"),
    },
    "cost_of_effects": {
        *("overhead_absent_percent", "blast_seconds"),
        *(
            f"{effect}_{what}"
            for effect in ("sphere_contact", "friction")
            for what in ("seconds", "memory_MB", "compiled_kB", "displacement_change_percent")
        ),
        *(f"friction_step{end}_percent" for end in ("", "_low", "_high")),
        "spheres_friction_of_spheres_seconds",
        *("auto_overhead_percent", "fracture_evaluations_ratio", "asleep_percent"),
    },
    "cost_of_accuracy_blast": {
        *("cheapest_seconds_at_1_percent", "cheapest_method_at_1_percent"),
        *("seconds_at_0.1_percent", "chaos_floor", "reference_check"),
        *(f"seconds_at_1_percent_{name}" for name in ("multirate_held", "limited", "implicit")),
    },
    "accuracy_on_request": {
        *("price_ratio_median", "price_ratio_worst", "coverage_percent", "answers"),
        *("seconds_at_1_percent_blast", "seconds_at_1_percent_damper", "hole_later_mm"),
    },
    "demo_fracture_law": {"peak_MPa_error", "failure_opening_um_error", "energy_J_m2_error"},
    "demo_wave_and_spall": {"wave_speed_m_s", "free_end_over_wave", "spall_1.5_depth_m"},
    "demo_step_too_large": {"limit_dashpots_s", "dashpots_0.9_diverged", "dashpots_1.3_diverged"},
    "demo_multirate": {"uniform_evaluations", "held_fewer_evaluations", "held_difference"},
    "demo_sleeping": {
        *("tetrahedra", "speedup_by_sleep", "error_by_sleep_percent", "asleep_percent"),
        *("left_out_impulse", "audit_misses"),
    },
}
FILES = {
    "trust": ("trust.csv", "trust.md", "bar_wave.png", "rotation.png"),
    "blast_fracture": (
        *("history.csv", "mesh.msh", "report.json", "bonds.csv", "bodies.csv", "pressure.csv"),
        *("pressure.png", "cracks.png", "energy.png", "history.png", "acting.png"),
        *("blast.gif", "view.html", "paraview/{folder}.pvd", "paraview/{folder}_0000.vtu"),
    ),
    "blast_methods": (*("methods.csv", "methods.png", "history_reference.csv"),),
    "blast_multirate": (
        *("comparison.csv", "uniform.csv", "multirate_held.csv", "multirate_drifted.csv"),
        *("levels_multirate_held.png", "levels_multirate_drifted.png", "methods.png"),
    ),
    "blast_sweeps": ("sweeps.csv", "sweeps.png"),
    "blast_block": (
        *("cracks.png", "peaks.png", "energy.png", "peaks.csv", "history.csv", "mesh.msh"),
        *("paraview/{folder}.pvd", "checkpoint.npz"),
    ),
    "blast_ensemble": (
        *("probability.png", "displacement.png", "probability.csv", "displacement.csv"),
        *("members.csv", "caption.txt"),
    ),
    "blast_scaling": ("scaling.png", "scaling.csv", "shares.csv"),
    "cost_of_effects": ("effects.png", "blast.csv", "damper.csv", "lists.csv"),
    "cost_of_accuracy_blast": (
        *("work_precision.png", "errors.png", "points.csv", "runs.csv", "answers.csv"),
    ),
    "accuracy_on_request": ("cost.png", "calibration.png", "twins.png", "prices.csv", "bars.csv"),
    "demo_fracture_law": ("law.gif", "law.png", "tension.csv", "shear.csv", "caption.txt"),
    "demo_wave_and_spall": (
        *("spall.gif", "wave.png", "spall.png", "wave.csv", "spall.csv", "caption.txt"),
    ),
    "demo_step_too_large": ("shaken.gif", "energy.png", "steps.csv", "caption.txt"),
    "demo_multirate": ("blow.gif", "blow.png", "blow.csv", "levels_held.csv", "caption.txt"),
    "demo_sleeping": ("sleeping.png", "sleeping.csv", "caption.txt"),
}


quick = quick_runs(
    [
        name
        for name in NAMES
        if "blast" in name or name in ("cost_of_effects", "accuracy_on_request")
    ]
)


class TestQuickRun(QuickRun):
    figures, files = FIGURES, FILES


@pytest.fixture(scope="module")
def shown(quick_run):
    """``shown(name)``: folder of a quick run, and its figures' values."""

    def run(name):
        folder, done = quick_run(name)
        assert done.returncode == 0, done.stderr
        figures = json.loads((folder / "summary.json").read_text())["figures"]
        return folder, {key: figure["value"] for key, figure in figures.items()}

    return run


@pytest.mark.slow
def test_the_displacement_of_the_hole_is_found_to_an_accuracy(quick_run):
    """The answer, its bar and its price, and no files of a run that nobody asked for."""
    folder, done = quick_run("blast_fracture", "--accuracy", "2%")
    assert done.returncode == 0 and done.stderr == "", done.stderr
    figures = json.loads((folder / "summary.json").read_text())["figures"]
    value, error = (figures[f"hole_displacement{e}_mm"]["value"] for e in ("", "_error"))
    assert 0.0 < error <= 0.02 * value and figures["accuracy_reached"]["value"] == 1
    assert "blast, 8e-05 s, hole displacement: " in done.stdout
    for words in ("+-", "2 % was reached", "10 %: ", "0.3 %: ", "s measured"):
        assert words in done.stdout
    (row,) = rows_of(folder / "accuracy.csv")
    assert float(row["value"]) == value and row["reached"] == "True"
    assert sorted(path.name for path in folder.iterdir()) == [
        *("accuracy.csv", "cracks.png", "summary.json"),
    ]


@pytest.mark.slow
def test_a_block_without_a_hole_is_asked_for_its_kinetic_energy(tmp_path):
    """Of free fall: m (g t)^2 / 2."""
    mesh = mesh_shapes.bar(0.1, 0.05, (3, 2, 2))
    write_mesh(tmp_path / "bar.msh", mesh)
    options = "--without gas_pressure --with gravity --quick --accuracy 1%".split()
    out = tmp_path / "out"
    done = start("blast_fracture", "--mesh", tmp_path / "bar.msh", "--out", out, *options)
    assert done.returncode == 0, done.stderr
    figures = json.loads((out / "summary.json").read_text())["figures"]
    mass = 0.1 * 0.05**2 * CONCRETE.density
    wanted = 0.5 * mass * (9.81 * 8e-5) ** 2
    assert figures["kinetic_energy_J"]["value"] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.slow
def test_bond_on_the_bench_follows_its_law(shown):
    _, figures = shown("demo_fracture_law")
    # 84 um of way in 1000 samples: the peak may lie between two, the failure is seen one late.
    sample = (22.0 + 26.0 + 36.0) / 1000
    assert -sample / 14.80 <= figures["peak_MPa_error"] <= 1e-9
    assert -1e-9 <= figures["failure_opening_um_error"] <= sample / 29.93
    # Trapezoids cut the corner at the peak, where the slope changes by 450 + 440 GPa/m.
    assert abs(figures["energy_J_m2_error"]) <= 890e9 * (1e-6 * sample) ** 2 / 8 / 99.67 + 1e-9
    # Openings are known to 8 eps of 0.8 m, the bench's size.
    for pressure in (0, 5, 10, 15):
        assert abs(figures[f"plateau_at_{pressure}_MPa_error"]) < 1e-9


@pytest.mark.slow
def test_bars_spall_within_a_cell_of_the_formula(shown):
    _, figures = shown("demo_wave_and_spall")
    assert abs(figures["spall_1.5_error_cells"]) <= 1.0
    assert abs(figures["spall_2_error_cells"]) <= 1.0
    # Dispersion (k h)^2 / 24 of a pulse of 0.76 m, and the depth of the last cell's middle.
    dispersion = (2.0 * math.pi * 0.1 / 0.76) ** 2 / 24.0
    assert 2.0 * (1.0 - 4.0 * dispersion) < figures["free_end_over_wave"] < 2.0 + 2.0 * dispersion


@pytest.mark.slow
def test_step_beyond_the_limit_diverges_and_says_so_word_for_word(shown):
    folder, figures = shown("demo_step_too_large")
    assert figures["dashpots_0.9_diverged"] == 0
    assert figures["dashpots_1.3_diverged"] == 1
    assert figures["dashpots_0.9_unexplained"] < 0.01
    # Half of the energy given is what the divergence check lets pass.
    assert figures["dashpots_1.3_unexplained"] > 0.5
    sentence = rows_of(folder / "steps.csv")[1]["sentence"]
    assert sentence.startswith("diverged at t = ")
    assert re.search(r"bond dashpots (of body \d+ beside it )?allow", sentence)
    assert sentence in (folder / "caption.txt").read_text()


@pytest.mark.slow
def test_multirate_gives_the_same_answer_for_fewer_evaluations(shown):
    _, figures = shown("demo_multirate")
    assert figures["held_fewer_evaluations"] > 3.0
    assert figures["held_difference"] < 2e-3


@pytest.mark.slow
def test_sleep_saves_time_and_changes_next_to_nothing(shown):
    folder, figures = shown("demo_sleeping")
    assert figures["audit_misses"] == 0 and figures["left_out_impulse"] <= 1e-6
    # A share of 1e-6 of the impulse moves nothing by more than some of that.
    assert figures["error_by_sleep_percent"] < 1e-2
    assert figures["asleep_percent"] > 50.0
    rows = rows_of(folder / "sleeping.csv")
    slept = [row for row in rows if row["run"] == "asleep"]
    assert all(float(row["awake_m"]) >= float(row["front_m"]) for row in slept)


def test_film_is_written_as_mp4_where_ffmpeg_is_found(tmp_path, monkeypatch):
    images = [Image.new("RGB", (40, 30), colour) for colour in ("red", "blue")]
    monkeypatch.setenv("PATH", "")
    assert not write_mp4(tmp_path / "none.mp4", images, 100)
    # A program of that name that keeps what it is given: two frames of 40 x 30 x 3 bytes.
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert write_mp4(tmp_path / "film.mp4", images, 100)
    assert (tmp_path / "film.mp4").stat().st_size == 2 * 40 * 30 * 3
    assert not list(tmp_path.glob(".*part*"))


@pytest.fixture(scope="module")
def blast(tmp_path_factory):
    """A very short run of the main job, in a process of its own: (folder, finished process)."""
    folder = tmp_path_factory.mktemp("blast")
    options = ("--until", "2e-6", "--frames", "2", "--samples", "4", "--out", folder)
    return folder, start("blast_fracture", *options)


@pytest.mark.slow
def test_history_has_the_columns_in_order(blast):
    folder, done = blast
    assert done.returncode == 0, done.stderr
    rows = rows_of(folder / "history.csv")
    assert list(rows[0])[: len(HISTORY)] == HISTORY
    assert len(rows) == 5
    assert all(math.isfinite(float(value)) for row in rows for value in row.values())
    assert float(rows[-1]["time_s"]) == pytest.approx(2e-6, rel=1e-12)
    # The mesh used is written to 17 digits and reads back as it was.
    read, used = read_mesh(PAPER_BLOCK), read_mesh(folder / "mesh.msh")
    assert np.array_equal(read.points, used.points)
    assert np.array_equal(read.tetrahedra, used.tetrahedra)


@pytest.mark.slow
def test_a_run_with_several_levels_shows_them(tmp_path):
    options = ("--method", "multirate", "--until", "6e-5", "--frames", "2", "--samples", "4")
    done = start("blast_fracture", *options, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    shares = [
        [float(v) for k, v in row.items() if k != "time_s"]
        for row in rows_of(tmp_path / "levels.csv")
    ]
    assert len(shares[-1]) > 1
    assert all(sum(row) == pytest.approx(1.0, rel=1e-12) for row in shares)
    assert (tmp_path / "steps.png").is_file() and (tmp_path / "levels.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options", "history"),
    [
        ("blast_fracture", ("--method", "fixed"), "history.csv"),
        ("blast_multirate", ("--l", "1e-3", "--until", "2e-5"), "history_uniform.csv"),
    ],
)
def test_diverging_run_names_body_and_step_and_keeps_the_last_good_output(
    tmp_path, name, options, history
):
    done = start(name, *options, "--dt0", "1e-6", "--out", tmp_path)
    assert done.returncode == 3, done.stderr
    assert len(done.stderr.splitlines()) == 1
    for word in ("diverged at t = ", "body ", "level ", "try a step of "):
        assert word in done.stderr
    rows = rows_of(tmp_path / history)
    assert list(rows[0])[: len(HISTORY)] == HISTORY
    assert all(math.isfinite(float(value)) for row in rows for value in row.values())
    assert not (tmp_path / "summary.json").exists()


class CtrlC:
    """Stands for the progress bar, and for a user who presses Ctrl-C while it runs."""

    def __init__(self, title):
        self.calls = 0

    def __enter__(self):
        return self

    def __call__(self, progress):
        self.calls += progress.phase == "running"
        if self.calls == 2:
            os.kill(os.getpid(), signal.SIGINT)

    def __exit__(self, *_):
        pass


@pytest.mark.slow
def test_interrupted_blast_goes_on_to_the_same_files(script, monkeypatch, capsys, tmp_path):
    module = script("blast_fracture")
    from taichi_dem.kit import study

    monkeypatch.setattr(module, "picture", lambda result, folder: None)
    quick = ["--quick", "--threads", "2", "--method", "fixed", "--until", "4e-5"]
    quick += ["--without", "sphere_contact,friction", "--checkpoint-every", "500steps"]

    def run(folder, *more):
        given = [*quick, "--out", str(tmp_path / folder), *more]
        return study.main(module.run, module.options_parser(), given), capsys.readouterr().err

    assert run("straight") == (0, "")
    with monkeypatch.context() as patched:
        patched.setattr("taichi_dem.kit.progress.progress_bar.ProgressBar", CtrlC)
        code, said = run("stopped")
    path = tmp_path / "stopped" / "checkpoint.npz"
    assert code == 130
    assert re.fullmatch(rf"interrupted at t = \S+ s, saved in {path}: go on with --resume\n", said)
    assert os.listdir(path.parent) == [path.name]
    assert run("stopped", "--resume") == (0, "")
    for name in ("history.csv", "bonds.csv", "mesh.msh", "paraview/{folder}_0006.vtu"):
        files = [tmp_path / k / name.format(folder=k) for k in ("stopped", "straight")]
        assert files[0].read_bytes() == files[1].read_bytes()


@pytest.fixture
def bad_mesh(tmp_path):
    """Writes a file that is refused as the blast's mesh; returns its path."""

    def write(kind):
        path = tmp_path / f"{kind}.msh"
        if kind == "no_hole":
            write_mesh(path, mesh_shapes.bar(0.2, 0.1, (2, 1, 1)))
        elif kind == "triangle":
            head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
            nodes = "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
            path.write_text(f"{head}{nodes}$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n")
        elif kind == "text":
            path.write_text("this is no mesh\n")
        return path

    return write


BAD_OPTIONS = [
    (("--without", "dust"), ("'dust'", "softening")),
    (("--with", "gravity,thunder"), ("'thunder'", "gravity")),
    (("--without", "sphere_contact"), ("friction", "SphereContact")),
    (("--l", "-1"), ("--l", "'-1'", "(0, 1)")),
    (("--dt0", "0"), ("--dt0", "'0'")),
    (("--until", "nan"), ("--until", "'nan'", "(0, 1)")),
    (("--until", "inf"), ("--until", "'inf'")),
    (("--frames", "0"), ("--frames", "'0'", "1 to")),
    (("--samples", "many"), ("--samples", "'many'")),
    (("--method", "magic"), ("--method", "magic", "multirate_drifted")),
    (("--driver", "bus"), ("--driver", "bus", "resident")),
    (("--threads", "0"), ("--threads", "'0'")),
    (("--colour", "red"), ("--colour",)),
    (("--l", "1e-7"), ("l must be left out", "multirate", "1e-07")),
    (("--unti", "1e-6", "--l", "1e-7"), ("--unti",)),
    (("--checkpoint-every", "3hours"), ("--checkpoint-every", "600s", "'3hours'")),
    (("--checkpoint-every", "1.5steps"), ("--checkpoint-every", "'1.5steps'")),
    (("--checkpoint-every", "0s"), ("--checkpoint-every", "'0s'")),
    (("--checkpoint-every", "1e999sim"), ("--checkpoint-every", "'1e999sim'")),
    (("--resume",), ("cannot read checkpoint", "checkpoint.npz", "No such file")),
]


@pytest.mark.parametrize(("options", "words"), BAD_OPTIONS)
def test_bad_option_is_one_sentence(main, capsys, tmp_path, options, words):
    folder = tmp_path / "out"
    code = main("blast_fracture", [*options, "--out", folder])
    assert_refused(code, capsys.readouterr(), folder, *words)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("no_hole", ("hole", "left")),
        ("triangle", ("no tetrahedra", "triangle")),
        ("text", ("cannot be read",)),
        ("missing", ("does not exist",)),
    ],
)
@pytest.mark.parametrize("name", ["blast_fracture", "blast_multirate"])
def test_bad_mesh_is_one_sentence(main, capsys, tmp_path, bad_mesh, name, kind, words):
    folder = tmp_path / "out"
    code = main(name, ["--mesh", bad_mesh(kind), "--out", folder])
    assert_refused(code, capsys.readouterr(), folder, *words)


@pytest.mark.parametrize("name", ["blast_fracture", "blast_multirate"])
def test_folder_below_a_file_is_refused_before_anything_runs(main, capsys, tmp_path, name):
    (tmp_path / "file").write_text("x")
    folder = tmp_path / "file" / "out"
    code = main(name, ["--until", "1e-3", "--out", folder])
    assert_refused(code, capsys.readouterr(), folder, str(folder), "writable")


@pytest.mark.parametrize("name", ["blast_fracture", "blast_multirate"])
def test_empty_folder_name_is_refused(main, capsys, name):
    code = main(name, ["--out", ""])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err == "output folder must be the name of a folder, got ''\n"


@pytest.mark.parametrize(
    "options", [("--arch", "cuda"), ("--arch", "tpu"), ("--l", "-1"), ("--mesh", "none.msh")]
)
def test_bad_input_from_a_shell_is_one_line(tmp_path, options):
    if options[1] == "cuda" and os.path.exists("/dev/nvidia0"):
        pytest.skip("this machine has a CUDA device")
    folder = tmp_path / "out"
    done = start("blast_fracture", *options, "--out", folder)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr
    assert not folder.exists()
