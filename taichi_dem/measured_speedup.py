"""Measured speed-up of multirate stepping over the same bodies with one step for all.

The gains of a ``Report`` count evaluations. Changes of lists, tests for active bodies, and cache
lines that are used in part cost time beside them.
"""

from dataclasses import replace

import numpy as np

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.validation import LARGEST, instance, positive
from taichi_dem.simulation import Simulation
from taichi_dem.state.timeline import NEVER

#: Substeps to begin with.
_FIRST = 64
#: Fields that a twin does not copy: clock, steps, pending impulses, and account.
_ANEW = (
    *("level", "bound", "tick", "last_tick", "injected_tick", "slot", "max_speed2", "bad_body"),
    *("bond_heat", "contact_heat", "load_work", "load_impulse"),
)


def measured_speedup(simulation: Simulation, seconds: float = 0.5) -> float:
    """CPU time that one step for all would have taken, over that of a run so far.

    The number of evaluations with one step is counted during the run. Their cost is measured on a
    twin with an engine of its own: it begins at the present state, and all of its bodies take the
    smallest step present.

    Parameters
    ----------
    simulation : Simulation
        Simulation that was stepped, by a ``Multirate``.
    seconds : float, default 0.5
        CPU time of the measurement [s].

    Returns
    -------
    float
        The ratio; 1 for a run that had one step for all.

    Raises
    ------
    InputError
        An argument is out of its range.
    SimulationDiverged
        The twin leaves its bounds.
    """
    instance("simulation", simulation, Simulation)
    positive("seconds", seconds)
    if simulation.method.uniform or simulation.run_cpu_seconds == 0.0:
        return 1.0
    report = simulation.report()
    twin = _twin(simulation, report.smallest_step_s)
    substeps, spent, done = _FIRST, 0.0, 0
    while spent < seconds:
        spent, done = -twin.run_cpu_seconds, -twin.evaluations()
        twin.advance_to(substeps)
        spent, done = spent + twin.run_cpu_seconds, done + twin.evaluations()
        # A call costs time of its own: only a long one measures a substep.
        substeps *= 2
    return report.uniform_evaluations * spent / max(1, done) / report.run_cpu_seconds


def _twin(simulation, step):
    """A simulation at the same state with one step [s] for all, at time zero.

    Its largest step is that of all bodies, as none moves far enough in it to require less.
    """
    given = {name: simulation.values(field) for name, field in simulation.state.fields().items()}
    method = replace(simulation.method, dt0=step, distance=LARGEST)
    twin = Simulation(simulation.scene, method, simulation.driver.name.partition(" ")[0])
    for name, field in twin.state.fields().items():
        if name not in _ANEW:
            if name.endswith("_tick"):
                # Ticks have another length: all past events count as at the start.
                given[name] = np.where(given[name] == NEVER, NEVER, 0)
            assign(field, given[name])
    twin.start()
    # The velocities are half a step before the positions already.
    for name in ("velocity", "angular_momentum", "spin"):
        assign(getattr(twin.state, name), given[name])
    return twin
