"""Progress in a pipe or a file: a line a phase, few in all, none where none is wanted."""

import io
import sys
from types import SimpleNamespace

import pytest

from taichi_dem import CONCRETE, ProgressBar, Scene, Uniform, simulate
from taichi_dem.kit import progress_bar
from taichi_dem.kit.progress import Progress
from taichi_dem.mesh.shapes import bar
from tests.processes import phases_of

HOUR = 3600.0


def run(**options):
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [])
    simulate(scene, method=Uniform(1e-6), until=1e-4, samples=2, **options)


@pytest.fixture(autouse=True)
def unsaid():
    """No line has been written yet."""
    with progress_bar.showing(True):
        yield


@pytest.fixture
def clock(monkeypatch):
    """A clock that tests turn: ``clock.now`` [s]."""
    made = SimpleNamespace(now=0.0)
    monkeypatch.setattr(progress_bar, "time", SimpleNamespace(perf_counter=lambda: made.now))
    return made


def lines(capsys):
    return capsys.readouterr().err.splitlines()


def test_a_run_writes_a_line_a_phase_and_none_where_a_listener_hears_or_none_is_wanted(capsys):
    run(title="mine")
    phases, others = phases_of(capsys.readouterr().err)
    assert [line.split(": ")[1] for line in phases][-1].startswith("stepping")
    assert {line.split()[1] for line in phases} >= {"compiling", "stepping"} and others == []
    told = []
    run(progress=told.append)
    run(progress=None)
    assert "compiling" in {one.phase for one in told} and lines(capsys) == []
    shares = [one.share for one in told if one.phase == "stepping"]
    assert shares == sorted(shares) and (shares[-1], told[-1].seconds_left) == (1.0, 0.0)


def test_a_long_phase_is_spoken_of_now_and_then(capsys, clock):
    """Ten hours: never silent for longer than 30 s and a tenth of the time, and in few lines."""
    said, step = [0.0], 1.0
    with ProgressBar("long") as shown:
        while clock.now < 10.0 * HOUR:
            shown(Progress(clock.now / (10.0 * HOUR), clock.now, "stepping"))
            if lines(capsys):
                least = max(30.0, 0.1 * said[-1])
                assert clock.now - said[-1] <= 1.12 * least + step
                said.append(clock.now)
            clock.now += step
    assert 20 < len(said) < 80


def test_many_runs_write_few_lines(capsys, clock):
    """10,000 runs of a millisecond, each with a title and two phases of its own."""
    for k in range(10_000):
        with ProgressBar(f"run {k}") as shown:
            for phase in ("compiling", "stepping"):
                shown(Progress(0.0, 0.0, phase))
                clock.now += 5e-4
    assert 2 <= len(lines(capsys)) < 300


def test_a_run_ends_well_where_its_lines_cannot_be_written(monkeypatch):
    class Left(io.StringIO):
        def write(self, text):
            raise BrokenPipeError(32, "Broken pipe")

    for stream in (Left(), None):
        monkeypatch.setattr(sys, "stderr", stream)
        run()
