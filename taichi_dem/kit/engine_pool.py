"""Engines of a session: each is compiled once for a structure and runs any scene of it."""

import gc
import weakref
from collections.abc import Hashable, Iterable, Sequence
from typing import Any

import taichi as ti

from taichi_dem.kit import runtime
from taichi_dem.kit.allocation import CapacityError, FieldTree
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.field_memory import fields_of
from taichi_dem.kit.taichi_patches.addresses import lies_here


@ti.data_oriented
class Engine:
    """Base of engines: fields in one ``FieldTree``, declared by ``declare`` for a capacity."""

    #: Advice where the machine lacks the memory, as the end of a sentence.
    advice = "take a smaller one"
    #: What the first number of the capacity counts.
    counted = "scenes"
    #: What an owner is, in words.
    serves = "simulation"

    def __init__(self, structure: object, capacity: Iterable[int]):
        self.structure, self.capacity = structure, tuple(capacity)
        self.session = runtime.session()
        self.owner: weakref.ref | None = None
        self._used = False
        self.tree = FieldTree(self.advice, (self.capacity[0], self.counted))
        with self.tree:
            self.declare()

    def declare(self) -> None:
        """Declare all fields; no field may be used here."""
        raise NotImplementedError

    def accepts(self, scene: Any) -> bool:
        """Whether a scene of the engine's structure and size can run in it as it is compiled."""
        return True

    def fits(self, size: Iterable[int]) -> bool:
        """Whether so many of each find room."""
        return all(most >= wanted for most, wanted in zip(self.capacity, size))

    @property
    def is_idle(self) -> bool:
        """Whether nobody uses it."""
        return self.owner is None or self.owner() is None

    def check(self, owner: object) -> None:
        """Raise InputError where it serves another, its session has ended, or on another thread."""
        runtime.check_session(self.session, self.serves)
        if self.owner is None or self.owner() is not owner:
            raise InputError(f"this {self.serves} has been closed: its engine may serve another")

    def clear(self) -> None:
        """Set all fields to zero, as they are in a new engine."""
        if self._used and not lies_here():
            self._fill()
        elif self._used:
            self.tree.clear()
        self._used = True

    @ti.kernel
    def _fill(self):
        # One kernel: Taichi would compile one a field.
        for field in ti.static([saved.field for saved in fields_of(self)]):
            for entry in ti.grouped(field):
                field[entry] = 0


#: Times the least room from which on engines are made for eighths of powers of two.
_MANY = 64
#: All pools of the process.
_pools: list["EnginePool"] = []


def _made(kind, structure, capacity):
    """A new engine; idle ones of all pools make way where memory or room for fields lacks."""
    try:
        return kind(structure, capacity)
    except CapacityError:
        gc.collect()
        if not sum(pool.free_idle() for pool in _pools):
            raise
        return kind(structure, capacity)


class EnginePool:
    """Engines of one kind, by structure."""

    def __init__(self, kind: type[Engine], least: Iterable[int]):
        self.kind, self.least = kind, tuple(least)
        self._session: runtime.Session | None = None
        self._engines: dict[Hashable, list[Engine]] = {}
        runtime.when_cleared(self._forget)
        _pools.append(self)

    def borrow(self, structure: Hashable, size: Sequence[int], scene: object, owner: object) -> Any:
        """An engine of a structure in which a scene of some size fits, for an owner's lifetime."""
        runtime.check_thread(self.kind.serves)
        self._forget_other_session()
        engines = self._engines.setdefault(structure, [])
        fitting = [engine for engine in engines if engine.fits(size) and engine.accepts(scene)]
        if fitting and not any(engine.is_idle for engine in fitting):
            # Owners that refer to themselves, as by an exception's traceback, are freed only here.
            gc.collect()
        idle = [engine for engine in fitting if engine.is_idle]
        if not idle:
            capacity = [room_for(wanted, low) for wanted, low in zip(size, self.least)]
            idle = [_made(self.kind, structure, capacity)]
            engines += idle
        chosen = min(idle, key=lambda engine: engine.tree.bytes)
        chosen.owner = weakref.ref(owner)
        return chosen

    def free(self, engine: Engine) -> None:
        """Free an engine that is used no longer."""
        self._engines[engine.structure].remove(engine)
        engine.tree.destroy()

    @property
    def count(self) -> int:
        """Engines of the present session."""
        return sum(map(len, self._engines.values()))

    def free_idle(self) -> int:
        """Free the engines that nobody uses; returns their number."""
        self._forget_other_session()
        idle = [engine for engines in self._engines.values() for engine in engines]
        idle = [engine for engine in idle if engine.is_idle]
        for engine in idle:
            self.free(engine)
        return len(idle)

    def _forget(self):
        self._forget_other_session()
        # Out of the pool first: an interrupt must leave no engine there whose memory is gone.
        known, self._engines = self._engines, {}
        for engines in known.values():
            for engine in engines:
                engine.tree.destroy()

    def _forget_other_session(self):
        """Drop engines of a session that has ended, whose memory is gone already."""
        if self._session is not runtime.session():
            self._engines, self._session = {}, runtime.session()


def power_of_two(wanted: int, least: int = 1) -> int:
    """Smallest power of two times ``least`` that is no smaller than ``wanted``."""
    size = max(1, int(least))
    while size < wanted:
        size *= 2
    return size


def room_for(wanted: int, least: int) -> int:
    """The power of two times ``least``; of many entries an eighth of one, to save memory."""
    size = power_of_two(wanted, least)
    if size <= _MANY * least:
        return size
    step = size // 16
    return -(-wanted // step) * step
