"""The motion by the measured force, the transfer function's closed forms, distances of curves."""

import numpy as np
import pytest
from PIL import Image

from ca_damper import Automaton, Oscillator, frequency_response, rk45
from ca_damper.force_check import checked_response, force_mismatch
from ca_damper.measures import COLUMNS, Cycles, curve_distance, seed_variance
from ca_damper.plot import picture_compared

JOB = {"particles": 10, "ratios": (0.95, 1.0), "seeds": 2, "dt": 2e-4}
CYCLES = {"transient_cycles": 3, "measured_cycles": 4, "start": "rigid"}


@pytest.fixture(scope="module")
def checked():
    return checked_response(Automaton(), **JOB, **CYCLES)


def test_a_checked_response_has_the_bits_of_the_response(checked):
    response, _ = checked
    plain = frequency_response(Automaton(), **JOB, **CYCLES, progress=None)
    assert np.array_equal(response.rms, plain.rms)
    assert np.array_equal(response.mean_force, plain.mean_force)
    assert response.report.scene_steps == plain.report.scene_steps


def test_the_container_moves_as_the_measured_force_demands(checked):
    """Sums take x at n points a cycle: an n-th part of its change over the cycles is missed."""
    _, mismatch = checked
    assert 0.0 < mismatch < 1e-3


def made_cycles(oscillator, x, force):
    """One measured cycle of exact harmonics x and f at the natural frequency."""
    frequency, steps = np.array([oscillator.natural_frequency]), np.array([1000])
    sums = dict.fromkeys(COLUMNS, 0.0)
    sums.update(x_cos=500.0 * x.real, x_sin=-500.0 * x.imag)
    shrunk = 500.0 * force * np.sinc(1e-3)
    sums.update(f_cos=shrunk.real, f_sin=-shrunk.imag)
    return Cycles(frequency, steps, np.array([[list(sums.values())]]))


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_a_force_that_is_not_the_one_that_acted_is_found_out(share):
    """X = (K + i w C)(-i y0 + F / held) / ...: a share more of the force shifts X by as much."""
    o = Oscillator()
    omega = 2.0 * np.pi * o.natural_frequency
    held = o.stiffness + 1j * omega * o.damping
    force, dynamic = 0.02 + 0.01j, held - o.mass * omega**2
    x = (-1j * o.base_amplitude * held + force) / dynamic
    still = {"x": np.zeros(1), "v": np.zeros(1)}
    cycles = made_cycles(o, x, (1.0 + share) * force)
    wanted = share * abs(force / dynamic) / abs(x)
    assert force_mismatch(cycles, o, still, still) == pytest.approx(wanted, abs=1e-12)


def test_rms_is_that_of_the_motion_from_the_right_hand_side():
    """RMS of eight samples a cycle of a sine is exact."""
    o, frequency = Oscillator(), 5.5
    times = (2 + np.arange(8) / 8) / frequency
    job = o.right_hand_side(frequency), (0.0, 3 / frequency), o.steady_state(frequency)
    found = rk45.solve(*job, rtol=1e-11, atol=1e-14, at=times)
    assert np.sqrt((found.y[:, 0] ** 2).mean()) == pytest.approx(o.rms(frequency), rel=1e-7)
    assert o.rms(o.peak()[0] * o.natural_frequency) == pytest.approx(o.peak()[1], rel=1e-12)


def test_distance_of_curves_is_a_share_of_the_reference_s_peak():
    """Differences 3 and 4 at two frequencies, sqrt(25 / 2), over a peak of 10."""
    assert curve_distance([7.0, 9.0], [10.0, 5.0]) == pytest.approx(np.sqrt(12.5) / 10.0)


def test_variance_of_seeds_is_a_share_of_the_peak_squared():
    """Variances 2 and 8 of two seeds at two frequencies, over a peak of means of 10."""
    assert seed_variance([[9.0, 11.0], [3.0, 7.0]]) == pytest.approx(5.0 / 100.0)


def test_curves_of_several_fillings_stand_in_one_picture(tmp_path, checked):
    path, ratios = tmp_path / "curves.png", JOB["ratios"]
    rms = checked[0].rms[0]
    picture_compared(path, {"ca_static": (ratios, rms), "dem": (ratios, 2 * rms)}, Oscillator())
    with Image.open(path) as image:
        assert len(np.unique(np.asarray(image.convert("L")))) > 20
