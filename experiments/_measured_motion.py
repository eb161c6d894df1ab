"""The synthetic record of ``damper_measured_motion.py`` by its formula, and the pictures.

python experiments/_measured_motion.py      # writes experiments/base_motion.csv again
"""

import math
import sys
from pathlib import Path

import numpy as np

from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLACK, STYLES, picture, styles_of

RECORD = Path(__file__).resolve().parent / "base_motion.csv"
#: Filter of the ground: frequency [Hz] and damping ratio (Kanai and Tajimi).
GROUND, GROUND_DAMPING = 6.0, 0.4
#: The envelope rises to 1, stays, and decays (Jennings); times [s], rate [1/s]; length [s].
RISE, STRONG, DECAY, LENGTH = 2.0, 8.0, 0.7, 14.0
#: Largest acceleration [m/s^2], time between samples [s], lines of the spectrum [Hz].
LARGEST, STEP, LINES = 4.0, 0.01, np.arange(3.0, 18.0, 0.125)
HEADER = """\
# Synthetic record of a strong earthquake at a small scale, computed, not measured:
# a(t) = e(t) sum over k of A_k sin(2 pi f_k t + p_k), scaled to a largest value of 4 m/s^2.
# f_k = 3, 3.125, ... 17.875 Hz; p_k = 2 pi frac(0.6180339887 k^2), k = 1, 2, ...
# A_k^2 = (1 + (2 z r)^2) / ((1 - r^2)^2 + (2 z r)^2), r = f_k / 6 Hz, z = 0.4 (Kanai and Tajimi).
# e(t) = (t / 2 s)^2 up to 2 s, 1 up to 8 s, then exp(-0.7 (t - 8 s)) (Jennings, Housner and Tsai).
"""


def record():
    """Times [s] and accelerations [m/s^2] of the synthetic record."""
    time = np.arange(round(LENGTH / STEP) + 1) * STEP
    ratio, number = LINES / GROUND, np.arange(1, len(LINES) + 1)
    damped = (2.0 * GROUND_DAMPING * ratio) ** 2
    size = np.sqrt((1.0 + damped) / ((1.0 - ratio**2) ** 2 + damped))
    phase = 2.0 * math.pi * ((0.6180339887 * number**2) % 1.0)
    waves = np.sin(2.0 * math.pi * time[:, None] * LINES + phase) @ size
    late = np.exp(-DECAY * np.maximum(time - STRONG, 0.0))
    pull = np.minimum(time / RISE, 1.0) ** 2 * late * waves
    return time, LARGEST * pull / np.abs(pull).max()


def write_record():
    """Write the record as the file that the experiment reads."""
    rows = [f"{t:.2f},{a:.5f}" for t, a in zip(*record())]
    write_text(RECORD, HEADER + "time_s,acceleration_m_s2\n" + "\n".join(rows) + "\n")


def picture_motion(path, made, shown):
    """Acceleration of the base, and motion of the container with and without grains."""
    empty, filled = made["empty"], {k: v for k, v in made.items() if k != "empty"}
    with picture(path, 3, 1, size=(8.6, 7.2), sharex=True) as (_, axes):
        base, time = empty.excitation.base, empty.time_s
        axes[0].plot(time, base.at(np.minimum(time, base.duration))[2], color=BLACK, lw=0.8)
        axes[0].set(ylabel="acceleration\nof the base [m/s²]")
        bare = {"color": STYLES["empty"].colour, "lw": 0.9, "label": STYLES["empty"].label}
        for axis, (label, history) in zip(axes[1:], filled.items()):
            style, k = styles_of(filled)[label], history.particles.index(shown)
            axis.plot(time, 1e3 * empty.relative[:, 0, 0], **bare)
            own = {"color": style.colour, "lw": 0.9, "label": f"{style.label}, {shown} particles"}
            axis.plot(time, 1e3 * history.relative[:, k, 0], **own)
            axis.set(ylabel="displacement from\nthe base [mm]")
            axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        axes[-1].set(xlabel="time [s]", xlim=(0.0, time[-1]))


def picture_damping(path, made):
    """RMS, peak and damping ratio over the number of particles; bars: range over the seeds."""
    empty, filled = made["empty"], {k: v for k, v in made.items() if k != "empty"}
    drawn = (
        ("RMS displacement from the base [mm]", lambda one: 1e3 * one.relative_rms),
        ("largest displacement from the base [mm]", lambda one: 1e3 * one.relative_peak),
        ("damping ratio [%]", lambda one: 1e2 * one.damping_ratio),
    )
    with picture(path, 1, 3, size=(9.2, 3.6)) as (figure, axes):
        for axis, (words, measure) in zip(axes, drawn):
            level = measure(empty)[0, 0]
            axis.axhline(level, color=STYLES["empty"].colour, ls=":", label=STYLES["empty"].label)
            for label, history in filled.items():
                style, values = styles_of(filled)[label], measure(history)
                middle = values.mean(axis=1)
                bars = [middle - values.min(axis=1), values.max(axis=1) - middle]
                look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.2}
                axis.errorbar(history.particles, middle, yerr=bars, label=style.label, **look)
            axis.set(xlabel="particles [1]", ylabel=words, ylim=(0.0, None))
        keys = axes[0].get_legend_handles_labels()
        figure.legend(*keys, loc="outside upper left", ncols=3)


if __name__ == "__main__":
    sys.exit(write_record())
