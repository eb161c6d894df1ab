"""Files are whole or refused, whatever ends a run from outside, and tables are no programs."""

import csv
import itertools
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import ca_damper
import taichi_dem
from taichi_dem import (
    CONCRETE,
    At,
    Checkpoint,
    Collector,
    Every,
    InputError,
    Scene,
    Uniform,
    simulate,
)
from taichi_dem.kit.checkpoint import Interrupted, write_checkpoint
from taichi_dem.kit.field_memory import without_end
from taichi_dem.kit.files import output_folder, renamed_when_done, write_csv
from taichi_dem.mesh.shapes import pair
from tests.scenes import ROOT

DAY_S = 86_400.0
#: Writes half of a file and is killed.
_KILLED = """
import os, sys
from taichi_dem.kit.files import renamed_when_done
with renamed_when_done(sys.argv[1]) as name:
    open(name, "w").write("half")
    os._exit(0)
"""
#: A short run of two bodies, and how often it is sampled.
JOB = {"method": Uniform(1e-8), "until": 1e-6, "samples": 4, "progress": None}


def flying():
    return Scene(pair(), CONCRETE, [], velocity=(1, 0, 0), spin=(0, 0, 9))


def assert_same(first, second):
    """Series of two results have the same bits."""
    assert first.series.keys() == second.series.keys()
    for name, column in first.series.items():
        assert column.tobytes() == second.series[name].tobytes(), name


def parts(folder):
    """Names of the files that are not done."""
    return sorted(name for name in os.listdir(folder) if ".part" in name)


@pytest.mark.skipif(not os.path.exists("/proc/self/ns/pid"), reason="no /proc: a day's age counts")
@pytest.mark.parametrize(
    "save",
    [lambda folder: write_checkpoint(folder / "x.checkpoint", {}, {}), output_folder],
    ids=["checkpoint", "output"],
)
def test_a_save_removes_what_killed_ones_left_and_nothing_else(tmp_path, save):
    mine = tmp_path / ".film.2019.part.txt"
    mine.touch()
    os.utime(mine, (0, 0))
    killed = subprocess.run([sys.executable, "-c", _KILLED, tmp_path / "dead.txt"], cwd=ROOT)
    assert killed.returncode == 0 and len(parts(tmp_path)) == 2
    with renamed_when_done(tmp_path / "alive.txt") as name:
        open(name, "w").close()
        save(tmp_path)
        assert parts(tmp_path) == [os.path.basename(name), mine.name]
    assert parts(tmp_path) == [mine.name]


@pytest.mark.parametrize(("age_s", "stays"), [(0.5 * DAY_S, True), (2.0 * DAY_S, False)])
def test_a_part_of_another_machine_is_left_for_a_day(tmp_path, age_s, stays):
    """Its number may name a process here, or none, and tells nothing."""
    name = tmp_path / f".theirs.{os.getpid()}-0a1b2c3d.part.csv"
    name.touch()
    then = name.stat().st_mtime - age_s
    os.utime(name, (then, then))
    output_folder(tmp_path)
    assert name.exists() == stays


