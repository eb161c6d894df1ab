"""Floors of a machine: rates of a copy and of multiply-adds, to compare other rates with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter, process_time

import taichi as ti

from taichi_dem.kit import backend
from taichi_dem.kit.timing import on_device

#: Names of the floors.
MEMORY, CACHE = "copy in memory", "copy in cache"
MULTIPLY_ADD = "multiplications and additions"
#: Numbers that one instruction may take at once; code of single numbers is not made vectors of.
LANES = 8
#: Numbers of an array far beyond every cache, and of one of which two fit in 256 KiB.
LARGE, SMALL = 1 << 24, 1 << 14
#: Independent sums: as many as hide the time that one takes, and as 16 registers can hold.
CHAINS = 6
#: Copies of the small array, and multiply-adds of a sum, in a call: some milliseconds.
_COPIES, _STEPS = 300, 1 << 19


@dataclass(frozen=True)
class Work:
    """Least work of a task, however its data lie in memory: bytes, each number once, and flops.

    store: name of the floor that holds for the bytes.
    """

    bytes: float
    flops: float = 0.0
    store: str = CACHE

    def __add__(self, other: "Work") -> "Work":
        return Work(self.bytes + other.bytes, self.flops + other.flops, self.store)

    def __mul__(self, count: float) -> "Work":
        return Work(count * self.bytes, count * self.flops, self.store)

    def seconds(self, floors: Mapping[str, float]) -> float:
        """Least time [s]; floors: bytes and operations a second, by name."""
        arithmetic = self.flops / floors[MULTIPLY_ADD] if self.flops else 0.0
        return max(self.bytes / floors[self.store], arithmetic)


class Copy:
    """Two arrays of numbers in f64, to copy one into the other; entries: numbers of each."""

    def __init__(self, entries: int = LARGE):
        lanes = 1 if on_device() else LANES
        entries = int(min(entries, backend.most_entries()))
        self.bytes = 16.0 * entries
        self.a, self.b = (ti.Vector.field(lanes, ti.f64, shape=entries // lanes) for _ in range(2))

    def bandwidth(self, repeats: int = 5) -> float:
        """Bytes a second that copies by all threads read and write, the best of some repeats."""
        return self.bytes / _least_seconds(lambda: _copy(self.a, self.b), repeats, perf_counter)

    def bandwidth_of_one_core(self, repeats: int = 5) -> float:
        """The same of many copies to and fro by one core, which stay in its cache if they fit."""
        seconds = _least_seconds(lambda: _copy_often(self.a, self.b, _COPIES), repeats)
        return 2.0 * _COPIES * self.bytes / seconds


class Floors:
    """Arrays for all floors of one core (256 MiB); on a device the copy in memory alone."""

    def __init__(self) -> None:
        self.large = Copy()
        self.one_core = not on_device()
        if self.one_core:
            self.small, self.sums = Copy(SMALL), ti.Vector.field(LANES, ti.f64, shape=CHAINS)

    def measure(self, repeats: int = 5) -> dict[str, float]:
        """Bytes or operations a second by name of the floor, each the best of some repeats."""
        found = {MEMORY: self.large.bandwidth(repeats)}
        if self.one_core:
            found[CACHE] = self.small.bandwidth_of_one_core(2 * repeats)
            chains = self.sums, 0.5, 1.0, _STEPS
            seconds = _least_seconds(lambda: _multiply_add(*chains), 2 * repeats)
            found[MULTIPLY_ADD] = 2.0 * LANES * CHAINS * _STEPS / seconds
        return found


def _least_seconds(
    work: Callable[[], object], repeats: int, clock: Callable[[], float] = process_time
) -> float:
    """Shortest time of some calls, of CPU time, which a busy machine changes less, for one core."""
    # The first call compiles. CPU time depends less on other load of the machine.
    work()
    seconds = []
    for _ in range(repeats):
        ti.sync()
        started = clock()
        work()
        ti.sync()
        seconds.append(clock() - started)
    return min(seconds)


@ti.kernel
def _copy(a: ti.template(), b: ti.template()):  # type: ignore[valid-type]
    for k in a:  # type: ignore[attr-defined]
        b[k] = a[k]  # type: ignore[index]


@ti.kernel
def _copy_often(a: ti.template(), b: ti.template(), times: ti.i32):  # type: ignore[valid-type]
    ti.loop_config(serialize=True)
    for _ in range(times):
        for k in range(a.shape[0]):  # type: ignore[attr-defined]
            b[k] = a[k]  # type: ignore[index]
        for k in range(a.shape[0]):  # type: ignore[attr-defined]
            a[k] = b[k]  # type: ignore[index]


@ti.kernel
def _multiply_add(
    sums: ti.template(),  # type: ignore[valid-type]
    factor: ti.f64,
    term: ti.f64,
    times: ti.i32,
):
    """Multiply and add in vectors of eight; fast math is off, so that both are rounded."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        a, b, c = sums[0], sums[1], sums[2]  # type: ignore[index]
        d, e, f = sums[3], sums[4], sums[5]  # type: ignore[index]
        for _step in range(times):
            a, b, c = factor * a + term, factor * b + term, factor * c + term
            d, e, f = factor * d + term, factor * e + term, factor * f + term
        sums[0], sums[1], sums[2] = a, b, c  # type: ignore[index]
        sums[3], sums[4], sums[5] = d, e, f  # type: ignore[index]
