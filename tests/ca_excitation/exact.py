"""Exact motion of a linear oscillator from rest under sines of its base and of a force."""

import numpy as np


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
