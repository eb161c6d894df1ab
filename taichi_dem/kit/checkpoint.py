"""Checkpoints: when a run is saved, the file, and the identity that a resumed run must share."""

import hashlib
import json
import math
import mmap
import os
import signal
import threading
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from taichi_dem.kit.errors import InputError, Portable
from taichi_dem.kit.files import remove_dead_parts, renamed_when_done
from taichi_dem.kit.validation import (
    FileName,
    is_real,
    is_whole,
    path_name,
    plain_fields,
    positive,
    told_apart,
    whole,
)
from taichi_dem.kit.version import __version__, taichi_version

#: Letters of the digest at the end of a file.
_DIGITS = 64
_MOST_STEPS = 2**53
_MOST_MARKS = 1_000_000


@dataclass(frozen=True)
class Checkpoint:
    """File to which a run saves itself, and when.

    A run also saves itself at its end and on Ctrl-C or another stop signal.

    Parameters
    ----------
    path : path
        File; it is replaced as a whole.
    every_steps : int, optional
        Number of largest steps between two checkpoints (of steps of a scene in a batch).
    every_s : float, optional
        Simulated time between two checkpoints [s].
    every_wall_s : float, optional
        Wall time between two checkpoints [s].
    """

    path: FileName
    every_steps: int | None = None
    every_s: float | None = None
    every_wall_s: float | None = None

    def __post_init__(self):
        plain_fields(self)
        object.__setattr__(self, "path", path_name("path", self.path))
        if self.every_steps is not None:
            whole("every_steps", self.every_steps, 1, _MOST_STEPS)
        for name in ("every_s", "every_wall_s"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))

    def marks(self, last: int, dt: float) -> set[int]:
        """Steps, from 0 to the last, at which a run with a step dt [s] is to be saved."""
        every = [self.every_steps] if self.every_steps else []
        if self.every_s is not None:
            every.append(max(1, math.ceil(self.every_s / dt - 1e-9)))
        if every and last > _MOST_MARKS * min(every):
            least = math.ceil(last / _MOST_MARKS)
            bound = told_apart(self.every_s or 0.0, least * dt)[1]
            raise InputError(
                f"every_steps must be at least {least} and every_s {bound} s in a run of {last} "
                f"steps, got {self.every_steps} and {self.every_s}"
            )
        return {step for distance in every for step in range(0, last + 1, distance)}


#: What asks a run to end: Ctrl-C, and what batch systems and closed terminals send.
STOP_SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGXCPU", "SIGUSR1")
    if hasattr(signal, name)
)


class Interrupted(Portable, KeyboardInterrupt):
    """Ctrl-C or another stop signal, after the run has been saved at ``time_s`` to ``path``."""

    def __init__(self, time_s: float, path: FileName, number: int = signal.SIGINT):
        super().__init__(f"interrupted at t = {time_s:.6g} s, saved in {path}")
        self.time_s, self.path, self.number = time_s, os.fspath(path), number


class StopRequests:
    """Notes the first stop signal in its block; a second one interrupts."""

    def __init__(self) -> None:
        self.asked = 0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> "StopRequests":
        if threading.current_thread() is threading.main_thread():
            for number in STOP_SIGNALS:
                ignored = signal.getsignal(number) in (signal.SIG_IGN, None)
                if number == signal.SIGINT or not ignored:
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, kind, *_):
        for number, before in self._before.items():
            signal.signal(number, before)
        self._before = {}
        if self.asked and kind is None:
            raise KeyboardInterrupt

    def _note(self, number, frame):
        if self.asked:
            raise KeyboardInterrupt
        self.asked = number


def digest(*arrays: ArrayLike) -> str:
    """Twelve letters that change with any bit, type or shape of the arrays."""
    hashed = hashlib.sha256()
    for array in map(np.ascontiguousarray, arrays):
        hashed.update(f"{array.dtype} {array.shape}".encode())
        hashed.update(array.tobytes())
    return hashed.hexdigest()[:12]


def identity_of(value: Any) -> str:
    """Words for a value, the same for equal values such as 1, 1.0 and ``np.float64(1)``."""
    if isinstance(value, (bool, np.bool_)):
        return repr(bool(value))
    if is_whole(value) and abs(int(value)) > 2**53:
        return repr(int(value))
    if is_real(value):
        return repr(float(value))
    if isinstance(value, np.ndarray):
        return f"array {digest(value)}"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {identity_of(value[key])}' for key in value)}}}"
    if isinstance(value, (tuple, list)):
        return f"({', '.join(map(identity_of, value))})"
    if is_dataclass(value) and not isinstance(value, type):
        named = {field.name: getattr(value, field.name) for field in fields(value)}
        return f"{type(value).__name__}{identity_of(named)}"
    return repr(value)


def version_text() -> str:
    """Versions that a checkpoint is bound to."""
    return f"{__version__} on taichi {taichi_version()}"


def write_checkpoint(
    path: FileName, identity: Mapping[str, str], arrays: Mapping[str, np.ndarray]
) -> None:
    """Write arrays by name under an identity, a dict of words; on the disk before it appears."""
    # A line of JSON gives identity, names, types and shapes; then come the arrays and their digest.
    listed = [(name, _plain(array.dtype).str, array.shape) for name, array in arrays.items()]
    head, sealed = json.dumps({"identity": dict(identity), "arrays": listed}), hashlib.sha256()
    with renamed_when_done(path) as temporary, open(temporary, "wb") as file:
        remove_dead_parts(os.path.dirname(temporary), os.fstat(file.fileno()).st_mtime)
        for piece in (f"{head}\n".encode(), *(array.tobytes() for array in arrays.values())):
            sealed.update(piece)
            file.write(piece)
        file.write(sealed.hexdigest().encode())
        file.flush()
        os.fsync(file.fileno())


def read_checkpoint(path: FileName, identity: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Arrays by name from a checkpoint of the same identity; they take no more than its size."""
    path = path_name("checkpoint", path)
    try:
        about, arrays = _sealed(path)
    except OSError as error:
        raise InputError(f"cannot read checkpoint {path}: {error.strerror or error}") from None
    except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError):
        raise InputError(
            f"{path} must be a complete checkpoint: it is damaged, none, or of an earlier version"
        ) from None
    for name, mine in identity.items():
        theirs = str(about.get(name, "nothing"))
        if theirs != mine:
            said = " ".join(theirs.split())[:200]
            raise InputError(f"checkpoint {path} is of another {name}: {said}, not {mine}")
    return arrays


def _plain(kind):
    """A type of numbers; TypeError for any other, as objects are saved by address."""
    if kind.kind not in "biuf":
        raise TypeError(f"arrays of a checkpoint must hold numbers, got {kind}")
    return kind


def _sealed(path):
    """Identity and arrays of a file; an error unless it is as ``write_checkpoint`` makes it."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        end, place = max(0, len(content) - _DIGITS), content.find(b"\n") + 1
        if content[end:] != hashlib.sha256(memoryview(content)[:end]).hexdigest().encode():
            raise ValueError("its digest does not match")
        head, arrays = json.loads(content[:place]), {}
        for name, kind, shape in head["arrays"]:
            dtype = _plain(np.dtype(kind))
            first, place = place, place + math.prod(shape) * dtype.itemsize
            if min(shape, default=0) < 0 or place > end:
                raise ValueError(f"its array {name} does not fit")
            arrays[str(name)] = np.ndarray(shape, dtype, bytearray(content[first:place]))
        if place != end:
            raise ValueError("its arrays do not fill it")
        return dict(head["identity"]), arrays
