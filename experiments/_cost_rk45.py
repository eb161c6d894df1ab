"""RK45 on the empty container: error against the transfer function over tolerance and step."""

import time

import numpy as np

from _damper_response import OSCILLATOR
from ca_damper import Batch, Empty, SceneTable, rk45
from taichi_dem.kit.plot_style import power
from taichi_dem.kit.study import Timing
from taichi_dem.kit.study.work_precision import Point

WAYS = ("rk45_tolerance", "rk45_step", "rk45_python")
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)
STEPS = (3.9e-3, 1e-3, 2e-4)
PYTHON_TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
#: A Batch takes at least 40 steps a cycle.
LONGEST = 3.9e-3
CYCLES = 30
#: Samples a cycle from which the RMS of a sine is exact.
SAMPLES = 8


def rk45_points(job, repeats, quick):
    """(Points of all ways, seconds spent on compiling); quick: every other point."""
    every = 2 if quick else 1
    points, compiling = [], 0.0
    kernel = [("rk45_tolerance", rtol, power(rtol), LONGEST, rtol) for rtol in TOLERANCES[::every]]
    kernel += [("rk45_step", dt, f"{1e3 * dt:g} ms", dt, 1e-2) for dt in STEPS[::every]]
    for method, swept, label, dt, rtol in kernel:
        point, seconds = _in_kernel(job, repeats, dt, rtol)
        points.append(Point(method, swept, label, *point))
        compiling += seconds
    for rtol in PYTHON_TOLERANCES[::every]:
        points.append(Point("rk45_python", rtol, power(rtol), *_in_python(job, rtol)))
    return points, compiling


def response_error(rms, frequency):
    """Root mean square error of an RMS displacement [m], as a share of the peak."""
    exact = OSCILLATOR.base_amplitude * abs(OSCILLATOR.transfer(frequency)) / np.sqrt(2.0)
    return float(np.sqrt(((rms - exact) ** 2).mean()) / exact.max())


def _in_kernel(job, repeats, dt, rtol):
    table = SceneTable(0, 1, dt, job.frequency, OSCILLATOR.base_amplitude)
    batch = Batch(Empty(), table, measured_cycles=1, rtol=rtol, atol=1e-3 * rtol)
    seconds = []
    # The first run compiles.
    for _ in range(1 + repeats):
        started = time.perf_counter()
        batch.start("empty")
        rms = batch.run(CYCLES - 1, 1).rms
        seconds.append(time.perf_counter() - started)
    evaluations = 6 * int(batch.attempts().sum())
    result = evaluations, response_error(rms, job.frequency), Timing.of(seconds[1:])
    return result, batch.compile_seconds


def _in_python(job, rtol):
    started = time.perf_counter()
    solutions = [solve_cycles(frequency, rtol) for frequency in job.frequency]
    x = np.array([solution.y[:SAMPLES, 0] for solution in solutions])
    rms = np.sqrt((x**2).mean(axis=1) - x.mean(axis=1) ** 2)
    timing = Timing.of([time.perf_counter() - started])
    evaluations = sum(solution.evaluations for solution in solutions)
    return evaluations, response_error(rms, job.frequency), timing


def solve_cycles(frequency, rtol):
    """Motion of the empty container in the last of its cycles, begun in the steady state."""
    o, omega = OSCILLATOR, 2.0 * np.pi * frequency

    def slope(t, state):
        y, rate = np.sin(omega * t), omega * np.cos(omega * t)
        push = o.base_amplitude * (o.stiffness * y + o.damping * rate)
        return np.array([state[1], (push - o.stiffness * state[0] - o.damping * state[1]) / o.mass])

    at = (CYCLES - 1 + np.arange(SAMPLES) / SAMPLES) / frequency
    start = o.steady_state(frequency)
    return rk45.solve(slope, (0.0, CYCLES / frequency), start, rtol=rtol, atol=1e-3 * rtol, at=at)
