"""RK45 on the empty container: error against the transfer function over tolerance and step."""

import time

import numpy as np

from ca_damper import Batch, Empty, Oscillator, SceneTable, rk45
from taichi_dem.kit.plot_style import power
from taichi_dem.kit.study import Timing
from taichi_dem.kit.study.work_precision import Point

OSCILLATOR = Oscillator()
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)
#: A Batch takes at least 40 steps a cycle: the first is the longest [s].
STEPS = (3.9e-3, 1e-3, 2e-4)
PYTHON_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
CYCLES = 30
#: Samples a cycle from which the RMS of a sine is exact.
SAMPLES = 8


def rk45_points(frequency, repeats, quick):
    """(Points of all ways, seconds of compiling) at frequencies [Hz]; quick: every other point."""
    every = 2 if quick else 1
    jobs = [("rk45_tolerance", rtol, power(rtol), STEPS[0], rtol) for rtol in TOLERANCES[::every]]
    jobs += [("rk45_step", dt, f"{1e3 * dt:g} ms", dt, 1e-2) for dt in STEPS[::every]]
    points, compiling = [], 0.0
    for method, swept, label, dt, rtol in jobs:
        found, seconds = in_kernel(frequency, repeats, dt, rtol)
        points.append(Point(method, swept, label, *found))
        compiling += seconds
    for rtol in PYTHON_TOLERANCES[::every]:
        points.append(Point("rk45_python", rtol, power(rtol), *in_python(frequency, rtol)))
    return points, compiling


def response_error(rms, frequency):
    """Root mean square error of an RMS displacement [m], as a share of the peak."""
    exact = OSCILLATOR.rms(frequency)
    return float(np.sqrt(((rms - exact) ** 2).mean()) / exact.max())


def in_kernel(frequency, repeats, dt, rtol):
    """(Evaluations, error, timing) of a Batch, and its seconds of compiling."""
    table = SceneTable(0, 1, dt, frequency, OSCILLATOR.base_amplitude)
    batch = Batch(Empty(), table, measured_cycles=1, rtol=rtol, atol=1e-3 * rtol)
    seconds = []
    # The first run compiles.
    for _ in range(1 + repeats):
        started = time.perf_counter()
        batch.start("empty")
        rms = batch.run(CYCLES - 1, 1).rms
        seconds.append(time.perf_counter() - started)
    evaluations = 6 * int(batch.attempts().sum())
    found = evaluations, response_error(rms, frequency), Timing.of(seconds[1:])
    return found, batch.compile_seconds


def in_python(frequency, rtol):
    """(Evaluations, error, timing) of the last cycle, begun in the steady state."""
    started, x, evaluations = time.perf_counter(), [], 0
    for f in frequency:
        span, at = (0.0, CYCLES / f), (CYCLES - 1 + np.arange(SAMPLES) / SAMPLES) / f
        job = OSCILLATOR.right_hand_side(f), span, OSCILLATOR.steady_state(f)
        solution = rk45.solve(*job, rtol=rtol, atol=1e-3 * rtol, at=at)
        x.append(solution.y[:SAMPLES, 0])
        evaluations += solution.evaluations
    rms = np.sqrt(np.square(x).mean(axis=1) - np.mean(x, axis=1) ** 2)
    spent = Timing.of([time.perf_counter() - started])
    return evaluations, response_error(rms, frequency), spent
