"""Checkpoint files, what they refuse, and the fields that go into them."""

import builtins
import errno
import json
import os
import signal

import numpy as np
import pytest
import taichi as ti

from taichi_dem import Checkpoint, InputError
from taichi_dem.kit.allocation import FieldTree
from taichi_dem.kit.checkpoint import (
    FORMAT,
    STOP_SIGNALS,
    SaveTimer,
    StopRequests,
    digest,
    read_checkpoint,
    write_checkpoint,
)
from taichi_dem.kit.field_memory import FieldMemory, fields_of, without_end
from taichi_dem.kit.restart import CheckpointWriter
from taichi_dem.kit.sealed_file import write_sealed

IDENTITY = {"version": "1", "mesh": "a cube"}
ARRAYS = {"field/a.b": np.arange(12.0).reshape(4, 3), "part/none": np.zeros((0, 2))}


@pytest.fixture
def path(tmp_path):
    """A good checkpoint."""
    path = tmp_path / "run.npz"
    write_checkpoint(path, IDENTITY, ARRAYS)
    return path


def test_what_is_written_comes_back_bit_by_bit(path):
    arrays = read_checkpoint(path, IDENTITY)
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert np.array_equal(arrays[name], array)


@pytest.mark.parametrize("name", IDENTITY)
def test_another_identity_is_refused_by_name(path, name):
    with pytest.raises(InputError, match=f"of another {name}: {IDENTITY[name]}, not mine"):
        read_checkpoint(path, {**IDENTITY, name: "mine"})


def test_another_format_is_refused(path):
    with np.load(path) as file:
        arrays = dict(file)
    arrays["about"] = np.array(json.dumps({"format": 99, "identity": IDENTITY}))
    write_sealed(path, arrays)
    with pytest.raises(InputError, match=f"must have format {FORMAT}, got 99"):
        read_checkpoint(path, IDENTITY)


def cut(path):
    path.write_bytes(path.read_bytes()[:-40])


def flip(path):
    """One bit within the numbers of the first array."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def stranger(path):
    np.savez(path, a=np.zeros(3))


def sealed_stranger(path):
    write_sealed(path, {"a": np.zeros(3)})


@pytest.mark.parametrize(
    "harm", [cut, flip, stranger, sealed_stranger, lambda p: p.write_text("x"), os.truncate]
)
def test_damaged_and_foreign_files_are_refused(path, harm):
    harm(path, 0) if harm is os.truncate else harm(path)
    with pytest.raises(InputError, match="must be a whole checkpoint"):
        read_checkpoint(path, IDENTITY)


def test_an_absent_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"cannot read checkpoint .*: No such file"):
        read_checkpoint(tmp_path / "no.npz", IDENTITY)


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
    path, opened, room = tmp_path / "run.npz", builtins.open, [10**6]
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
    for room[0] in (0, 300, len(good) - 1):
        with pytest.raises(InputError, match=r"No space left.*run.npz holds the run at t = 1.5 s"):
            writer.save()
        assert path.read_bytes() == good
        assert os.listdir(tmp_path) == ["run.npz"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"path": ""}, "path must be the name of a file"),
        ({"path": 3}, "path must be the name of a file"),
        ({"every_steps": 0}, "every_steps must be a whole number from 1"),
        ({"every_steps": 1.5}, "every_steps must be a whole number from 1"),
        ({"every_s": 0.0}, "every_s must be a positive"),
        ({"every_wall_s": float("nan")}, "every_wall_s must be a positive"),
    ],
)
def test_bad_checkpoints_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        Checkpoint(**{"path": "run.npz", **options})


def test_marks_are_whole_steps_no_nearer_than_asked_for():
    """2.5e-8 s in steps of 1e-8 s: every third; and 3e-8 / 1e-8, just above 3, is no fourth."""
    assert Checkpoint("x", every_s=2.5e-8).marks(10, 1e-8) == {0, 3, 6, 9}
    assert Checkpoint("x", every_s=3e-8).marks(6, 1e-8) == {0, 3, 6}
    assert Checkpoint("x", every_steps=4).marks(9, 1e-8) == {0, 4, 8}
    assert Checkpoint("x", every_wall_s=1.0).marks(9, 1e-8) == set()


def test_a_checkpoint_is_due_by_steps_by_time_and_by_the_wall(monkeypatch):
    wall = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: wall[0])
    due = SaveTimer(Checkpoint("x", every_steps=10, every_s=1e-6, every_wall_s=60.0))
    due.saved_at(5, 2e-7)
    assert not due.now(14, 1.1e-6)
    assert due.now(15, 1.1e-6)
    assert due.now(14, 1.2e-6)
    wall[0] += 60.0
    assert due.now(5, 2e-7)
    due.saved_at(5, 2e-7)
    assert not due.now(5, 2e-7)


@pytest.fixture
def listening():
    """Stop signals interrupt, as at a terminal; a shell may have told some to be ignored."""
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    for number in STOP_SIGNALS:
        signal.signal(number, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_stop_signal_is_noted_first_and_interrupts_then(listening, number):
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), StopRequests() as stop:
        os.kill(os.getpid(), number)
        assert stop.asked == number
        stop.noted = True
        os.kill(os.getpid(), number)
        pytest.fail("the second one must interrupt")
    assert stop.noted
    assert signal.getsignal(number) is before


def test_a_stop_signal_that_nobody_saw_interrupts_at_the_end(listening):
    with pytest.raises(KeyboardInterrupt), StopRequests():
        os.kill(os.getpid(), signal.SIGINT)


def test_a_signal_that_is_ignored_stays_ignored():
    """As SIGHUP under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopRequests() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
        assert stop.asked == 0
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_digest_tells_bits_types_and_shapes_apart():
    array = np.arange(4, dtype=np.int32)
    others = (array[::-1], array.astype(np.int64), array.reshape(2, 2), array.view(np.float32))
    assert len({digest(other) for other in (array, *others)}) == 5


