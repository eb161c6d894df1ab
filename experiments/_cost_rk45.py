"""RK45 on the empty container: error against the transfer function over tolerance and step."""

import numpy as np

from _damper_response import OSCILLATOR
from _timing import measure
from _work_precision import Point
from ca_damper import Batch, Empty, SceneTable, rk45
from taichi_dem.kit.plot_style import power

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
    """Root mean square of what an RMS displacement [m] misses, as a share of the peak."""
    exact = OSCILLATOR.base_amplitude * abs(OSCILLATOR.transfer(frequency)) / np.sqrt(2.0)
    return float(np.sqrt(((rms - exact) ** 2).mean()) / exact.max())


def _in_kernel(job, repeats, dt, rtol):
    table = SceneTable(0, 1, dt, job.frequency, OSCILLATOR.base_amplitude)
    batch = Batch(Empty(), table, measured_cycles=1, rtol=rtol, atol=1e-3 * rtol)
    seen = []

    def work():
        batch.start("empty")
        seen[:] = [batch.run(CYCLES - 1, 1).rms]

    timing = measure(work, repeats)
    evaluations = 6 * int(batch.attempts().sum())
    result = evaluations, response_error(seen[0], job.frequency), timing
    return result, batch.compile_seconds


def _in_python(job, rtol):
    evaluations, rms = 0, []

    def work():
        nonlocal evaluations
        evaluations, rms[:] = 0, []
        for frequency in job.frequency:
            solution = solve_cycles(frequency, rtol)
            evaluations += solution.evaluations
            x = solution.y[:SAMPLES, 0]
            rms.append(np.sqrt((x**2).mean() - x.mean() ** 2))

    timing = measure(work, repeats=1, warm_up=0)
    return evaluations, response_error(np.array(rms), job.frequency), timing


def solve_cycles(frequency, rtol):
    """The empty container from its steady state; what is given is the last of the cycles."""
    o, omega = OSCILLATOR, 2.0 * np.pi * frequency

    def slope(t, state):
        y, rate = np.sin(omega * t), omega * np.cos(omega * t)
        push = o.base_amplitude * (o.stiffness * y + o.damping * rate)
        return np.array([state[1], (push - o.stiffness * state[0] - o.damping * state[1]) / o.mass])

    at = (CYCLES - 1 + np.arange(SAMPLES) / SAMPLES) / frequency
    start = o.steady_state(frequency)
    return rk45.solve(slope, (0.0, CYCLES / frequency), start, rtol=rtol, atol=1e-3 * rtol, at=at)
