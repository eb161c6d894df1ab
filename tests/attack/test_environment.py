"""Hostile environments: a program runs as ever, or says one sentence and ends with exit code 2."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

ATTACKS = "environment: variables, folders, closed output, signals"
PROGRAM = os.path.join(ROOT, "tests", "attack", "short_run.py")
DONE, REFUSED = 0, 2

#: Variables of Taichi that contradict ours or that it cannot read.
VARIABLES = [
    *(("TI_ARCH", value) for value in ("cuda", "nonsense")),
    *(("TI_DEBUG", value) for value in ("1", "x")),
    *(("TI_FAST_MATH", value) for value in ("1", "yes")),
    *(("TI_DEFAULT_FP", value) for value in ("32", "zz")),
    *(("TI_DEFAULT_IP", value) for value in ("64", "-")),
    *(("TI_CPU_MAX_NUM_THREADS", value) for value in ("0", "-1", "x")),
    ("TI_ADVANCED_OPTIMIZATION", "1"),
    ("TI_OPT_LEVEL", "0"),
    *(("TI_LOG_LEVEL", value) for value in ("trace", "zz")),
    *(("TI_RANDOM_SEED", value) for value in ("7", "x")),
    *((name, "x") for name in ("TI_ENABLE_TORCH", "TI_KERNEL_PROFILER", "TI_UNROLLING_LIMIT")),
    *((name, "1") for name in ("TI_PRINT_IR", "TI_GDB_TRIGGER", "TI_CHECK_OUT_OF_BOUND")),
    ("TI_SHORT_CIRCUIT_OPERATORS", "0"),
    ("TI_OFFLINE_CACHE_MAX_SIZE_OF_FILES", "-1"),
    ("TI_OFFLINE_CACHE_CLEANING_POLICY", "zz"),
    ("TI_LIB_DIR", "/nowhere"),
    ("ENABLE_TAICHI_HEADER_PRINT", "x"),
]
#: Other surroundings: variables, words for Python, and a line of the shell before and behind.
SURROUNDINGS = {
    "home a file": ({"HOME": "{file}"}, "", "", ""),
    "home empty": ({"HOME": ""}, "", "", ""),
    "home nowhere": ({"HOME": "/proc/none"}, "", "", ""),
    "cache a file": ({"TI_OFFLINE_CACHE_FILE_PATH": "{file}"}, "", "", ""),
    "cache below a file": ({"TI_OFFLINE_CACHE_FILE_PATH": "{file}/x"}, "", "", ""),
    "cache in proc": ({"TI_OFFLINE_CACHE_FILE_PATH": "/proc/none"}, "", "", ""),
    "cache damaged": ({"TI_OFFLINE_CACHE_FILE_PATH": "{cache}"}, "", "", ""),
    "folders of the desktop": ({"XDG_CACHE_HOME": "{file}", "MPLCONFIGDIR": "{file}"}, "", "", ""),
    "no temporary folder": ({"TMPDIR": "/nowhere"}, "", "", ""),
    "warnings are errors": ({}, "-bb -W error", "", ""),
    "without docstrings": ({}, "-OO", "", ""),
    "ascii": ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}, "", "", ""),
    "unknown locale": ({}, "", "with='LC_ALL=xx_YY.zz'", ""),
    "time zone": ({"TZ": "../../x"}, "", "", ""),
    "umask": ({}, "", "umask 0777", ""),
    "few files": ({}, "", "ulimit -n 24", ""),
    "small stack": ({}, "", "ulimit -s 512", ""),
    "stdout closed": ({}, "", "", ">&-"),
    "stdout full": ({}, "", "", ">/dev/full 2>/dev/null"),
    "all closed": ({}, "", "", "<&- >&- 2>&-"),
    "all full": ({}, "", "", ">/dev/full 2>/dev/full"),
    "reader leaves": ({}, "", "set -o pipefail", "| head -c 1"),
    "no reader": ({}, "", "set -o pipefail", "2>&1 | true"),
}
#: Surroundings in which a run cannot be: words of the sentence.
IMPOSSIBLE = {
    "cache switch": ({"TI_OFFLINE_CACHE": "x"}, "", "", "", "must be 0 or 1, got 'x'"),
    "little memory": ({}, "", "ulimit -v 1200000", "", "address space"),
    "less memory": ({}, "", "ulimit -v 400000", "", "cannot be imported: Taichi needs 0.5 GB"),
    "no files": ({}, "", "ulimit -f 0", "", "temporary directory"),
    "no current folder": ({}, "", "mkdir gone; cd gone; rmdir ../gone", "", "current folder"),
}


#: Runs a program that says when it begins to import Taichi.
_MARKED = """
import runpy, sys

class Mark:
    def find_spec(self, name, path=None, target=None):
        if name == "taichi":
            print("begun", file=sys.__stdout__, flush=True)

