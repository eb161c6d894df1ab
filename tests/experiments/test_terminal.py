"""Experiments as a user runs them: on a terminal, and into a pipe whose reader leaves."""

import io
import json
import os
import re
import subprocess
import sys

import pytest

from taichi_dem.kit.progress.lasting_output import lasting_output
from taichi_dem.kit.study.entries import ENTRIES, read_entries
from tests import arch
from tests.experiments.contract import FOLDER, NAMES
from tests.processes import users_environment
from tests.terminal import run_in_terminal, without_orders

#: Those whose quick run takes a few seconds, one for each way of telling how far it is.
SHORT = ("demo_fracture_law", "demo_step_too_large")
SMALLEST = "demo_step_too_large"


def command(name, folder):
    options = ["--quick", "--threads", "2", "--arch", arch.chosen(), "--out", str(folder)]
    return [sys.executable, str(FOLDER / f"{name}.py"), *options]


def on_terminals():
    """Every experiment with the columns of its terminal, narrow and wide by turns."""
    for place, name in enumerate(NAMES):
        marks = () if name in SHORT else pytest.mark.slow
        yield pytest.param(name, (60, 120)[place % 2], marks=marks)


@pytest.mark.parametrize(("name", "columns"), [*on_terminals()])
def test_an_experiment_ends_well_on_a_terminal(name, columns, tmp_path):
    seen = run_in_terminal(command(name, tmp_path / name), columns)
    assert seen.returncode == 0, seen.text
    assert "Traceback" not in seen.text
    # The bar told of compiling or of the run, was erased, and the cursor is shown again.
    assert "compiling" in seen.text or " runs" in seen.text
    assert seen.raw.count("\x1b[?25l") == seen.raw.count("\x1b[?25h") > 0
    _, _, left = seen.raw.rpartition("\x1b[2K")
    assert "\x1b[" not in re.sub("\x1b\\[[0-9;]*m", "", left), "more than colours"
    assert " ".join(seen.text.split()).startswith(entry_named(name).question)
    lines = without_orders(left).splitlines()
    (table,) = (k for k, line in enumerate(lines) if line.split()[:2] == ["figure", "value"])
    assert all(len(line) <= columns for line in lines[table : lines.index("", table)])
    shown = [line.strip() for line in lines[lines.index("Pictures") + 1 : -1]]
    made = {str(path) for path in (tmp_path / name).glob("*.png")}
    assert made & set(shown) and all(os.path.isfile(path) for path in shown[:12])
    assert lines[-1] == f"Tables and all figures are in {tmp_path / name}"


def entry_named(name):
    """Texts of an experiment."""
    return next(entry for entry in read_entries(FOLDER / ENTRIES) if entry.name == name)


def test_json_is_the_summary_alone_and_the_bar_stays_on_the_terminal(tmp_path):
    with open(tmp_path / "said", "w") as file:
        line = [*command(SMALLEST, tmp_path / "out"), "--json"]
        seen = run_in_terminal(line, stdout=file)
    assert seen.returncode == 0 and "compiling" in seen.text
    said = (tmp_path / "said").read_text()
    assert said == (tmp_path / "out" / "summary.json").read_text() + "\n"
    summary = json.loads(said, parse_constant=pytest.fail)
    assert summary["experiment"] == SMALLEST and summary["command"].endswith("--json")


def test_quiet_shows_nothing_on_a_terminal(tmp_path):
    seen = run_in_terminal([*command(SMALLEST, tmp_path / "out"), "--quiet"])
    assert (seen.returncode, seen.raw) == (0, "")
    assert (tmp_path / "out" / "summary.json").is_file()


#: How the output of a program may be taken away from it: in a shell's words.
READERS = ("| head -1", ">&- 2>&-")
MORE_READERS = ("| true", ">&-", "2>&-", ">/dev/null 2>&1")


@pytest.mark.parametrize(
    "reader", [*READERS, *(pytest.param(reader, marks=pytest.mark.slow) for reader in MORE_READERS)]
)
def test_a_reader_that_leaves_costs_nothing(reader, tmp_path):
    line = [*command(SMALLEST, tmp_path / "out")]
    script = f'"$@" {reader}; exit "${{PIPESTATUS[0]}}"'
    options = {"capture_output": True, "text": True, "env": users_environment()}
    done = subprocess.run(["bash", "-c", script, "bash", *line], **options)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "summary.json").is_file()
    assert (tmp_path / "out" / "energy.png").stat().st_size > 1000


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="only Linux has a disk that is full")
def test_output_that_cannot_be_written_is_one_sentence(tmp_path):
    with open("/dev/full", "w") as full:
        options = {"stdout": full, "stderr": subprocess.PIPE, "text": True}
        # Its letter is not in the output's encoding.
        line, environment = command(SMALLEST, tmp_path / "o\u0436"), {"PYTHONIOENCODING": "ascii"}
        done = subprocess.run(line, env=users_environment(**environment), **options)
    assert done.returncode == 0
    assert done.stderr == "standard output cannot be written to: No space left on device\n"
    assert (tmp_path / "o\u0436" / "summary.json").is_file()


def test_letters_that_the_output_lacks_are_replaced(monkeypatch):
    written = io.BytesIO()
    stream = io.TextIOWrapper(written, encoding="ascii")
    monkeypatch.setattr(sys, "stdout", stream)
    with lasting_output():
        print("20 µs in \u0436")
    assert written.getvalue() == b"20 ?s in ?\n"
