"""Every experiment of blasting with --quick, and what each refuses."""

import math
import os

import numpy as np
import pytest

from taichi_dem import mesh_shapes
from taichi_dem.mesh_files import read_mesh, write_mesh
from tests.experiments.contract import (
    FOLDER,
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
    "blast_multirate": {
        f"{method}_{instant}_{what}"
        for method in ("multirate_held", "multirate_drifted")
        for instant in ("early", "late")
        for what in (
            *("cpu_s", "evaluations", "displacement_mm", "displacement_difference"),
            *("ideal_gain", "boundary_gain", "realised_gain"),
        )
    },
    "cost_of_accuracy_blast": {
        *("cheapest_seconds_at_1_percent", "cheapest_method_at_1_percent"),
        *("seconds_at_0.1_percent", "chaos_floor", "reference_check"),
        *(f"seconds_at_1_percent_{name}" for name in ("multirate_held", "limited", "implicit")),
    },
}
FILES = {
    "blast_fracture": (
        *("history.csv", "mesh.msh", "report.json", "bonds.csv", "bodies.csv", "pressure.csv"),
        *("pressure.png", "cracks.png", "steps.png", "energy.png", "history.png", "levels.png"),
        *("levels.csv", "blast.gif", "paraview/blast.pvd", "paraview/blast_0000.vtu"),
    ),
    "blast_multirate": (
        *("comparison.csv", "uniform.csv", "multirate_held.csv", "multirate_drifted.csv"),
        *("levels_multirate_held.png", "levels_multirate_drifted.png", "methods.png"),
    ),
    "cost_of_accuracy_blast": (
        *("work_precision.png", "errors.png", "points.csv", "runs.csv", "answers.csv"),
    ),
}


quick = quick_runs([name for name in NAMES if "blast" in name])


class TestQuickRun(QuickRun):
    figures, files = FIGURES, FILES


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
    read, used = read_mesh(FOLDER / "meshes" / "paper_block.msh"), read_mesh(folder / "mesh.msh")
    assert np.array_equal(read.points, used.points)
    assert np.array_equal(read.tetrahedra, used.tetrahedra)


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
    (("--unti", "1e-6", "--l", "1e-7"), ("--unti",)),
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
