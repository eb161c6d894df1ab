"""Structures under signals, shocks, let go and on floors move as the exact solution."""

import math

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Oscillator,
    RigidMass,
    SceneTable,
    excitation,
    logarithmic_decrement,
    shake,
)
from ca_damper.excitation import Excitation

PAPER = Oscillator()
TWO = ((4.3, 0.6e-3, 0.4), (9.1, 0.2e-3, -1.1))


def two_sines(duration=1.5):
    frequencies, amplitudes, phases = zip(*TWO)
    return excitation.sines(frequencies, amplitudes, duration, phases=phases)


def shaken(given, particles=0, **options):
    """History of a rigid mass without weight under an excitation."""
    return shake(RigidMass(gravity=0.0), given, particles=particles, seeds=1, **options)


def test_a_container_under_sines_of_base_and_force_moves_as_the_exact_solution():
    of_force = (5.7, 3e-2, 0.7)
    force = excitation.sines(*of_force[:2], 1.5, phases=of_force[2])
    made = shaken(Excitation(two_sines(), force))
    x, v = response(PAPER, made.time_s, TWO, (of_force,))
    # The spline is off by 3e-6 of the amplitude at most, the structure amplifies by 41 at most.
    allowed = 41 * 3e-6 * (0.8e-3 + of_force[1] / PAPER.stiffness)
    assert np.abs(made.x[:, 0, 0] - x).max() < allowed
    assert np.abs(made.v[:, 0, 0] - v).max() < 2 * np.pi * 9.1 * allowed
    fine = response(PAPER, np.arange(15001) * 1e-4, TWO, (of_force,))[0]
    assert made.peak[0, 0] == pytest.approx(np.abs(fine).max(), rel=1e-4)
    assert made.rms[0, 0] == pytest.approx(fine.std(), rel=1e-3)


def test_a_container_let_go_decays_as_the_closed_form():
    """From a displacement and a speed, on a base that stands still: exact to RK45's tolerance."""
    batch = Batch(RigidMass(), SceneTable(0, 1, 1e-4, 10.0, 0.0), recorded_samples=200)
    batch.start(displacement=5e-3, velocity=0.1)
    batch.run(10, 0, record_every=100)
    series = batch.time_series()
    x, v = response(PAPER, series["time_s"][:, 0], start=(5e-3, 0.1))
    assert series["x"][:, 0] == pytest.approx(x, abs=1e-9)
    assert series["v"][:, 0] == pytest.approx(v, abs=1e-7)


def recorded(every):
    """Record of twenty grains under two sines, of which so many steps make a sample; impulse."""
    table, room = SceneTable(20, 7, 1e-4, 2.5), {"measured_cycles": 1, "recorded_samples": 4001}
    batch = Batch(Automaton(), table, excitation=two_sines(0.4), **room)
    batch.start()
    record = batch.run(0, 1, record_every=every).record
    series = batch.time_series()
    assert batch.report().momentum_error < 1e-9
    return record, (series["force"][1:, 0] * np.diff(series["time_s"][:, 0])).sum()


def test_forces_between_samples_leave_none_out_and_recording_changes_no_bit():
    """Seven steps to a sample and some at the end: their impulse is that of every step."""
    records, impulses = zip(*map(recorded, (7, 1)))
    assert impulses[0] == pytest.approx(impulses[1], rel=1e-12) and impulses[0] < -1e-4
    assert np.array_equal(*records)


#: Half a sine of 10 g in 11 ms.
PEAK, LAST = 10.0 * 9.80665, 11e-3


def largest_stretch():
    """Of the paper's oscillator under the half-sine [m], by Duhamel's integral.

    Over 10,000 steps of the pulse by the trapezoidal rule, which is off by (pi / 10,000)^2 / 12.
    """
    decay = 0.5 * PAPER.damping / PAPER.mass
    turn = np.sqrt(PAPER.stiffness / PAPER.mass - decay**2)
    time, step = np.linspace(0.0, LAST, 10_001, retstep=True)
    pull = PEAK * np.sin(np.pi * time / LAST)
    later = np.linspace(LAST, 0.1, 10_001)
    away = np.exp(decay * time) * pull
    cosine, sine = step * (away @ np.cos(turn * time)), step * (away @ np.sin(turn * time))
    free = np.sin(turn * later) * cosine - np.cos(turn * later) * sine
    return float(np.abs(np.exp(-decay * later) * free / turn).max())


