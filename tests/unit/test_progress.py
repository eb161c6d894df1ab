"""A job tells how far it is, on a terminal, in Jupyter and to a callback, and leaves no trace."""

import sys

import pytest

from taichi_dem import CONCRETE, Scene, Uniform, simulate
from taichi_dem.mesh.shapes import bar
from tests.terminal import run_in_terminal

#: A run of well under a second, to be typed into a file by a user.
JOB = """
from taichi_dem import CONCRETE, Scene, Uniform, runtime, simulate
from taichi_dem.mesh.shapes import bar

runtime.start(threads=1)
scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [], velocity=(1.0, 0.0, 0.0))
result = simulate(scene, method=Uniform(1e-6), until=1e-3)
print("broken faces:", result.report.broken_faces)
"""


def test_a_callback_hears_of_the_run_to_its_end():
    told = []
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [])
    simulate(scene, method=Uniform(1e-6), until=1e-3, progress=told.append)
    shares = [progress.share for progress in told if progress.phase == "stepping"]
    assert shares == sorted(shares)
    assert (told[-1].share, told[-1].seconds_left) == (1.0, 0.0)


@pytest.mark.experiment
def test_a_terminal_shows_compiling_and_is_left_clean(tmp_path):
    seen = run_in_terminal([sys.executable, "-c", JOB], cwd=tmp_path)
    assert seen.returncode == 0, seen.text
    assert "compiling 2 of 5, time step" in seen.text
    # Bar erased ("2K"), cursor shown again, and nothing but the program's own line after it.
    assert seen.raw.rindex("\x1b[?25h") < seen.raw.rindex("\x1b[2K")
    assert seen.raw[seen.raw.rindex("\x1b[2K") :] == "\x1b[2Kbroken faces: 0\r\n"