sys.meta_path.insert(0, Mark())
runpy.run_path(sys.argv.pop(1), run_name="__main__")
"""


def program(folder, variables, words="", before="", behind="", options=""):
    """Run the program by a shell in a folder; returns what it ended with."""
    run = f"exec env $with {sys.executable} {words} {PROGRAM} --out {folder}/out {options}"
    line = f"{before or ':'}; ( {run} ) {behind}"
    environment = users_environment(PYTHONPATH=ROOT, **variables)
    return subprocess.run(
        ["bash", "-c", line],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=200,
    )


def filled(variables, folder):
    """Variables with names of what lies in a folder: a file, and a damaged kernel cache."""
    cache = folder / "cache"
    cache.mkdir(exist_ok=True)
    (folder / "file").write_text("x")
    for name, content in {
        "ticache.tcb": b"\xff" * 40,
        "Tabc.tic": b"",
        "ticache.lock": b"",
    }.items():
        (cache / name).write_bytes(content)
    tomorrow = time.time() + 1e5
    os.utime(cache / "ticache.lock", (tomorrow, tomorrow))
    places = {"file": folder / "file", "cache": cache}
    return {name: value.format(**places) for name, value in variables.items()}


@pytest.fixture(scope="module")
def digest(tmp_path_factory):
    """The digest in surroundings as they should be."""
    folder = tmp_path_factory.mktemp("plain")
    assert program(folder, {}).returncode == DONE
    return (folder / "out" / "digest.txt").read_text()


def assert_runs(folder, digest, variables, *shell):
    done = program(folder, filled(variables, folder), *shell)
    assert done.returncode == DONE, (variables, shell, done.stderr)
    os.chmod(folder / "out", 0o700)
    os.chmod(folder / "out" / "digest.txt", 0o600)
    assert (folder / "out" / "digest.txt").read_text() == digest
    assert done.stderr == ""


def test_a_run_has_the_same_bits_in_drawn_surroundings(tmp_path, digest, seed):
    """Some variables of Taichi together, and one other surrounding."""
    draw = np.random.default_rng(seed)
    chosen = draw.choice(len(VARIABLES), 6, replace=False)
    variables, *shell = SURROUNDINGS[list(SURROUNDINGS)[seed % len(SURROUNDINGS)]]
    assert_runs(tmp_path, digest, {**dict(VARIABLES[k] for k in chosen), **variables}, *shell)


@pytest.mark.slow
@pytest.mark.parametrize("name", SURROUNDINGS)
def test_a_run_has_the_same_bits_in_each_surrounding(tmp_path, digest, name):
    assert_runs(tmp_path, digest, *SURROUNDINGS[name])


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_no_variable_of_taichi_changes_a_bit(tmp_path, digest, part):
    assert_runs(tmp_path, digest, dict(VARIABLES[part::4]))


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_cannot_be_is_refused_in_one_sentence(tmp_path, name):
    variables, *shell, words = IMPOSSIBLE[name]
    done = program(tmp_path, variables, *shell)
    assert done.returncode == REFUSED, done.stderr
    assert words in done.stderr and done.stderr.count("\n") == 1 and done.stdout == ""


@pytest.mark.parametrize("behind", ["2>/dev/full", "2>&-"])
def test_a_refusal_keeps_its_exit_code_where_it_cannot_be_said(tmp_path, behind):
    assert program(tmp_path, {}, behind=behind, options="--arch none").returncode == REFUSED


@pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="needs to change its user",
)
def test_a_user_may_have_another_users_home(tmp_path, digest):
    """As under sudo: the kernel cache of the other user cannot be read."""
    home, out = tmp_path / "home", tmp_path / "out"
    home.mkdir(mode=0o700)
    out.mkdir()
    temporary = Path(tempfile.gettempdir())
    parents = [folder for folder in tmp_path.parents if temporary in folder.parents]
    for folder in (out, tmp_path, *parents):
        os.chmod(folder, 0o777)
    other = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
    environment = users_environment(PYTHONPATH=ROOT, HOME=str(home))
    command = [*other, sys.executable, PROGRAM, "--out", str(out)]
    done = subprocess.run(command, cwd="/", env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (DONE, "")
    assert (out / "digest.txt").read_text() == digest


def test_nothing_is_left_in_the_temporary_folder(tmp_path):
    """Neither of a HOME that is missing nor of a kernel cache that cannot be used."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    environment = {"TMPDIR": str(folder), "HOME": "/proc/none"}
    assert program(tmp_path, environment).returncode == DONE
    assert [name for name in os.listdir(folder) if "taichi" in name] == []


def test_ctrl_c_is_one_line_at_any_time(tmp_path, seed):
    """Importing, starting, compiling: from where the package's import begins.

    Once all is written and Python takes itself down, a signal ends it without a word.
    """
    out = tmp_path / "out"
    command = [sys.executable, "-c", _MARKED, PROGRAM, "--out", str(out)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(command, env=users_environment(PYTHONPATH=ROOT), **streams)
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.5 * np.random.default_rng(seed).random() ** 2)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=100)[1]
    assert process.returncode in (DONE, 130, -signal.SIGINT)
    assert process.returncode != DONE or said == ""
    assert said == "interrupted\n" or (out / "digest.txt").is_file()