# The longest first: its engine has room for all.
@pytest.mark.parametrize("length", [0.5, 0.15])
def test_a_half_sine_stretches_the_spring_as_duhamel_says(length):
    """17.7 mm whatever the length of the record; samples of 1 ms miss a peak by (w dt)^2 / 8."""
    time = np.arange(round(length / 1e-4) + 1) * 1e-4
    pull = np.where(time < LAST, PEAK * np.sin(np.pi * time / LAST), 0.0)
    shock = excitation.from_samples(time, pull, of="acceleration")
    made = shake(RigidMass(), shock, particles=0, seeds=1, progress=None)
    wanted = largest_stretch()
    assert wanted == pytest.approx(17.7e-3, rel=3e-3)
    missed = (2.0 * np.pi * PAPER.natural_frequency * 1e-3) ** 2 / 8.0
    # The pulse is a polygon of 110 sides, smaller than the sine by (pi / 110)^2 / 12.
    assert made.relative_peak[0, 0] == pytest.approx(wanted, rel=missed + 7e-5)


#: A parabola through three samples a millisecond apart is off by (w h)^4 / 100 or so at 6 Hz.
APART = (2.0 * math.pi * 6.03 * 1e-3) ** 4


def exact(mass):
    """Decrement of the paper's structure with a mass [kg] in it."""
    ratio = PAPER.damping / (2.0 * math.sqrt(PAPER.stiffness * (PAPER.mass + mass)))
    return 2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2)


@pytest.mark.parametrize(("particles", "mass"), [(0, 0.0), (20, 4e-3)])
def test_decrement_of_a_linear_structure_is_its_closed_form(particles, mass):
    """At every amplitude, also about the place to which the weight of the mass pulls it."""
    still = excitation.sines(6.0, 0.0, 3.0)
    job = {"particles": particles, "seeds": 1, "progress": None}
    made = shake(RigidMass(), still, displacement=0.02, **job)
    amplitude, decrement = logarithmic_decrement(made.x[:, 0, 0])
    assert len(amplitude) > 25 and (np.diff(amplitude) < 0.0).all()
    # Of two amplitudes, each off by APART of itself and of the sag's share.
    assert decrement == pytest.approx(np.full(len(decrement), exact(mass)), abs=10.0 * APART)


def gain_of_a_spline(share):
    """Of the cubic spline through samples of a sine, share: its frequency by that of the samples.

    Its cardinal spline has the transform sinc^4 / (sum of its values at the samples).
    """
    return np.sinc(share) ** 4 * 3.0 / (2.0 + math.cos(2.0 * math.pi * share))


def record_at_resonance(frequency, rate, of, length=2.0):
    """A base whose acceleration is sin(w t), sampled, and a structure at whose resonance it is."""
    omega, time = 2.0 * np.pi * frequency, np.arange(round(length * rate) + 1) / rate
    turn = omega * time
    samples = {
        "acceleration": np.sin(turn),
        "velocity": (1.0 - np.cos(turn)) / omega,
        "value": (turn - np.sin(turn)) / omega**2,
    }
    own = Oscillator(0.1, 0.1 * omega**2, 2.0 * 0.02 * 0.1 * omega)
    return excitation.from_samples(time, samples[of], of=of), own


def at_resonance(motion, own):
    """RMS on the base of an empty structure by that of the exact solution, and the report."""
    made = shaken(motion, oscillator=own, progress=None)
    pull = ((own.natural_frequency, -own.mass, 0.0),)
    return made.relative[:, 0, 0].std() / response(own, made.time_s, force=pull)[0].std(), made


@pytest.mark.parametrize("of", ["acceleration", "velocity", "value"])
@pytest.mark.parametrize(("frequency", "rate"), [(6.0, 200.0), (11.0, 88.0)])
def test_a_record_at_the_resonance_is_followed_to_a_thousandth(frequency, rate, of):
    """From eight samples a period on: to what a cubic spline loses, 0.06 % there."""
    lost = 1.0 - gain_of_a_spline(frequency / rate)
    assert lost < 1e-3
    share, _ = at_resonance(*record_at_resonance(frequency, rate, of))
    # The ends of the spline, beside that.
    assert share == pytest.approx(1.0, abs=lost + 1e-5)