def test_without_end_cuts_zeros_of_all_bits():
    """Minus zero has a bit; zeros before others stay."""
    assert without_end(np.array([0.0, 1.0, 0.0, -0.0, 0.0])).tolist() == [0.0, 1.0, 0.0, -0.0]
    assert without_end(np.zeros((3, 2))).shape == (0, 2)
    assert without_end(np.array(0.0)).shape == ()


@ti.dataclass
class Grain:
    size: ti.f64
    place: ti.types.vector(2, ti.f64)
    kind: ti.i32


class Part:
    """Fields of every kind, one of them in a list, and parts that know each other."""

    constant_fields = ("mass",)
    scratch_fields = ("spare",)

    def __init__(self, whole=None):
        self.mass, self.spare = ti.field(ti.f64, shape=3), ti.field(ti.f64, shape=3)
        self.listed = [ti.field(ti.i64, shape=()), {"deep": ti.field(ti.i32, shape=(2, 3))}]
        self.matrix = ti.Matrix.field(3, 2, ti.f64, shape=4)
        self.record = ti.field(ti.f64, shape=(2, 3, 4))
        self.vector = ti.Vector.field(3, ti.f64, shape=5)
        # Its members do not lie side by side.
        self.grain = Grain.field(shape=6)
        self.whole = whole
        self.method = (whole or self).look

    def look(self):
        """Something that a phase would call."""


def test_fields_are_found_wherever_they_hang():
    inner = Part(Part())
    found = {one.name: one.kind for one in fields_of(inner)}
    own = {"mass": "constant", "spare": "scratch", "listed.0": "saved", "listed.1.deep": "saved"}
    own.update(matrix="saved", record="saved", vector="saved")
    own.update({f"grain.{name}": "saved" for name in ("size", "place", "kind")})
    assert found == {**own, **{f"whole.{name}": kind for name, kind in own.items()}}


def test_field_memory_reads_and_writes_what_taichi_does():
    """Entries and components lie in the order of the arrays that Taichi makes of fields."""
    with FieldTree():
        part = Part()
    random = np.random.default_rng(3)
    fields = {one.name: one.field for one in fields_of(part) if one.kind == "saved"}
    memory = FieldMemory(part)
    first = {}
    for name, field in fields.items():
        values = random.integers(1, 1000, field.to_numpy().shape)
        field.from_numpy(first.setdefault(name, values.astype(field.to_numpy().dtype)))
    read = memory.read()
    assert set(read) == set(first)
    assert memory.misfit(read) == ""
    assert set(read) == set(memory.views)
    for name, field in fields.items():
        assert np.array_equal(read[name], first[name])
        field.from_numpy(np.full_like(first[name], 7))
    memory.write(read)
    for name, field in fields.items():
        assert np.array_equal(field.to_numpy(), first[name])


@pytest.mark.parametrize(
    "change", [lambda a: a.astype(np.float32), lambda a: a[:, :2], lambda a: np.tile(a, (9, 1))]
)
def test_arrays_of_other_fields_do_not_fit(change):
    memory = FieldMemory(part := Part())
    part.vector.from_numpy(np.ones_like(part.vector.to_numpy()))
    arrays = memory.read()
    assert memory.misfit({**arrays, "vector": change(arrays["vector"])}) == "vector"
    assert memory.misfit({k: a for k, a in arrays.items() if k != "record"}) == "record"
