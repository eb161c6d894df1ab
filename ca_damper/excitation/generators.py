"""Signals from formulas: several sines, sweeps, random vibration of a given spectral density."""

import math
from typing import Any

import numpy as np

from ca_damper.excitation.samples import OF
from ca_damper.excitation.signal import MOST_NODES, Signal, spline
from taichi_dem.kit.elementary import sines_and_cosines
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import (
    LARGEST,
    between,
    choice,
    positive,
    several,
    shown,
    told_apart,
    whole,
)

#: Nodes in a cycle of the highest frequency.
NODES_A_CYCLE = 40
WAYS = ("linear", "logarithmic")


def sines(
    frequencies: Any,
    amplitudes: Any,
    duration: float,
    *,
    phases: Any = 0.0,
    of: str = "value",
) -> Signal:
    """Sum of sines, amplitude * sin(2 pi frequency t + phase).

    Parameters
    ----------
    frequencies : float or sequence of float
        Frequencies [Hz], one or several.
    amplitudes : float or sequence of float
        Amplitudes, in the unit of the value or of its acceleration, see ``of``.
    duration : float
        Duration [s].
    phases : float or sequence of float, default 0.0
        Phases [rad]. Frequencies, amplitudes and phases are broadcast against each other.
    of : str, default "value"
        ``"value"`` or ``"acceleration"``: what the amplitudes belong to.

    Examples
    --------
    >>> sines([5.0, 8.0], [1e-3, 5e-4], duration=2.0).duration
    2.0
    """
    choice("of", of, OF)
    lists = [several("frequencies", frequencies, positive)]
    lists += [several(n, x, _number) for n, x in (("amplitudes", amplitudes), ("phases", phases))]
    try:
        rows = np.broadcast_arrays(*map(np.array, lists))
    except ValueError:
        counts = [len(numbers) for numbers in lists]
        raise InputError(
            f"frequencies, amplitudes and phases must be one or as many as each other, got {counts}"
        ) from None
    time = _grid(duration, max(lists[0]))
    value = np.zeros(len(time))
    for frequency, amplitude, phase in zip(*(row.tolist() for row in rows)):
        omega = 2.0 * math.pi * frequency
        size = amplitude if of == "value" else -amplitude / omega**2
        value += size * sines_and_cosines(omega * time + phase)[0]
    return spline(time[1], value, f"sines of {shown(lists[0])} Hz")


def sweep(
    low: float,
    high: float,
    amplitude: float,
    duration: float,
    *,
    way: str = "linear",
    of: str = "value",
) -> Signal:
    """Sine whose frequency goes from ``low`` to ``high``, up or down.

    Parameters
    ----------
    low : float
        Frequency at the beginning [Hz].
    high : float
        Frequency at the end [Hz].
    amplitude : float
        Amplitude, in the unit of the value or of its acceleration, see ``of``.
    duration : float
        Duration [s].
    way : str, default "linear"
        ``"linear"``: equal Hz in every second; ``"logarithmic"``: equal octaves in every second.
    of : str, default "value"
        ``"value"`` or ``"acceleration"``: what keeps its amplitude, the latter nearly.
    """
    low, high, amplitude = (
        positive("low", low),
        positive("high", high),
        _number("amplitude", amplitude),
    )
    choice("way", way, WAYS)
    choice("of", of, OF)
    time = _grid(duration, max(low, high))
    end = float(time[-1])
    if way == "linear" or low == high:
        frequency = low + (high - low) / end * time
        turns = (low + 0.5 * (high - low) / end * time) * time
    else:
        octaves = math.log(high / low) / end
        frequency = low * np.exp(octaves * time)
        turns = (frequency - low) / octaves
    size = amplitude if of == "value" else -amplitude / (2.0 * np.pi * frequency) ** 2
    value = size * sines_and_cosines(2.0 * np.pi * turns)[0]
    return spline(time[1], value, f"{way} sweep from {low:g} to {high:g} Hz")


def random_vibration(
    frequencies: Any,
    density: Any,
    duration: float,
    *,
    seed: int = 1,
    of: str = "acceleration",
) -> Signal:
    """Stationary random vibration of a one-sided power spectral density.

    Parameters
    ----------
    frequencies : sequence of float
        Break points of the density [Hz], ascending.
    density : sequence of float
        One-sided power spectral density at the break points [unit^2/Hz], with the unit of the
        acceleration, m/s^2, or of the value; straight in log-log axes between them, zero outside.
    duration : float
        Duration [s].
    seed : int, default 1
        Seed of the phases.
    of : str, default "acceleration"
        ``"acceleration"`` or ``"value"``: what the density belongs to.

    Notes
    -----
    Lines of the spectrum are 1 / duration apart and have amplitudes sqrt(2 density / duration) and
    random phases: the mean square over the duration is that of the density.
    """
    choice("of", of, OF)
    points = np.array(several("frequencies", frequencies, positive))
    levels = np.array(several("density", density, positive))
    if len(points) != len(levels) or len(points) < 2 or (np.diff(points) <= 0.0).any():
        raise InputError(
            "frequencies must ascend and be as many as densities, at least 2, got "
            f"{len(points)} and {len(levels)}: {shown(points.tolist())}"
        )
    time = _grid(duration, float(points[-1]))
    end = float(time[-1])
    lines = np.arange(math.ceil(points[0] * end - 1e-9), math.floor(points[-1] * end + 1e-9) + 1)
    if not len(lines):
        got, least = told_apart(duration, 1.0 / (points[-1] - points[0]))
        raise InputError(
            f"duration must be at least {least} s, so that lines of the spectrum lie between "
            f"{points[0]:g} and {points[-1]:g} Hz, got {got}"
        )
    amplitude = np.sqrt(2.0 * _between(points, levels, lines / end) / end)
    if of == "acceleration":
        amplitude = -amplitude / (2.0 * np.pi * lines / end) ** 2
    generator = np.random.default_rng(whole("seed", seed, 0, 2**31 - 1))
    sine, cosine = sines_and_cosines(2.0 * np.pi * generator.random(len(lines)))
    count = len(time) - 1
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    # a sin(2 pi k t + p) is the real part of a (sin p - i cos p) exp(2 pi i k t).
    spectrum[lines] = 0.5 * count * amplitude * (sine - 1j * cosine)
    value = np.fft.irfft(spectrum, count)
    label = f"random vibration from {points[0]:g} to {points[-1]:g} Hz, seed {seed}"
    return spline(time[1], np.append(value, value[0]), label)


def _between(points, levels, frequency):
    """Density at frequencies, by straight lines in a doubly logarithmic diagram."""
    inside = np.clip(frequency, points[0], points[-1])
    return np.exp(np.interp(np.log(inside), np.log(points), np.log(levels)))


def _grid(duration, highest):
    """Times of the nodes [s]: an even number of equal steps."""
    duration, step = positive("duration", duration), 1.0 / (NODES_A_CYCLE * highest)
    if duration / step > MOST_NODES - 3:
        got, most = told_apart(duration, (MOST_NODES - 3) * step)
        raise InputError(f"duration must be at most {most} s in steps of {step:.3g} s, got {got}")
    count = max(4, 2 * math.ceil(0.5 * duration / step * (1.0 - 1e-12)))
    return duration / count * np.arange(count + 1)


def _number(name, value):
    return between(name, value, -LARGEST, LARGEST)
