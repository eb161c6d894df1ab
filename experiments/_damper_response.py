"""A response curve of the damper as a job to be timed, and the distance of two of them."""

from dataclasses import dataclass

import numpy as np

from ca_damper import Batch, Oscillator, SceneTable
from taichi_dem.kit.study import Timing

OSCILLATOR = Oscillator()


@dataclass(frozen=True)
class Job:
    """A response curve: particles, ratios f/f0, cycles before measuring, cycles measured."""

    particles: int
    ratios: tuple
    transient: int
    measured: int

    @property
    def frequency(self):
        """Frequencies [Hz], (ratios,)."""
        return np.array(self.ratios) * OSCILLATOR.natural_frequency


@dataclass(frozen=True, eq=False)
class Curve:
    """A measured response curve.

    rms: RMS displacement [m], (ratios, seeds). timing: a Timing of the run without compiling.
    compile_s: seconds. particle_steps: particles times steps of all scenes. balance: share by which
    the mean force on the container misses the weight of the particles, mean over scenes.
    force_check: how far the first harmonic of x is from the one that the measured force on the
    container gives by the transfer function, largest over scenes, as a share of the peak.
    """

    rms: np.ndarray
    timing: Timing
    compile_s: float
    particle_steps: int
    balance: float
    force_check: float

    @property
    def mean(self):
        """Mean over seeds [m], (ratios,)."""
        return self.rms.mean(axis=1)


def scene_steps(job, dt, seeds):
    """Steps of all scenes of a job; dt is shortened to whole steps a cycle."""
    a_cycle = np.ceil(1.0 / (job.frequency * dt) * (1.0 - 1e-12)).sum()
    return int(a_cycle) * seeds * (job.transient + job.measured)


def simulate(filling, job, dt, seeds, *, repeats=1, enough=0.0, ulps=0, progress=None):
    """Run a job at a step [s] for some seeds; returns a Curve. Raises what a Batch raises.

    The container starts in the steady state of a rigid mass of the particles' weight. repeats: of
    the timing, fewer when together they took ``enough`` [s]. ulps: last bits by which the base's
    amplitude differs from the paper's, one for all or (seeds,).
    """
    base = OSCILLATOR.base_amplitude + np.spacing(OSCILLATOR.base_amplitude) * np.array(ulps)
    base = np.broadcast_to(base, len(seeds))
    frequency, seed = (grid.ravel() for grid in np.meshgrid(job.frequency, seeds, indexing="ij"))
    table = SceneTable(job.particles, seed, dt, frequency, np.tile(base, len(job.ratios)))
    batch = Batch(filling, table, measured_cycles=job.measured)
    seconds = []
    while not seconds or (len(seconds) < repeats and sum(seconds) < enough):
        batch.start("rigid")
        before = batch.run_seconds
        batch.run(job.transient, 0, progress)
        begin = batch.sample()
        cycles = batch.run(0, job.measured, progress)
        end = batch.sample()
        seconds.append(batch.run_seconds - before)
    weight = job.particles * filling.particle_mass * filling.gravity
    steps = int(batch.steps_per_cycle.sum()) * (job.transient + job.measured)
    return Curve(
        rms=cycles.rms.reshape(len(job.ratios), len(seeds)),
        timing=Timing.of(seconds),
        compile_s=batch.compile_seconds,
        particle_steps=job.particles * steps,
        balance=abs(float(cycles.mean_force.mean()) + weight) / weight,
        force_check=_force_check(cycles, begin, end),
    )


def _force_check(cycles, begin, end):
    """By M x'' + C x' + K x = K y + C y' + f for the first harmonics, Y = -i y0.

    Over whole cycles of length T the harmonic of x' is i w X + 2 (x_end - x_begin) / T, and so on:
    the motion need not be periodic.
    """
    o, omega = OSCILLATOR, cycles.omega
    share = 2.0 * cycles.frequency / cycles.record.shape[1]
    shift, push = share * (end["x"] - begin["x"]), share * (end["v"] - begin["v"])
    held = o.stiffness + 1j * omega * o.damping
    given = -1j * o.base_amplitude * held + cycles.harmonic("f")
    given -= o.mass * push + (1j * omega * o.mass + o.damping) * shift
    x = cycles.harmonic("x")
    return float(np.abs(given / (held - o.mass * omega**2) - x).max() / np.abs(x).max())


def distance(curve, reference):
    """Root mean square over the ratios of a difference, as a share of the reference's peak."""
    gap = np.asarray(curve) - np.asarray(reference)
    return float(np.sqrt((gap**2).mean()) / np.max(reference))


def seed_variance(rms):
    """Variance from seed to seed as a share of the peak squared, mean over the ratios."""
    rms = np.asarray(rms)
    return float(rms.var(axis=1, ddof=1).mean() / rms.mean(axis=1).max() ** 2)
