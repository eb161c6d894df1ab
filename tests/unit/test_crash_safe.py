"""Workers that die: no test is lost, the session ends, and a test that always kills has failed."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES, TESTS = 2, 5

SUITE = """
import os
from pathlib import Path
import pytest

@pytest.mark.parametrize("number", range({tests}))
def test(number):
    mark = Path({folder!r}, f"{{os.path.basename(__file__)}}-{{number}}")
    if number in {killers} and ({always} or not mark.exists()):
        mark.touch()
        os._exit(1)
"""


def _session(folder, killers, always):
    """Run files of tests that end their process; return the last line of the output, and all."""
    for place in range(FILES):
        text = SUITE.format(tests=TESTS, folder=str(folder), killers=killers, always=always)
        (folder / f"test_{place}.py").write_text(text)
    options = ("-q", "-n", "2", "--dist", "loadfile", "-p", "tests.crash_safe")
    command = [sys.executable, "-m", "pytest", *options, "-c", "/dev/null", str(folder)]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    return made.stdout.strip().splitlines()[-1], made.stdout


@pytest.mark.slow
def test_a_worker_that_dies_once_loses_no_test(tmp_path):
    last, text = _session(tmp_path, killers=(0, 4), always=False)
    assert last.startswith(f"{FILES * TESTS} passed")
    assert text.count("WORKER DIED in") == 2 * FILES


@pytest.mark.slow
def test_a_test_that_always_kills_its_worker_has_failed_and_others_go_on(tmp_path):
    last, _ = _session(tmp_path, killers=(2,), always=True)
    assert last.startswith(f"{FILES} failed, {FILES * (TESTS - 1)} passed")
