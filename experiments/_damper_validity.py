"""Cases of damper_validity.py: what is measured in each, and the impact damper in closed form."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ca_damper import Batch, ImpactDamper, Oscillator, SceneTable, film
from ca_damper.plot import Box, FilmMeasures
from ca_damper.report.measures import first_harmonic, peak
from ca_damper.runs.response import frequency_response

#: Amplitude [m] and frequency [Hz] of the swinging grains.
SWING = 24e-3, 6.0
#: Frames a cycle.
FRAMES = 32
#: Grains and frequency [Hz] of the loss, gravity that accelerations are multiples of [m/s^2].
LOSS_GRAINS, LOSS_FREQUENCY, STANDARD_GRAVITY = 30, 50.0, 9.81
#: Grains without gravity, frequency [Hz], and amplitudes between which the jump is sought [m].
PLUG_GRAINS, PLUG_FREQUENCY, JUMP = 40, 6.0, np.arange(17e-3, 27.1e-3, 1e-3)
#: Share of the container's mass of the impact damper's grain, clearance in cells.
IMPACT_SHARE, IMPACT_CELLS = 0.1, 2


@dataclass(frozen=True)
class Effort:
    """What is spent: seeds, cycles left out, cycles measured; batches and reports made so far."""

    seeds: int
    transient: int
    cycles: int
    made: list = field(default_factory=list)

    def batch(self, filling, table, **options):
        """A batch that has been started."""
        batch = Batch(filling, table, **options)
        self.made.append(batch)
        batch.start()
        return batch


def scenes(filling, dt, particles, effort, **numbers):
    """Table of a number of particles and all seeds."""
    return SceneTable(np.full(effort.seeds, particles), np.arange(effort.seeds) + 1, dt, **numbers)


def mean_height(filling, dt, particles, effort):
    """Mean height of the grains [mm] over the phases of the swinging container, and the phases."""
    table = scenes(filling, dt, particles, effort, frequency=SWING[1], base_amplitude=SWING[0])
    batch, box = effort.batch(filling, table, mount="base"), Box.of(filling)
    batch.run(effort.transient, 0)
    steps, frames = int(batch.steps_per_cycle[0]), []
    phase = np.arange(FRAMES) * (steps // FRAMES) / steps
    for _ in range(effort.cycles):
        shot = film(batch, steps, sample_every=steps, frame_every=steps // FRAMES, progress=None)
        frames += [cycle[:FRAMES] for cycle in shot.frames]
    return phase, FilmMeasures.of(box, frames, phase).mean_height_mm


def swing_apart(curve, reference):
    """RMS gap [mm], and by how much the swing [mm] and the lag [degrees] differ."""
    swings = [first_harmonic(*one) for one in (curve, reference)]
    gap = float(np.sqrt(((curve[1] - reference[1]) ** 2).mean()))
    lag = (swings[0][1] - swings[1][1] + 180.0) % 360.0 - 180.0
    return gap, swings[0][0] - swings[1][0], lag


def driven(filling, dt, particles, amplitude, frequency, effort):
    """Cycles of containers that are moved; amplitude [m] and frequency [Hz], scalars or arrays.

    Scenes are the amplitudes and frequencies, all seeds of one after the other.
    """
    both = np.broadcast_arrays(np.atleast_1d(amplitude), frequency, particles)
    amplitude, frequency, count = (np.repeat(one, effort.seeds) for one in both)
    seed = np.tile(np.arange(effort.seeds) + 1, len(both[0]))
    table = SceneTable(count, seed, dt, frequency, amplitude)
    batch = effort.batch(filling, table, mount="base", measured_cycles=effort.cycles)
    return batch.run(effort.transient, effort.cycles)


def by_scene(values, effort):
    """Mean over the seeds."""
    return values.reshape(-1, effort.seeds).mean(axis=1)


def loss_and_mass(filling, dt, acceleration, effort):
    """Loss c / (N m w) and apparent mass / (N m) at an acceleration in units of gravity.

    Medians over the seeds: a heap has several motions at 5 g.
    """
    omega = 2.0 * math.pi * LOSS_FREQUENCY
    amplitude = acceleration * STANDARD_GRAVITY / omega**2
    cycles = driven(filling, dt, LOSS_GRAINS, amplitude, LOSS_FREQUENCY, effort)
    mass = LOSS_GRAINS * filling.particle_mass
    loss = cycles.apparent_damping / (mass * omega)
    return float(np.median(loss)), float(np.median(cycles.apparent_mass / mass))


def plug_energy(filling, dt, amplitude, effort):
    """Energy that grains without gravity take a cycle, over N m A^2 w^2; an array."""
    grains = replace(filling, gravity=0.0)
    cycles = driven(grains, dt, PLUG_GRAINS, amplitude, PLUG_FREQUENCY, effort)
    size = PLUG_GRAINS * filling.particle_mass * (2.0 * math.pi * PLUG_FREQUENCY) ** 2
    taken = by_scene(cycles.complex_power.real / PLUG_FREQUENCY, effort)
    return taken / (size * np.asarray(amplitude) ** 2)


def jump_amplitude(amplitude, energy):
    """Least amplitude [mm] at which the energy passes half of its largest; linear between."""
    level = 0.5 * energy.max()
    k = int(np.argmax(energy > level))
    if k == 0:
        return 1e3 * float(amplitude[0])
    share = (level - energy[k - 1]) / (energy[k] - energy[k - 1])
    return 1e3 * float(amplitude[k - 1] + share * (amplitude[k] - amplitude[k - 1]))


def impact_grain(filling):
    """An automaton with the one grain of the impact damper."""
    mass = IMPACT_SHARE * Oscillator().mass
    box = {"columns": 1, "rows": IMPACT_CELLS + 1}
    return replace(filling, gravity=0.0, particle_mass=mass, **box)


def impact_rms(filling, dt, effort):
    """RMS of the structure with an impact damper at its natural frequency [mm]."""
    table = SceneTable(1, 1, dt, Oscillator().natural_frequency, Oscillator().base_amplitude)
    batch = effort.batch(impact_grain(filling), table, measured_cycles=50)
    return 1e3 * float(batch.run(400, 50).rms[0])


def exact_impact_rms(restitution, clearance):
    """The same [mm], two blows a cycle, in closed form."""
    own = Oscillator()
    mass = IMPACT_SHARE * own.mass
    case = ImpactDamper(own, mass, restitution, clearance, own.natural_frequency)
    return 1e3 * case.rms(max(case.speeds))


def peak_of(filling, dt, particles, ratios, effort):
    """Frequency ratio and RMS [mm] of the peak of the median over the seeds."""
    response = frequency_response(
        filling,
        particles=[particles],
        ratios=ratios,
        seeds=effort.seeds,
        dt=dt,
        transient_cycles=effort.transient,
        measured_cycles=effort.cycles,
        progress=None,
    )
    effort.made.append(response.report)
    ratio, rms = peak(ratios, np.median(response.rms[0], axis=1))
    return ratio, 1e3 * rms


def late_by_early(filling, dt, effort, cycles):
    """RMS of ten grains near resonance after so many cycles, over that after the transient."""
    own = Oscillator()
    table = scenes(
        *(filling, dt, 10, effort),
        **{"frequency": 0.985 * own.natural_frequency, "base_amplitude": own.base_amplitude},
    )
    measured = max(1, cycles // 8)
    batch = effort.batch(filling, table, measured_cycles=measured)
    early = batch.run(effort.transient, measured).rms.mean()
    late = batch.run(cycles - effort.transient - 2 * measured, measured).rms.mean()
    return float(late / early)


def impedance_apart(
    fillings: dict[str, tuple[Any, float]], particles, accelerations, frequencies, effort
):
    """Difference of the impedance of the others from that of the spheres, as a share of it.

    Arrays (accelerations, frequencies) by name of the filling.
    """
    grid = np.meshgrid(accelerations, frequencies, indexing="ij")
    gravity, frequency = (one.ravel() for one in grid)
    amplitude = gravity * STANDARD_GRAVITY / (2.0 * math.pi * frequency) ** 2
    found = {}
    for name, (filling, dt) in fillings.items():
        cycles = driven(filling, dt, particles, amplitude, frequency, effort)
        found[name] = by_scene(cycles.impedance, effort).reshape(grid[0].shape)
    exact = found.pop("dem")
    return {name: abs(one - exact) / abs(exact) for name, one in found.items()}
