"""A shock acts as it is given, and a report says what was done to samples and how they end."""

import numpy as np
import pytest

from ca_damper import Empty, Oscillator, excitation, shake
from ca_damper.excitation.signal import spline

PAPER = Oscillator()
#: Half a sine of 10 g in 11 ms.
PEAK, LAST = 10.0 * 9.80665, 11e-3


def shock(length, **options):
    """The half-sine in a record of a length [s], in steps of 0.1 ms."""
    time = np.arange(round(length / 1e-4) + 1) * 1e-4
    pull = np.where(time < LAST, PEAK * np.sin(np.pi * time / LAST), 0.0)
    return excitation.from_samples(time, pull, of="acceleration", **options)


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


@pytest.mark.parametrize("length", [0.15, 0.3, 1.0])
def test_a_half_sine_stretches_the_spring_as_duhamel_says(length):
    """17.7 mm whatever the length of the record; samples of 1 ms miss a peak by (w dt)^2 / 8."""
    made = shake(Empty(), shock(length), particles=0, seeds=1, progress=None)
    wanted = largest_stretch()
    assert wanted == pytest.approx(17.7e-3, rel=3e-3)
    missed = (2.0 * np.pi * PAPER.natural_frequency * 1e-3) ** 2 / 8.0
    # The pulse is a polygon of 110 sides, smaller than the sine by (pi / 110)^2 / 12.
    assert made.relative_peak[0, 0] == pytest.approx(wanted, rel=missed + 7e-5)


def told(**options):
    """What the report of a run under a record of 0.15 s says of it."""
    made = shake(Empty(), shock(0.15, **options), particles=0, seeds=1, progress=None)
    (words,) = made.report.excitation
    assert f"excitation         {words}\n" in str(made.report)
    start = "base samples, 0.15 s; integrated twice from rest, "
    assert words.startswith(start)
    return words[len(start) :]


def test_a_report_says_what_was_done_to_samples():
    """The base gains 2 / pi times 10 g 11 ms, over the record less half a pulse.

    The line a + b t has the speed a T + b T^2 / 2 and the place a T^2 / 2 + b T^3 / 6 at the end.
    """
    length, speed = 0.15, 2.0 / np.pi * PEAK * LAST
    place = speed * (length - 0.5 * LAST)
    gained = f"{speed:.3g} m/s and {place:.3g} m"
    first, slope = np.linalg.solve(
        [[length, length**2 / 2.0], [length**2 / 2.0, length**3 / 6.0]], [speed, place]
    )
    plain, corrected = told(), told(correct_baseline=True)
    assert plain == (
        "no base line taken off; begins at 0 m and 0 m/s, "
        f"ends at {place:.3g} m and {speed:.3g} m/s"
    )
    assert corrected == (
        f"less a base line of acceleration from {first:.3g} to {first + slope * length:.3g} m/s^2 "
        f"that takes {gained} away; begins at 0 m and 0 m/s, ends at 0 m and 0 m/s"
    )


def test_times_that_are_evened_and_a_scaled_signal_say_so():
    time = np.arange(100) * 0.01
    late = time + 3e-4 * (np.arange(100) == 50)
    even = excitation.from_samples(time, time, of="value")
    made = excitation.from_samples(late, time, of="value").scaled(2.0)
    assert even.treated == "" and made.treated == "times evened by up to 0.0003 s"
    assert made.in_words("N").startswith("2 times samples, 0.99 s; times evened by up to 0.0003 s;")


def test_a_label_may_hold_braces():
    """As the name of a file may."""
    made = spline(0.01, np.zeros(9), "run{a}{}")
    assert made.in_words("m").startswith("run{a}{}, 0.08 s; ")
