"""Experiments in a user's shell: JSON alone, Ctrl-C and going on again."""

import json
import os
import re
import signal
import subprocess
import time

import pytest

import blast_fracture
from taichi_dem.kit import study
from tests.experiments.contract import command
from tests.processes import phases_of, run_in_terminal, users_environment

pytestmark = pytest.mark.experiment

#: The quick run of this one takes a few seconds.
SMALLEST = "stable_or_not"


def test_json_is_the_summary_alone_and_the_bar_stays_on_the_terminal(tmp_path):
    folder = tmp_path / "out"
    with open(tmp_path / "said", "w") as file:
        line = [*command(SMALLEST, "--quick", "--out", folder), "--json"]
        seen = run_in_terminal(line, stdout=file)
    assert seen.returncode == 0 and "compiling" in seen.text
    # The bar was erased, and the cursor is shown again.
    assert seen.raw.count("\x1b[?25l") == seen.raw.count("\x1b[?25h") > 0
    said = (tmp_path / "said").read_text()
    assert said == (folder / "summary.json").read_text() + "\n"
    assert json.loads(said)["experiment"] == SMALLEST


def test_a_blast_with_its_pictures_imports_neither_scipy_nor_pandas(tmp_path):
    python, *line = command("blast_fracture", "--quick", "--until", "4e-5", "--out", tmp_path)
    line = [python, "-X", "importtime", *line]
    done = subprocess.run(line, capture_output=True, text=True, env=users_environment())
    assert done.returncode == 0 and (tmp_path / "cracks.png").is_file()
    imported = {said.split()[-1] for said in done.stderr.splitlines() if "import time:" in said}
    assert "matplotlib" in imported and not {"scipy", "pandas"} & imported


class CtrlC:
    """Stands for the progress bar, and for a user who presses Ctrl-C while it runs."""

    def __init__(self, title):
        self.calls = 0

    def __enter__(self):
        return self

    def __call__(self, progress):
        self.calls += progress.phase == "stepping"
        if self.calls == 2:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)

    def __exit__(self, *_):
        pass


def test_interrupted_blast_goes_on_to_the_same_files(monkeypatch, capsys, tmp_path):
    quick = ["--quick", "--no-pictures", "--threads", "2", "--method", "fixed", "--until", "4e-5"]
    quick += ["--without", "body_contact,sticking_friction", "--checkpoint-every", "500steps"]

    def run(folder, *more):
        given = [*quick, "--out", str(tmp_path / folder), *more]
        code = study.main(blast_fracture.run, blast_fracture.options_parser(), given)
        return code, "\n".join(phases_of(capsys.readouterr().err)[1])

    assert run("straight") == (0, "")
    assert not [*tmp_path.glob("*/*.png"), *tmp_path.glob("*/*.gif"), *tmp_path.glob("*/*.html")]
    with monkeypatch.context() as patched:
        patched.setattr("taichi_dem.kit.progress_bar.ProgressBar", CtrlC)
        code, said = run("stopped")
    path = tmp_path / "stopped" / "run.checkpoint"
    assert code == 130 and os.listdir(path.parent) == [path.name]
    assert re.fullmatch(rf"interrupted at t = \S+ s, saved in {path}: continue with --resume", said)
    assert run("stopped", "--resume") == (0, "")
    names = "history.csv bonds.csv bodies.csv mesh.msh paraview/{folder}_0006.vtu"
    for name in names.split():
        files = [tmp_path / k / name.format(folder=k) for k in ("stopped", "straight")]
        assert files[0].read_bytes() == files[1].read_bytes()
