"""Engines of a session: each is compiled once for a structure and runs any scene of it.

An engine owns the fields and kernels of one structure, with a capacity. A scene that fits is loaded
into it in milliseconds; a larger one gets a larger engine. Several scenes may be alive on one
engine at once: they take turns, and the data of inactive ones are kept aside, bit for bit.

Each kind of engine has an ``EnginePool``. A simulation borrows an engine from it as a ``Loan`` and
calls ``loan.activate()`` before it touches a field.
"""

import gc
import weakref
from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any, Optional

import numpy as np
import taichi as ti
from taichi.lang import impl

from taichi_dem.kit import runtime
from taichi_dem.kit.allocation import CapacityError, FieldTree
from taichi_dem.kit.field_memory import FieldMemory
from taichi_dem.kit.uncopied import Uncopied


class Engine(Uncopied):
    """Base of engines: fields in one ``FieldTree``, and the present owner of their data.

    capacity: tuple of whole numbers, the most that fits. Derived classes declare all of their
    fields in ``declare``, which is called once. tree: the fields' memory.
    """

    #: Advice where the machine lacks the memory, as the end of a sentence.
    advice = "take a smaller one"

    def __init__(self, structure: Any, capacity: Iterable[int]):
        self.structure, self.capacity = structure, tuple(capacity)
        self._holder: Optional[weakref.ref[Loan]] = None
        self._used = False
        self.loans: weakref.WeakSet[Loan] = weakref.WeakSet()
        self.tree = FieldTree(self.advice)
        with self.tree:
            self.declare()

    def declare(self) -> None:
        """Declare all fields; no field may be used here."""
        raise NotImplementedError

    def accepts(self, scene: Any) -> bool:
        """Whether a scene of the engine's structure and size can run in it as it is compiled."""
        return True

    def enter(self, scene: Any) -> None:
        """Update the host side for the scene whose data are loaded."""

    def fits(self, size: Iterable[int]) -> bool:
        """Whether so many of each find room."""
        return all(most >= wanted for most, wanted in zip(self.capacity, size))

    def clear(self) -> None:
        """Set all fields to zero, as they are in a new engine."""
        if self._used:
            _memory_of(self).clear()
        self._used = True


class _WholeTree:
    """The memory of an engine on a CPU: one copy for all of its fields."""

    def __init__(self, engine):
        self.tree = engine.tree

    def read(self):
        """Copy of all bytes."""
        ti.sync()
        return self.tree.memory().copy()

    def write(self, saved):
        """Restore the bytes of all fields."""
        ti.sync()
        self.tree.memory()[:] = saved

    def clear(self):
        """Set all fields to zero."""
        self.tree.clear()


class _FieldByField:
    """The memory of an engine on a GPU."""

    def __init__(self, engine):
        self.memories = [FieldMemory(engine, kind) for kind in ("saved", "constant", "scratch")]

    def read(self):
        """Copies of all fields."""
        return [memory.read() for memory in self.memories]

    def write(self, saved):
        """Restore all fields."""
        for memory, arrays in zip(self.memories, saved):
            memory.write(arrays)

    def clear(self):
        """Set all fields to zero."""
        for memory in self.memories:
            for field in memory.fields.values():
                field.fill(0)


def _memory_of(engine):
    return (_FieldByField if impl.current_cfg().arch == ti.cuda else _WholeTree)(engine)