def test_text_of_a_table_is_no_formula_and_numbers_stay(tmp_path):
    """What a spreadsheet would compute begins with =, +, - or @, also after blanks."""
    formulas = ["=1+1", "+cmd", "-x_J", "@SUM(1)", " =2", "\t=3", "\ufeff=4", "\uff1d5"]
    harmless = ["-1.5", "+2e-3", "-inf", "a=b", "time_s", "", "'=x"]
    table = {text: [-1.5, 2.0] for text in formulas + harmless} | {"text": ["=1", "-7"]}
    write_csv(tmp_path / "table.csv", table)
    with open(tmp_path / "table.csv", encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header == [f"'{text}" for text in formulas] + harmless + ["text"]
    assert [[*map(float, row[:-1])] for row in rows] == [[-1.5] * 15, [2.0] * 15]
    assert [row[-1] for row in rows] == ["'=1", "-7"]


@pytest.mark.parametrize("last", [np.float64(-0.0), np.float64(5e-324), np.int32(1)])
def test_a_checkpoint_leaves_out_zeros_at_the_end_to_the_bit(last):
    """Not before the smallest number, a negative zero, and also where entries lie apart."""
    for used in (0, 1, 1000, 3000):
        array = np.zeros((3000, 4, 2), dtype=last.dtype)[:, :3]
        array[used - 1 : used, -1, -1] = last
        assert len(without_end(array)) == used


@pytest.mark.parametrize(
    "thing",
    [
        CONCRETE,
        Uniform(distance=1e-8),
        taichi_dem.Multirate(control=taichi_dem.StepControl()),
        ca_damper.Spheres(),
        ca_damper.Oscillator(),
    ],
    ids=lambda thing: type(thing).__name__,
)
def test_what_identifies_a_run_is_shown_in_full(thing):
    """Evaluated, it is the object again: two of them that differ have different words."""
    assert eval(repr(thing), {**vars(taichi_dem), **vars(ca_damper)}) == thing


def fill_disk(monkeypatch, ending, after=0):
    """Refuse files of an ending, as a full disk does, from a call on."""
    opened, calls = open, itertools.count()

    def refuse(name, mode="r", *rest, **options):
        if "w" in mode and str(name).endswith(ending) and next(calls) >= after:
            raise OSError(28, os.strerror(28))
        return opened(name, mode, *rest, **options)

    monkeypatch.setattr("builtins.open", refuse)


@pytest.fixture(scope="module")
def whole(taichi_session):
    """A run that writes nothing."""
    return simulate(flying(), frames=2, **JOB)


@pytest.mark.parametrize("ending", [".csv", ".msh", ".json", ".vtu", ".pvd", ".checkpoint"])
def test_a_full_disk_at_the_end_does_not_lose_the_result(whole, tmp_path, monkeypatch, ending):
    """Whatever file finds no room; the result is that of a run that wrote nothing."""
    kept = {"output": tmp_path / "out", "checkpoint": Checkpoint(tmp_path / "run.checkpoint")}
    fill_disk(monkeypatch, ending)
    with pytest.raises(InputError, match="No space left") as refused:
        simulate(flying(), frames=2, **kept, **JOB)
    assert_same(whole, refused.value.result)
    assert len(refused.value.result.frames) == len(whole.frames)


def test_a_checkpoint_that_finds_no_room_leaves_the_one_before_and_the_result(whole, tmp_path):
    """What the run has so far is also written, where there is room for that."""
    path = tmp_path / "run.checkpoint"
    saved = {"checkpoint": Checkpoint(path, every_steps=25), "output": tmp_path / "out"}
    with pytest.MonkeyPatch.context() as change:
        fill_disk(change, ".checkpoint", after=2)
        with pytest.raises(InputError, match="holds the run at t = 5e-07 s") as refused:
            simulate(flying(), **saved, **JOB)
    times = refused.value.result.series["time_s"]
    assert times == pytest.approx([0.0, 2.5e-7, 5e-7, 7.5e-7], rel=1e-12)
    with open(tmp_path / "out" / "history.csv", encoding="utf-8") as file:
        assert len([*csv.reader(file)]) == 1 + len(times)
    assert sorted(os.listdir(tmp_path)) == ["out", "run.checkpoint"]
    assert_same(whole, simulate(flying(), resume=path, **JOB))


def test_what_an_observer_raises_carries_the_result_up_to_there():
    def fail(view):
        if view.time_s > 4e-7:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine") as failed:
        simulate(flying(), observers=[Collector(Every(samples=1), mine=fail)], **JOB)
    assert failed.value.result.series["time_s"][-1] == pytest.approx(5e-7)
    assert not failed.value.result.diverged


def test_a_signal_saves_the_run_which_goes_on_with_its_bits(whole, tmp_path):
    def end(view):
        os.kill(os.getpid(), signal.SIGTERM)

    path, observers = tmp_path / "run.checkpoint", [Collector(At((5e-7,)), end=end)]
    with pytest.raises(Interrupted, match="interrupted at t = "):
        simulate(flying(), checkpoint=Checkpoint(path), observers=observers, **JOB)
    assert_same(whole, simulate(flying(), resume=path, **JOB))