def test_too_few_samples_a_period_are_told_and_lose_what_a_spline_loses():
    motion, own = record_at_resonance(11.0, 50.0, "acceleration")
    with pytest.warns(UserWarning, match="base has fewer than 8 samples a period above 6.25 Hz"):
        share, made = at_resonance(motion, own)
    # The ends of the spline, beside the 0.8 %.
    assert share == pytest.approx(gain_of_a_spline(11.0 / 50.0), abs=1e-3)
    assert any("11 Hz" in words for words in made.report.excitation)


G = 9.8
MASS = 8e-3
#: Of the floor: natural frequency of the container on it [rad/s].
OMEGA = 2.0 * math.pi * 1000.0
STIFFNESS = MASS * OMEGA**2


def restitution(ratio):
    """Of a linear spring and dashpot that never pull, without gravity (Schwager, Poeschel 2007)."""
    turn = math.sqrt(1.0 - ratio**2)
    angle = math.pi - math.atan2(2.0 * ratio * turn, 1.0 - 2.0 * ratio**2)
    return math.exp(-ratio / turn * angle)


def box(particles=0, ratio=0.5, amplitude=0.0):
    """A batch of one box on the floor, of which every step is recorded."""
    damping = 2.0 * ratio * OMEGA * MASS
    table = SceneTable(particles, 1, 2e-5, 10.0, amplitude, MASS, STIFFNESS, damping)
    return Batch(RigidMass(gravity=G), table, mount="floor", recorded_samples=10_001)


def motion(batch, cycles):
    """Times, and place of the box and of the floor."""
    batch.run(cycles, 0, record_every=1)
    series = batch.time_series()
    return [series[name][:, 0] for name in ("time_s", "x", "y")]


def test_a_dropped_box_falls_and_rebounds_with_its_restitution():
    """From 20 mm; gravity matters in the blow by g / (w v), 0.25 %, of either speed."""
    height, batch = 0.02, box(ratio=0.2)
    batch.start(displacement=height)
    time, x, _ = motion(batch, 2)
    fall = math.sqrt(2.0 * height / G)
    flying = time < fall
    assert x[flying] == pytest.approx(height - 0.5 * G * time[flying] ** 2, abs=1e-9)
    after = x[time > fall + 1e-3]
    rise = after[: np.argmax(after < 0.0)].max()
    speed = math.sqrt(2.0 * G * height)
    gravity = 4.0 * G / (OMEGA * speed)
    assert math.sqrt(rise / height) == pytest.approx(restitution(0.2), rel=gravity)


def response(oscillator, time_s, base=(), force=(), mass=0.0, start=(0.0, 0.0)):
    """(x, v) at times; base, force: (frequency [Hz], amplitude, phase) of each sine.

    Steady states of all sines, and the free motion that lets it begin at ``start``. mass: fixed to
    the container [kg], without its weight.
    """
    o, total = oscillator, oscillator.mass + mass
    x, v = np.zeros(len(time_s), complex), np.zeros(len(time_s), complex)
    for pull, sines in ((True, base), (False, force)):
        for frequency, amplitude, phase in sines:
            w = 2.0 * np.pi * frequency
            held = o.stiffness + 1j * w * o.damping
            gain = (held if pull else 1.0) / (held - total * w * w)
            wave = gain * amplitude * np.exp(1j * (w * time_s + phase)) / 1j
            x, v = x + wave, v + 1j * w * wave
    x, v = x.real, v.real
    decay, natural = 0.5 * o.damping / total, np.sqrt(o.stiffness / total)
    turn = np.sqrt(natural**2 - decay**2)
    a = start[0] - x[0]
    b = (start[1] - v[0] + decay * a) / turn
    shrink, sine, cosine = np.exp(-decay * time_s), np.sin(turn * time_s), np.cos(turn * time_s)
    free = shrink * (a * cosine + b * sine)
    return x + free, v - decay * free + shrink * turn * (b * cosine - a * sine)
