"""Measured speed-up of multirate stepping over the same bodies with one step for all.

The gains of a ``Report`` count evaluations. Changes of lists, tests for active bodies, and cache
lines that are used in part cost time beside them.
"""

import contextlib
from dataclasses import is_dataclass, replace
from typing import Optional

import numpy as np

from taichi_dem.kit.allocation import assign, values
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.kit.progress.progress import listening
from taichi_dem.kit.validation import LARGEST
from taichi_dem.simulation import Simulation
from taichi_dem.state.timeline import NEVER

#: Substeps to begin with.
_FIRST = 64
#: Share of a run's CPU time that the measurement takes at its end, and the most of it [s].
SHARE, MOST_SECONDS = 0.1, 0.5
#: Shorter runs are not measured [s].
LEAST_RUN = 0.5
#: Fields that a twin does not copy: clock, steps, pending impulses, and account.
_ANEW = (
    *("level", "bound", "tick", "last_tick", "injected_tick", "slot", "max_speed2", "bad_body"),
    *("bond_heat", "contact_heat", "load_work", "load_impulse"),
)


def speedup_of_run(simulation: Simulation) -> Optional[float]:
    """Call ``measured_speedup`` for a share of the run's own time; None if not measurable.

    That is where the run was too short, or where its twin diverges, although the run did not.
    """
    spent = simulation.run_cpu_seconds
    if simulation.method.uniform or spent < LEAST_RUN or not is_dataclass(simulation.method):
        return None
    # The run is over: its listeners are told nothing of a twin.
    with contextlib.suppress(SimulationDiverged), listening(lambda _: None):
        return measured_speedup(simulation, min(MOST_SECONDS, SHARE * spent))
    return None


def measured_speedup(simulation: Simulation, seconds: float = MOST_SECONDS) -> float:
    """CPU time that one step for all would have taken, over that of the run; 1 if it had one step.

    The number of evaluations with one step is counted during the run. Their cost is measured for a
    number of CPU seconds on a twin: it begins at the present state, and all of its bodies take the
    smallest step present. The simulation itself becomes the twin, so its run must be over.
    Raises SimulationDiverged when the twin leaves its bounds.
    """
    if simulation.method.uniform or simulation.run_cpu_seconds == 0.0:
        return 1.0
    report = simulation.report()
    _become_twin(simulation, report.smallest_step_s)
    substeps, spent, done = _FIRST, 0.0, 0
    while spent < seconds:
        spent, done = -simulation.run_cpu_seconds, -simulation.evaluations()
        simulation.advance_to(substeps)
        spent, done = spent + simulation.run_cpu_seconds, done + simulation.evaluations()
        # A call costs time of its own: only a long one measures a substep.
        substeps *= 2
    return report.uniform_evaluations * spent / max(1, done) / report.run_cpu_seconds


def _become_twin(simulation, step):
    """Begin at the same state with one step [s] for all, at time zero.

    The largest step is that of all bodies, as none moves far enough in it to require less.
    """
    state = simulation.state
    given = {name: values(field) for name, field in state.fields().items()}
    simulation.driver = simulation.engine.drivers[simulation.driver.name.partition(" ")[0]]
    simulation.reset(method=replace(simulation.method, dt0=step, distance=LARGEST))
    for name, field in state.fields().items():
        if name.endswith("_tick"):
            # Ticks have another length: all past events count as at the start.
            given[name] = np.where(given[name] == NEVER, NEVER, 0)
        if name not in _ANEW:
            assign(field, given[name])
    simulation.start()
    # The velocities are half a step before the positions already.
    for name in ("velocity", "angular_momentum", "spin"):
        assign(getattr(state, name), given[name])