class Loan(Uncopied):
    """The right to an engine: data of one owner, on the device or kept aside.

    engine: the engine borrowed. scene: what runs in it. what: the owner in words, such as
    "simulation".
    """

    def __init__(self, pool: "EnginePool", engine: Engine, scene: Any, what: str):
        self.pool, self.engine, self.scene, self.what = pool, engine, scene, what
        self.session = runtime.session()
        self._aside: Any = None
        engine.loans.add(self)

    def activate(self) -> None:
        """Bring the owner's data to the device; those of another owner are kept aside.

        Raises InputError for a session that has been stopped, restarted or cleared, and on another
        thread than the one that started it.
        """
        runtime.check_session(self.session, self.what)
        holder = self.engine._holder() if self.engine._holder is not None else None
        if holder is self:
            return
        if not self.engine.accepts(self.scene):
            # The kernels are compiled with numbers of another owner.
            self.engine.loans.discard(self)
            self.engine = self.pool.another(self.engine, self.scene)
            self.engine.loans.add(self)
            self.activate()
            return
        self._take_over(holder)

    def _take_over(self, holder):
        """Exchange the data; an interrupt leaves an engine that belongs to nobody, and no loss."""
        engine, memory = self.engine, _memory_of(self.engine)
        if holder is not None:
            holder._aside = memory.read()
        engine._holder = None
        if self._aside is not None:
            memory.write(self._aside)
            engine._used = True
        engine.enter(self.scene)
        engine._holder = weakref.ref(self)
        self._aside = None


class LoanMemory(Uncopied):
    """All fields of a loan that change in a run, by name, as ``FieldMemory`` reads and writes."""

    def __init__(self, loan: Loan):
        self.loan = loan

    def _memory(self) -> FieldMemory:
        self.loan.activate()
        return FieldMemory(self.loan.engine)

    def read(self) -> dict[str, np.ndarray]:
        """Copies of all fields as arrays by name."""
        return self._memory().read()

    def misfit(self, arrays: Mapping[str, np.ndarray]) -> str:
        """Name of a field that arrays lack or do not fit; else ""."""
        return self._memory().misfit(arrays)

    def write(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore all fields."""
        self._memory().write(arrays)


#: All pools of the process.
_pools: list["EnginePool"] = []


def _made(kind, structure, capacity):
    """A new engine; idle ones of all pools make way where memory or room for fields lacks."""
    try:
        return kind(structure, capacity)
    except CapacityError:
        # Simulations that refer to themselves, as by an exception's traceback, are freed only here.
        gc.collect()
        if not sum(pool.free_idle() for pool in _pools):
            raise
        return kind(structure, capacity)


class EnginePool(Uncopied):
    """Engines of one kind, by structure.

    kind: class derived from ``Engine``. least: smallest capacity of an engine; sizes are rounded up
    to powers of two from there, so that few of them are ever compiled.
    """

    def __init__(self, kind: type[Engine], least: Iterable[int]):
        self.kind, self.least = kind, tuple(least)
        self._session: Optional[runtime.Session] = None
        self._engines: dict[Hashable, list[Engine]] = {}
        runtime.when_cleared(self._forget)
        _pools.append(self)

    def borrow(self, structure: Hashable, size: Sequence[int], scene: Any, what: str) -> Loan:
        """A ``Loan`` of an engine of a structure in which a scene of some size fits.

        structure: hashable, equal for scenes that compile to the same kernels. size: as many whole
        numbers as ``least`` has. Its owner loads the scene after ``activate``.
        """
        runtime.check_thread(what)
        self._forget_other_session()
        engines = self._engines.setdefault(structure, [])
        fitting = [engine for engine in engines if engine.fits(size) and engine.accepts(scene)]
        if not fitting:
            capacity = [power_of_two(wanted, low) for wanted, low in zip(size, self.least)]
            fitting = [_made(self.kind, structure, capacity)]
            engines += fitting
        return Loan(self, min(fitting, key=lambda engine: engine.tree.bytes), scene, what)

    def another(self, engine: Engine, scene: Any) -> Engine:
        """An engine like one of those here, of the same capacity, that accepts a scene."""
        engines = self._engines[engine.structure]
        for other in engines:
            if other.capacity == engine.capacity and other.accepts(scene):
                return other
        engines.append(_made(self.kind, engine.structure, engine.capacity))
        return engines[-1]

    @property
    def count(self) -> int:
        """Engines of the present session."""
        return sum(map(len, self._engines.values()))

    def free_idle(self) -> int:
        """Free the engines that nobody has borrowed; returns their number."""
        self._forget_other_session()
        idle = [engine for engines in self._engines.values() for engine in engines]
        idle = [engine for engine in idle if not engine.loans]
        for engine in idle:
            self._engines[engine.structure].remove(engine)
            engine.tree.destroy()
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
