"""In hostile surroundings a program runs to the same bits and says nothing of them."""

import os
import subprocess
import sys

import numpy as np
import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

pytestmark = pytest.mark.attack

PROGRAM = os.path.join(ROOT, "tests", "attack", "short_run.py")
DONE = 0
#: Variables of Taichi that contradict ours or that it cannot read.
VARIABLES = [
    *(("TI_ARCH", "nonsense"), ("TI_DEBUG", "x"), ("TI_FAST_MATH", "1"), ("TI_DEFAULT_FP", "32")),
    *(("TI_DEFAULT_IP", "-"), ("TI_CPU_MAX_NUM_THREADS", "0"), ("TI_ADVANCED_OPTIMIZATION", "1")),
    *(("TI_OPT_LEVEL", "0"), ("TI_LOG_LEVEL", "zz"), ("TI_RANDOM_SEED", "x"), ("TI_PRINT_IR", "1")),
    *(("TI_OFFLINE_CACHE_CLEANING_POLICY", "zz"), ("TI_LIB_DIR", "/nowhere")),
    *(("TI_CHECK_OUT_OF_BOUND", "1"), ("ENABLE_TAICHI_HEADER_PRINT", "x")),
]
#: Other surroundings: variables, words for Python, and a line of the shell before and behind.
SURROUNDINGS = {
    "home a file": ({"HOME": "{file}"}, "", "", ""),
    "warnings are errors": ({}, "-bb -W error", "", ""),
    "without docstrings": ({}, "-OO", "", ""),
    "ascii": ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}, "", "", ""),
    "umask": ({}, "", "umask 0777", ""),
    "all closed": ({}, "", "", "<&- >&- 2>&-"),
    "reader leaves": ({}, "", "set -o pipefail", "| head -c 1"),
}


def program(folder, variables, words="", before="", behind=""):
    """Run the program by a shell in a folder; returns what it ended with."""
    (folder / "file").write_text("x")
    given = {name: text.format(file=folder / "file") for name, text in variables.items()}
    run = f"exec {sys.executable} {words} {PROGRAM} --out {folder}/out"
    return subprocess.run(
        ["bash", "-c", f"{before or ':'}; ( {run} ) {behind}"],
        cwd=folder,
        env=users_environment(PYTHONPATH=ROOT, **given),
        capture_output=True,
        text=True,
        timeout=200,
    )


@pytest.fixture(scope="module")
def digest(tmp_path_factory):
    """The digest in surroundings as they should be."""
    folder = tmp_path_factory.mktemp("plain")
    assert program(folder, {}).returncode == DONE
    return (folder / "out" / "digest.txt").read_text()


def test_a_run_has_the_same_bits_in_drawn_surroundings(tmp_path, digest, seed):
    """Some variables of Taichi together, and one other surrounding."""
    draw = np.random.default_rng(seed)
    chosen = dict(VARIABLES[k] for k in draw.choice(len(VARIABLES), 6, replace=False))
    variables, *shell = SURROUNDINGS[list(SURROUNDINGS)[seed % len(SURROUNDINGS)]]
    done = program(tmp_path, {**chosen, **variables}, *shell)
    assert (done.returncode, done.stderr) == (DONE, ""), (chosen, variables, shell)
    os.chmod(tmp_path / "out", 0o700)
    os.chmod(tmp_path / "out" / "digest.txt", 0o600)
    assert (tmp_path / "out" / "digest.txt").read_text() == digest
