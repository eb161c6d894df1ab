"""A program that is told to end takes the processes that it waits for with it."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

#: A child says that it is there and waits, alone or beside others that are started in turn.
WAITS = "open('{0}/' + str(__import__('os').getpid()), 'w').close(); __import__('time').sleep(60)"
ALONE = """
import sys
from taichi_dem.kit import children
from taichi_dem.kit.study.command_line import exit_code
sys.exit(exit_code(lambda: children.run([sys.executable, "-c", {child!r}]).returncode))
"""
IN_TURN = """
import sys
from concurrent.futures import ThreadPoolExecutor
from taichi_dem.kit import children
from taichi_dem.kit.study.command_line import exit_code

def work():
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda _: children.run([sys.executable, "-c", {child!r}]), range(6)))

sys.exit(exit_code(work))
"""
SWEEP = """
import time
from pathlib import Path
from taichi_dem import sweep

def f(row):
    Path({folder!r}, str(__import__("os").getpid())).touch()
    time.sleep(60)

if __name__ == "__main__":
    sweep(f, {{"x": [1, 2]}}, workers=2, progress=None)
"""


def is_alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{number}/stat") as file:
        return file.read().rsplit(")", 1)[1].split()[0] != "Z"


def ended(tmp_path, text, number, count):
    """A program that is sent a signal once so many children wait; their numbers."""
    folder = tmp_path / "children"
    folder.mkdir()
    child = WAITS.format(folder)
    (tmp_path / "program.py").write_text(text.format(child=child, folder=str(folder)))
    options = {"env": users_environment(PYTHONPATH=ROOT), "cwd": tmp_path, "text": True}
    line = [sys.executable, "program.py"]
    with subprocess.Popen(line, stderr=subprocess.PIPE, **options) as program:
        until = time.monotonic() + 60.0
        while len(list(folder.iterdir())) < count and time.monotonic() < until:
            time.sleep(0.05)
        program.send_signal(number)
        errors = program.communicate(timeout=30)[1]
    found = [int(path.name) for path in folder.iterdir()]
    until = time.monotonic() + 15.0
    while any(map(is_alive, found)) and time.monotonic() < until:
        time.sleep(0.05)
    left = [one for one in found if is_alive(one)]
    for one in left:
        os.kill(one, signal.SIGKILL)
    assert len(found) == count and not left
    return program.returncode, errors


@pytest.mark.parametrize(("text", "count"), [(ALONE, 1), (IN_TURN, 2)], ids=["alone", "in turn"])
def test_children_end_with_a_program_that_is_told_to_end(tmp_path, text, count):
    code, errors = ended(tmp_path, text, signal.SIGTERM, count)
    assert (code, errors) == (128 + signal.SIGTERM, "ended by SIGTERM\n")


@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL"])
def test_workers_end_with_a_sweep_however_it_ends(tmp_path, name):
    assert ended(tmp_path, SWEEP, getattr(signal, name), 2)[0] == -getattr(signal, name)
