"""Check of a whole run: the container must move as the force measured on it demands.

By M x'' + C x' + K x = K y + C y' + f for the first harmonics, with Y = -i y0. Over whole cycles of
length T the harmonic of x' is i w X + 2 (x_end - x_begin) / T, and so on: the motion need not be
periodic.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import Cycles
from ca_damper.runs.response import Grid, Response


def force_mismatch(
    cycles: Cycles,
    oscillator: Oscillator,
    begin: Mapping[str, np.ndarray],
    end: Mapping[str, np.ndarray],
) -> float:
    """Distance of the first harmonic of x from that by the measured force, as a share of the peak.

    Largest over the scenes. begin, end: of ``Batch.sample`` at both ends of the measured cycles.
    """
    o, omega = oscillator, cycles.omega
    share = 2.0 * cycles.frequency / cycles.record.shape[1]
    shift, push = share * (end["x"] - begin["x"]), share * (end["v"] - begin["v"])
    held = o.stiffness + 1j * omega * o.damping
    given = -1j * o.base_amplitude * held + cycles.harmonic("f")
    given -= o.mass * push + (1j * omega * o.mass + o.damping) * shift
    x = cycles.harmonic("x")
    distance = np.abs(given / (held - o.mass * omega**2) - x)
    return float(np.nanmax(distance) / np.nanmax(np.abs(x)))


def checked_response(
    filling: Any,
    *,
    particles: Any,
    ratios: Any,
    transient_cycles: int,
    measured_cycles: int,
    seeds: Any = 5,
    oscillator: Any = None,
    dt: Any = None,
    start: str = "rest",
    progress: Any = None,
) -> tuple[Response, float]:
    """Response curves as of ``frequency_response``, and their ``force_mismatch``.

    progress: called with a BatchProgress, or None. Raises InputError, SimulationDiverged.
    """
    grid = Grid(filling, particles, ratios, seeds, oscillator, dt)
    batch = grid.batch(grid.ratios, measured_cycles)
    batch.start(start)
    batch.run(transient_cycles, 0, progress)
    begin = batch.sample()
    cycles = batch.run(0, measured_cycles, progress)
    mismatch = force_mismatch(cycles, grid.oscillator, begin, batch.sample())
    (found,) = grid.responses(batch, cycles)
    return replace(found, report=batch.report()), mismatch
