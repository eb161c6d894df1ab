"""Driver chosen by measurement: it continues with the faster one; both give the same bits.

The choice depends on the work in a step and on free cores: the parallel driver pays a launch for
every phase, and much more where other programs occupy a core.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any

from taichi_dem.kit import runtime
from taichi_dem.kit.allocation import values
from taichi_dem.kit.errors import InputError
from taichi_dem.step.drivers import Parallel, Resident
from taichi_dem.step.phases import Step

#: Reason why the resident driver cannot run, for a sentence.
CPU_ONLY = "runs on a CPU only"
#: Bonds below which the resident driver is the quicker one, and above which the parallel one is,
#: on a CPU with several threads and free cores; between them both are tried.
RESIDENT_BELOW, PARALLEL_FROM = 4000, 100000
#: Name of the driver that is chosen by measurement.
MEASURED = "measured"
#: Substeps of a try, and how often each driver is tried; the better of its tries counts.
_SUBSTEPS = 8
_TRIES = 2
#: Share of the time that goes into tries.
_SHARE = 0.05


def driver_name(name: str, bond_count: int) -> str:
    """Name of the driver for a scene of so many bonds; name: of the one asked for, or "auto".

    Raises InputError for one that the present architecture does not have.
    """
    settings: Any = runtime.settings()
    if name == "auto":
        if settings.arch != "cuda" and (settings.threads == 1 or bond_count < RESIDENT_BELOW):
            return "resident"
        return "parallel" if settings.arch == "cuda" or bond_count >= PARALLEL_FROM else MEASURED
    if name == "resident" and settings.arch == "cuda":
        raise InputError(f"driver 'resident' {CPU_ONLY}: use 'parallel' with arch 'cuda'")
    return name


class AutoDriver:
    """Tries both drivers from time to time, a few substeps each.

    seconds: time for an evaluated member, the best of the last tries, by name of the driver. clock:
    returns seconds; replaced in tests. drivers: both, by name.
    """

    def __init__(
        self,
        step: Step,
        drivers: Mapping[str, Any],
        clock: Callable[[], float] = time.perf_counter,
    ):
        self.step, self.clock = step, clock
        self.drivers = {name: drivers[name] for name in (Parallel.name, Resident.name)}
        self.chosen = Resident.name
        self._begin()

    def _begin(self):
        """Try both again."""
        self.pending_tries = list(self.drivers) * _TRIES
        self.seconds, self.spent, self.since = {}, 0.0, 0.0

    @property
    def name(self) -> str:
        """Name of the chosen driver, marked as measured."""
        return f"{self.chosen} (measured)"

    def begin(self) -> None:
        """Run the phases of the start."""
        self.drivers[Resident.name].begin()

    def prepare(self) -> None:
        """Make a requested search, without a step; compiles both drivers."""
        for driver in self.drivers.values():
            driver.prepare()

    def run(self, end_tick: int) -> None:
        """Advance to a tick, to the next halt, for a try, or for about as long as the driver."""
        started = self.clock()
        if self.pending_tries:
            self._try(self.pending_tries.pop(0), end_tick)
            self.spent += self.clock() - started
        else:
            self.drivers[self.chosen].run(end_tick)
            self.since += self.clock() - started
            if self.since * _SHARE > self.spent:
                self._begin()

    def _try(self, name, end_tick):
        """Time some substeps by a driver; after the last try choose the faster one."""
        before, started = self._visited(), self.clock()
        self.drivers[name].few(end_tick, _SUBSTEPS)
        seconds = (self.clock() - started) / max(1, self._visited() - before)
        self.seconds[name] = min(seconds, self.seconds.get(name, seconds))
        if not self.pending_tries:
            self.chosen = min(self.seconds, key=lambda name: self.seconds[name])

    def _visited(self):
        """Number of bodies, bonds and pairs evaluated so far."""
        return int(values(self.step.schedule.evaluations)[1:4].sum())
