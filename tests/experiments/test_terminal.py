"""Experiments as a user runs them: on a terminal, and into a pipe whose reader leaves."""

import os
import subprocess
import sys

import pytest

from tests import arch
from tests.experiments.contract import FOLDER, NAMES
from tests.terminal import run_in_terminal

#: Those whose quick run takes a few seconds, one for each way of telling how far it is.
SHORT = ("demo_fracture_law", "demo_step_too_large", "damper_rebound")
SMALLEST = "demo_step_too_large"


def command(name, folder):
    options = ["--quick", "--threads", "2", "--arch", arch.chosen(), "--out", str(folder)]
    return [sys.executable, str(FOLDER / f"{name}.py"), *options]


def slow_unless_short(name):
    return pytest.param(name, marks=() if name in SHORT else pytest.mark.slow)


@pytest.mark.parametrize("name", [slow_unless_short(name) for name in NAMES])
def test_an_experiment_ends_well_on_a_terminal(name, tmp_path):
    seen = run_in_terminal(command(name, tmp_path / name))
    assert seen.returncode == 0, seen.text
    assert "Traceback" not in seen.text
    # Compiling is told of where a bar is shown; the last line stands below all that was erased.
    _, _, left = seen.raw.rpartition("\x1b[2K")
    assert "\x1b[" not in left[:-1].replace("\x1b[?25h", "")
    assert len(left.splitlines()) > 1
    assert str(tmp_path / name) in left
    assert (tmp_path / name / "summary.json").is_file()


#: How the output of a program may be taken away from it: in a shell's words.
READERS = ("| head -1", ">&- 2>&-")
MORE_READERS = ("| true", ">&-", "2>&-", ">/dev/null 2>&1")


@pytest.mark.parametrize(
    "reader", [*READERS, *(pytest.param(reader, marks=pytest.mark.slow) for reader in MORE_READERS)]
)
def test_a_reader_that_leaves_costs_nothing(reader, tmp_path):
    line = [*command(SMALLEST, tmp_path / "out")]
    script = f'"$@" {reader}; exit "${{PIPESTATUS[0]}}"'
    done = subprocess.run(["bash", "-c", script, "bash", *line], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "summary.json").is_file()
    assert (tmp_path / "out" / "energy.png").stat().st_size > 1000


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="only Linux has a disk that is full")
def test_output_that_cannot_be_written_is_one_sentence(tmp_path):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            command(SMALLEST, tmp_path / "out"), stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 0
    assert done.stderr == "standard output cannot be written to: No space left on device\n"
    assert (tmp_path / "out" / "summary.json").is_file()
