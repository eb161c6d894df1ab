"""What a user sees of a job while it runs: on a terminal, in Jupyter, through ``progress``."""

import dataclasses
import math
import re
import subprocess
import sys
import time
import types
from pathlib import Path

import pytest

from ca_damper import Spheres, frequency_response
from taichi_dem import (
    CONCRETE,
    InputError,
    Scene,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.kit.progress import progress_bar
from taichi_dem.kit.progress.progress import Compiling, Counted, Progress, compiling, listening
from taichi_dem.kit.progress.progress_bar import ProgressBar, reporting
from taichi_dem.mesh import shapes as mesh_shapes
from taichi_dem.run_plan import RunProgress
from tests.processes import users_environment
from tests.terminal import run_in_terminal

ROOT = Path(__file__).resolve().parents[2]
#: A run of well under a second, to be typed into a file by a user.
JOB = """
from taichi_dem import CONCRETE, InputError, Scene, Uniform, effects, runtime, simulate
from taichi_dem.mesh import shapes as mesh_shapes

runtime.start(threads=1)
scene = Scene(mesh_shapes.bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [effects.Gravity((0, 0, -9.81))])
result = simulate(scene, method=Uniform(1e-6), until=1e-3{more})
print("broken faces:", result.report.broken_faces)
"""


def kinds(kind=Progress):
    """A class of progress and all that are made from it."""
    return [kind, *(sub for child in kind.__subclasses__() for sub in kinds(child))]


def example(kind, **numbers):
    """One of its objects, numbers of no matter where none are given."""
    values = {field.name: 1 for field in dataclasses.fields(kind)}
    return kind(**{**values, **numbers})


@pytest.mark.parametrize("kind", kinds())
@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_every_progress_says_what_a_bar_and_a_callback_ask_for(kind, share):
    progress = example(kind, share=share, seconds=3.0)
    assert progress.phase in ("compiling", "running")
    assert progress.seconds_left >= 0.0
    assert isinstance(progress.speed, str)
    assert f"{100 * share:.0f} %" in str(progress)
    assert "\n" not in str(progress)
    assert len(str(progress)) < 100


def test_time_left_is_that_of_what_is_not_done():
    # At a quarter after 3 s three quarters are left: 9 s.
    assert Progress(0.25, 3.0).seconds_left == 9.0
    assert Progress(0.0, 3.0).seconds_left == math.inf
    assert Progress(1.0, 3.0).seconds_left == 0.0
    assert "9 s left" in str(Progress(0.25, 3.0))
    assert str(Counted(0.25, 3.0, 1, 4)).endswith("1 of 4 runs")


def test_time_left_of_a_scene_without_bonds_is_told_by_its_share():
    run = {"seconds": 3.0, "time_s": 0.25, "until_s": 1.0}
    assert RunProgress(share=0.25, evaluations=0, evaluation_rate=0.0, **run).seconds_left == 9.0
    # 100 evaluations in 3 s, and three quarters of a second at 400 a second ahead.
    assert (
        RunProgress(share=0.25, evaluations=100, evaluation_rate=400.0, **run).seconds_left == 9.0
    )
    # A first call says nothing of how fast the rest goes.
    assert (
        RunProgress(share=0.001, evaluations=1, evaluation_rate=1.0, **run).seconds_left == math.inf
    )


def test_speeds_have_units_a_reader_knows():
    progress = RunProgress(0.5, 2.0, 0.04, 0.08, 6_400_000, 1.0)
    assert progress.speed == "20 ms/s, 3.2 M evaluations/s"


def test_a_callback_is_called_five_times_a_second_and_at_the_end():
    told = []
    started = time.perf_counter()
    blast(told.append)
    running = [progress for progress in told if progress.phase == "running"]
    assert len(running) <= 2 + (time.perf_counter() - started) / 0.2
    assert running[-1].share == 1.0


@pytest.mark.parametrize("nothing", [0.5, None, "half", object()])
def test_a_bar_refuses_what_is_no_progress_also_where_nobody_watches(nothing):
    with ProgressBar("work") as bar, pytest.raises(TypeError, match="takes a Progress"):
        bar(nothing)


def test_only_the_innermost_listener_hears_of_compiling():
    outer, inner = [], []
    compiling("lost", 0.0)
    with listening(outer.append):
        compiling("first", 0.1)
        with listening(inner.append):
            compiling("second", 0.2)
        compiling("third", 0.3)
    assert [told.part for told in outer] == ["first", "third"]
    assert [told.part for told in inner] == ["second"]


def scene():
    mesh = mesh_shapes.bar(0.4, 0.1, (4, 1, 1))
    return Scene(mesh, CONCRETE, [effects.Gravity((0.0, 0.0, -9.81))])


def blast(progress):
    return simulate(scene(), method=Uniform(1e-6), until=1e-3, progress=progress)


def response(progress):
    job = {"transient_cycles": 1, "measured_cycles": 1}
    return frequency_response(Spheres(), particles=1, ratios=1.0, seeds=1, progress=progress, **job)


@pytest.mark.parametrize("job", [blast, response])
def test_a_callback_hears_of_compiling_first_and_then_of_the_run(job, compiled_anew):
    told = []
    job(told.append)
    phases = [progress.phase for progress in told]
    assert phases == sorted(phases)
    assert set(phases) == {"compiling", "running"}
    for phase in set(phases):
        shares = [progress.share for progress in told if progress.phase == phase]
        assert shares == sorted(shares)
        assert 0.0 <= shares[0] <= shares[-1] <= 1.0
    assert told[-1].share == 1.0
    assert told[-1].seconds_left == 0.0


def test_print_is_a_progress_callback(capsys):
    blast(print)
    lines = capsys.readouterr().out.splitlines()
    assert any("compiling time step kernels, the next start is faster" in line for line in lines)
    assert lines[-1].startswith("100 %, 0 s left, ")


def test_silence_where_nobody_watches(capsys):
    blast("auto")
    blast(None)
    assert capsys.readouterr() == ("", "")


@pytest.fixture
def job(tmp_path):
    """Writes a user's file with more arguments of ``simulate``; returns the command."""

    def write(more=""):
        path = tmp_path / "job.py"
        path.write_text(JOB.format(more=more))
        return [sys.executable, str(path)]

    return write


def test_a_terminal_shows_compiling_and_is_left_clean(job, tmp_path):
    seen = run_in_terminal(job(), cwd=tmp_path)
    assert seen.returncode == 0, seen.text
    assert "compiling time step kernels" in seen.text
    # Bar erased ("2K"), cursor shown again, and nothing but the program's own line after it.
    assert seen.raw.rindex("\x1b[?25h") < seen.raw.rindex("\x1b[2K")
    assert seen.raw[seen.raw.rindex("\x1b[2K") :] == "\x1b[2Kbroken faces: 0\r\n"


@pytest.mark.parametrize("stays", ["[/b] [red]x", "plain"])
def test_prints_stay_where_they_go_and_titles_are_no_markup(stays, tmp_path):
    work = f"with ProgressBar({stays!r}) as bar:\n    bar.at(0.5)\n    print('row')\n"
    (tmp_path / "job.py").write_text(f"from taichi_dem import ProgressBar\n{work}print('end')\n")
    with open(tmp_path / "out.txt", "w") as out:
        seen = run_in_terminal([sys.executable, "job.py"], cwd=tmp_path, stdout=out)
    assert seen.returncode == 0, seen.text
    assert stays in seen.text
    assert seen.raw.count("\x1b[?25l") == seen.raw.count("\x1b[?25h")
    assert (tmp_path / "out.txt").read_text() == "row\nend\n"


def test_a_narrow_terminal_keeps_what_matters(job, tmp_path):
    seen = run_in_terminal(job(), columns=50, cwd=tmp_path)
    assert seen.returncode == 0, seen.text
    assert re.search(r"simulating +\d+ %, compiling time step kernels", seen.text)


def test_a_terminal_without_a_cursor_gets_lines(job, tmp_path):
    seen = run_in_terminal(job(), term="dumb", cwd=tmp_path)
    assert seen.returncode == 0, seen.text
    words = "compiling time step kernels, the next start is faster"
    assert re.search(rf"^simulating: +\d+ %, {words}$", seen.text, re.MULTILINE)
    assert seen.text.endswith("\nbroken faces: 0\n")
    assert "\x1b" not in seen.raw and "\n\n" not in seen.text


def test_no_progress_on_a_terminal_where_none_is_wanted(job, tmp_path):
    seen = run_in_terminal(job(", progress=None"), cwd=tmp_path)
    assert seen == (0, "broken faces: 0\r\n")


def test_nothing_but_the_result_in_a_pipe(job, tmp_path):
    done = subprocess.run(
        job(), capture_output=True, text=True, cwd=tmp_path, env=users_environment()
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "broken faces: 0\n", "")


class Handle:
    """Stands for the place of an output below a cell."""

    def __init__(self, shown):
        self.shown = shown

    def update(self, data, raw):
        self.shown.append(data)


@pytest.fixture
def notebook(monkeypatch):
    """What a Jupyter notebook shows below the running cell, one bundle a change."""
    shown = []

    def display(data, raw, display_id):
        shown.append(data)
        return Handle(shown)

    python = types.SimpleNamespace(
        get_ipython=lambda: types.SimpleNamespace(kernel=object()),
        display=types.SimpleNamespace(display=display),
    )
    monkeypatch.setitem(sys.modules, "IPython", python)
    return shown


def test_a_notebook_shows_compiling_and_is_left_clean(notebook, capsys):
    blast("auto")
    plain = [bundle["text/plain"] for bundle in notebook]
    assert any("compiling time step kernels" in text for text in plain)
    assert all("<progress value=" in bundle["text/html"] for bundle in notebook[:-1])
    assert notebook[-1] == {"text/plain": "", "text/html": ""}
    assert capsys.readouterr() == ("", "")


def test_a_title_in_a_notebook_is_text(notebook):
    with ProgressBar("a < b & <b>"):
        pass
    assert "a &lt; b &amp; &lt;b&gt;" in notebook[0]["text/html"]


def test_a_bar_within_a_bar_shows_nothing_of_its_own(notebook):
    with ProgressBar("outer"), reporting("auto", "inner") as report:
        report(Progress(0.5, 1.0))
    assert not any("inner" in bundle["text/plain"] for bundle in notebook)


def test_a_bar_is_closed_by_an_error_and_by_ctrl_c(notebook):
    for error in (ValueError, KeyboardInterrupt):
        with pytest.raises(error), ProgressBar("work"):
            raise error
        assert notebook[-1]["text/plain"] == ""
    assert progress_bar._open_bars == []


def test_a_bar_may_be_used_again_but_not_twice_at_once(notebook):
    bar = ProgressBar("work")
    bar.at(0.5)
    for _ in range(2):
        with bar, pytest.raises(InputError, match="'work' is shown already"), bar:
            pass
    bar.count(0, 0)
    assert [bundle["text/plain"] for bundle in notebook] == ["work: ", "", "work: ", ""]
    with pytest.raises(InputError, match="title must be a str, got 3"):
        ProgressBar(3)


def test_a_bar_without_standard_error_is_silent(monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    with ProgressBar("work") as bar:
        bar(Compiling(0.5, 1.0, "time step"))
        bar.at(0.5)
        bar.count(1, 2)


def test_a_process_that_works_for_another_shows_no_bar(monkeypatch):
    monkeypatch.setattr(progress_bar, "_open_bars", [])
    monkeypatch.setattr(progress_bar, "_display_for", pytest.fail)
    progress_bar.hide_bars()
    progress_bar.hide_bars()
    with ProgressBar("running") as bar:
        bar.at(0.5)
