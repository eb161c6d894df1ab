"""A checkpoint and a folder of output are whole or refused, whatever ends a run from outside."""

import builtins
import errno
import os
import signal
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ca_damper
import taichi_dem
from taichi_dem import (
    CONCRETE,
    At,
    Checkpoint,
    Collector,
    ImplicitDashpots,
    InputError,
    Scene,
    Simulation,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.kit.allocation import values
from taichi_dem.kit.checkpoint import Interrupted, read_checkpoint, write_checkpoint
from taichi_dem.kit.field_memory import FieldMemory, fields_of, without_end
from taichi_dem.kit.restart import CheckpointWriter
from taichi_dem.mesh.shapes import bar, pair
from tests.scenes import paper_effects

IDENTITY = {"version": "1", "mesh": "a cube"}
ARRAYS = {"field/a.b": np.arange(12.0).reshape(4, 3), "part/none": np.zeros((0, 2))}


@pytest.fixture
def path(tmp_path):
    """A good checkpoint."""
    path = tmp_path / "run.checkpoint"
    write_checkpoint(path, IDENTITY, ARRAYS)
    return path


def test_what_is_written_comes_back_bit_by_bit(path):
    arrays = read_checkpoint(path, IDENTITY)
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert np.array_equal(arrays[name], array)


@pytest.fixture(scope="module")
def simulation():
    """A few bodies, with contact, on an engine for a thousand."""
    given = bar(0.1, 0.05, (2, 1, 1)), CONCRETE, paper_effects(kind=effects.SphereContact)[:-1]
    return Simulation(Scene(*given), ImplicitDashpots(4e-7))


def test_a_save_copies_what_is_in_use_only(simulation):
    """Less than the largest list, most of which is room: all that is used is as if read whole."""
    memory = FieldMemory(simulation.engine)
    whole = {name: values(field) for name, field in memory.fields.items()}
    used = {name: without_end(array).copy() for name, array in whole.items()}
    memory.read()
    tracemalloc.start()
    read, most = memory.read(), max(array.nbytes for array in whole.values())
    assert tracemalloc.get_traced_memory()[1] < most
    tracemalloc.stop()
    for name, array in whole.items():
        assert read[name].tobytes() == used[name].tobytes(), name
        assert not array[len(read[name]) :].any() if array.ndim else read[name] == array


@given(
    shape=st.tuples(st.integers(0, 3000), st.integers(1, 5), st.integers(1, 3)),
    share=st.floats(0.0, 1.0),
    kind=st.sampled_from([np.int32, np.float64]),
    gap=st.booleans(),
)
@settings(derandomize=True, database=None, deadline=None)
def test_zeros_are_cut_off_to_the_bit(shape, share, kind, gap):
    """Also behind the smallest number, a negative zero, and where entries lie apart."""
    whole = np.zeros((shape[0], shape[1] + gap, shape[2]), dtype=kind)
    array = whole[:, : shape[1]]
    used = int(share * len(array))
    if used:
        array[used - 1, -1, -1] = -0.0 if kind is np.float64 else 1
    assert len(without_end(array)) == used
    assert np.array_equal(array[:used], without_end(array))


def test_fields_are_named_by_attributes_but_for_lanes(simulation):
    """A list of fields on the way to them would rename what a checkpoint of before has."""
    engine = simulation.engine
    names = [field.name for field in fields_of(engine) if field.kind == "saved"]
    numbered = {name for name in names if any(part.isdigit() for part in name.split("."))}
    assert numbered == {f"step.solver.bonds.{row}.{n}" for row in "abc" for n in range(3)}
    assert {"state.position", "schedule.evaluations", "contacts.store.body"} <= set(names)


#: Whose representation tells a checkpoint which run it is of.
IDENTIFYING = (
    taichi_dem.CONCRETE,
    taichi_dem.Uniform(distance=1e-8),
    taichi_dem.Multirate(control=taichi_dem.StepControl()),
    taichi_dem.ImplicitDashpots(),
    ca_damper.Automaton(),
    ca_damper.Spheres(),
    ca_damper.Oscillator(),
)


@pytest.mark.parametrize("thing", IDENTIFYING, ids=lambda thing: type(thing).__name__)
def test_what_identifies_a_run_is_shown_in_full(thing):
    """Evaluated, it is the object again: two of them that differ have different words."""
    assert eval(repr(thing), {**vars(taichi_dem), **vars(ca_damper)}) == thing


def cut(path):
    path.write_bytes(path.read_bytes()[:-40])


def flip(path):
    """One bit within the numbers of the first array."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def stranger(path):
    with open(path, "wb") as file:
        np.savez(file, a=np.zeros(3))


@pytest.mark.parametrize("harm", [cut, flip, stranger])
def test_damaged_and_foreign_files_are_refused(path, harm):
    harm(path)
    with pytest.raises(InputError, match="must be a complete checkpoint"):
        read_checkpoint(path, IDENTITY)


class FullDisk:
    """A file on a disk with room for some bytes."""

    def __init__(self, file, room):
        self.file, self.room = file, room

    def write(self, data):
        self.room -= len(data)
        if self.room < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self.file.write(data)

    def __getattr__(self, name):
        return getattr(self.file, name)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.file.close()


class OneArray:
    """What a ``RunSnapshot`` is to a CheckpointWriter."""

    def write(self, path):
        write_checkpoint(path, IDENTITY, ARRAYS)


def test_a_full_disk_leaves_the_last_good_checkpoint_and_says_so(tmp_path, monkeypatch):
    path, opened, room = tmp_path / "run.checkpoint", builtins.open, [10**6]
    writer = CheckpointWriter(Checkpoint(path), OneArray(), lambda: (3, 1.5))

    def narrow(name, mode="r", *rest, **options):
        file = opened(name, mode, *rest, **options)
        return FullDisk(file, room[0]) if "w" in mode else file

    monkeypatch.setattr(builtins, "open", narrow)
    room[0] = 0
    with pytest.raises(InputError, match=r"No space left.*has saved no checkpoint before"):
        writer.save()
    room[0] = 10**6
    writer.save()
    good = path.read_bytes()
    for room[0] in (0, len(good) // 2, len(good) - 1):
        with pytest.raises(InputError, match=r"No space left.*holds the run at t = 1.5 s"):
            writer.save()
        assert path.read_bytes() == good
        assert os.listdir(tmp_path) == ["run.checkpoint"]


def test_a_signal_saves_the_run_which_goes_on_with_the_bits_of_one_never_stopped(tmp_path):
    def end(view):
        os.kill(os.getpid(), signal.SIGTERM)

    scene, path = (
        Scene(pair(), CONCRETE, [], velocity=(1, 0, 0), spin=(0, 0, 9)),
        tmp_path / "run.checkpoint",
    )
    job = {"method": Uniform(1e-8), "until": 1e-6, "samples": 4, "progress": None}
    observers = [Collector(At((5e-7,)), end=end)]
    with pytest.raises(Interrupted, match="interrupted at t = "):
        simulate(scene, checkpoint=Checkpoint(path), observers=observers, **job)
    resumed, alone = simulate(scene, resume=path, **job), simulate(scene, **job)
    for name, column in alone.series.items():
        assert column.tobytes() == resumed.series[name].tobytes(), name
