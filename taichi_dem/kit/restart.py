"""Saving and resuming of runs: data of a run, times of saving, restoring."""

import os
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from taichi_dem.kit.checkpoint import (
    Checkpoint,
    Interrupted,
    StopRequests,
    read_checkpoint,
    write_checkpoint,
)
from taichi_dem.kit.errors import InputError, carrying
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.validation import FileName


class RunSnapshot:
    """All changing data of a run: fields on the device, and arrays of its owners on the host.

    memory: gives the ``FieldMemory``. Arrays must match those of ``example()``, but for ``grows``.
    """

    def __init__(self, identity: Mapping[str, str], memory: Callable, owners: Mapping[str, Any]):
        self.identity, self.memory, self.owners = identity, memory, owners

    def write(self, path: FileName) -> None:
        """Save the run as it is, between two steps. Raises InputError."""
        arrays = {f"field/{name}": array for name, array in self.memory().read().items()}
        for part, owner in self.owners.items():
            arrays.update({f"{part}/{name}": array for name, array in owner.saved().items()})
        write_checkpoint(path, self.identity, arrays)

    def restore(self, arrays: Mapping[str, np.ndarray], path: FileName) -> None:
        """Restore the run from the arrays that ``opened`` returned for a path."""
        memory = self.memory()
        missing = memory.misfit(_under("field", arrays))
        if missing:
            raise InputError(f"checkpoint {path} is of another version: field {missing} differs")
        memory.write(_under("field", arrays))
        for part, owner in self.owners.items():
            try:
                saved = _under(part, arrays)
                _check_like(saved, owner)
                owner.resume(saved)
            except (LookupError, ValueError, TypeError, ArithmeticError):
                raise InputError(
                    f"checkpoint {path} is of another version: its data of the {part} differ"
                ) from None


def _under(part, arrays):
    return {k[len(part) + 1 :]: array for k, array in arrays.items() if k.startswith(f"{part}/")}


def _check_like(saved, owner):
    """Raise KeyError or ValueError unless arrays are like those that an owner would save now."""
    for name, own in getattr(owner, "example", owner.saved)().items():
        grows = tuple(prefix for prefix in getattr(owner, "grows", ()) if name.startswith(prefix))
        if grows and not any(other.startswith(grows) for other in saved):
            continue
        shape, first = saved[name].shape, 1 if grows else 0
        if saved[name].dtype != own.dtype or len(shape) != own.ndim:
            raise ValueError(f"{name} must be like {own!r}")
        if shape[first:] != own.shape[first:]:
            raise ValueError(f"{name} must have entries of {own.shape[first:]}")


class CheckpointWriter:
    """Saves a run between two steps: when its checkpoint is due, and on a stop signal."""

    def __init__(
        self,
        checkpoint: Checkpoint | None = None,
        snapshot: Any = None,
        now: Callable[[], tuple[int, float]] = lambda: (0, 0.0),
    ):
        self.checkpoint, self.snapshot, self.now = checkpoint, snapshot, now
        self.stop = StopRequests()
        self.saved_s: float | None = None
        self._last = (*now(), time.perf_counter())

    def __enter__(self) -> "CheckpointWriter":
        if self.checkpoint is not None:
            self.stop.__enter__()
        return self

    def __exit__(self, *error):
        self.stop.__exit__(*error)

    def marks(self, last: int, dt: float) -> set[int]:
        """Steps of dt [s] up to the last at which a save may be due, a set."""
        return set() if self.checkpoint is None else self.checkpoint.marks(last, dt)

    def save_if_needed(self) -> None:
        """Save the run if a save is due. Raises Interrupted after a stop signal, InputError."""
        if self.checkpoint is None:
            return
        if self.stop.asked or self._is_due(self.checkpoint):
            self.save()
        if self.stop.asked:
            raise Interrupted(self.now()[1], self.checkpoint.path, self.stop.asked)

    def _is_due(self, given):
        every = given.every_steps, given.every_s, given.every_wall_s
        passed = zip(every, (*self.now(), time.perf_counter()), self._last)
        return any(
            distance is not None and present - last >= distance * (1.0 - 1e-9)
            for distance, present, last in passed
        )

    def save(self, result: Any = None) -> None:
        """Save the run. Raises InputError that names the last good checkpoint."""
        if self.checkpoint is None:
            return
        with carrying(result):
            try:
                self.snapshot.write(self.checkpoint.path)
            except InputError as error:
                raise InputError(f"{error}{self.last_good()}") from None
        self._last = (*self.now(), time.perf_counter())
        self.saved_s = self._last[1]

    def last_good(self) -> str:
        """The last good checkpoint, as the end of a sentence."""
        if self.checkpoint is None:
            return ""
        if self.saved_s is None:
            return "; this run has saved no checkpoint before"
        path = os.fspath(self.checkpoint.path)
        return f"; checkpoint {path} holds the run at t = {self.saved_s:.6g} s"


def opened(
    checkpoint: Checkpoint | None,
    resume: FileName | None,
    identity: Callable[[], Mapping[str, str]],
) -> dict[str, np.ndarray] | None:
    """Check, before any costly work, that a run can be saved and resumed."""
    if checkpoint is not None and not isinstance(checkpoint, Checkpoint):
        raise InputError(f"checkpoint must be a Checkpoint or None, got {checkpoint!r}")
    arrays = None if resume is None else read_checkpoint(resume, identity())
    if checkpoint is not None:
        output_folder(os.path.dirname(os.path.abspath(checkpoint.path)))
    return arrays
