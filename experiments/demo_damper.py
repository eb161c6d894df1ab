"""What does a handful of particles in a box do to its vibration?

A container hangs on a spring and is shaken; the particles in it fly, fall and hit its walls.
Beside it hangs an empty one. Both begin as the empty one swings for good, so that one sees what
the particles take. Try other numbers of particles, frequencies (1 is where the empty container
swings most) and amplitudes of the shaking base.

    python experiments/demo_damper.py                                  # ten seconds
    python experiments/demo_damper.py --particles 60 --frequency 0.95
    python experiments/demo_damper.py --filling spheres --amplitude 1.2

Writes damper.gif, motion.png, motion.csv, caption.txt and summary.json to results/demo_damper/.
"""

import os
import sys

import numpy as np

import _demo_damper as shown
from ca_damper import Automaton, Batch, Empty, Oscillator, SceneTable, Spheres, film
from ca_damper.progress import Stages
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, number, parser, whole

NAME = "demo_damper"
QUICK, FULL = {"begin": 10, "measured": 5}, {"begin": 40, "measured": 20}
FILLINGS = {"automaton": Automaton, "spheres": Spheres}
#: Cycles of the animation, the first ones, and frames in each; samples a cycle of the curves.
SHOWN, FRAMES, SAMPLES = 3, 13, 40


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--particles", type=whole(0, 160), default=30, help="0 to 160, 30")
    made.add_argument("--frequency", type=number(0.2, 3), default=1.0, help="by the container's, 1")
    made.add_argument("--amplitude", type=number(0, 10), default=0.6, help="of the base [mm], 0.6")
    made.add_argument("--filling", choices=FILLINGS, default="automaton", help="automaton")
    made.add_argument("--dt", type=number(0, 1), help="step [s], 1e-4 or 2e-5 of spheres")
    made.add_argument("--seed", type=whole(0, 2**31 - 1), default=1, help="of the first places, 1")
    return made


def run(options):
    """Let the full and the empty container swing, compare, picture."""
    settings = QUICK if options.quick else FULL
    filling, o = FILLINGS[options.filling](), Oscillator(base_amplitude=1e-3 * options.amplitude)
    shaken = options.dt or filling.default_dt, options.frequency * o.natural_frequency
    shaken += o.base_amplitude, o.mass, o.stiffness, o.damping
    batches = {}
    for title, one, particles in (("full", filling, options.particles), ("empty", Empty(), 0)):
        table = SceneTable(particles, options.seed, *shaken)
        batches[title] = Batch(one, table, measured_cycles=settings["measured"])
    out = output_folder(options.out)
    runs = {title: swing(title, batch, **settings) for title, batch in batches.items()}
    figures = figures_of(runs["full"][1], runs["empty"][1], o)
    shown.write(out, runs, o, filling, options)
    words, report = shown.sentences(figures, filling, o, options), batches["full"].report()
    report.write(os.path.join(out, "report.json"))
    write_text(os.path.join(out, "caption.txt"), " ".join(words) + "\n")
    print(*words, f"\n{report}", sep="\n")
    finish(options, NAME, figures, batches.values(), show=False)


def swing(title, batch, begin, measured):
    """Let a container swing; returns its history, the measured Cycles, frames of the first."""
    batch.start("empty")
    steps, ends = int(batch.steps_per_cycle[0]), np.array([SHOWN, begin, begin + measured])
    with ProgressBar(f"{title} container") as progress:
        tell = Stages(progress, ends / ends[-1])
        every = {"sample_every": steps // SAMPLES, "progress": tell}
        early = film(batch, SHOWN * steps, frame_every=steps // FRAMES, **every)
        late = film(batch, (begin - SHOWN) * steps, **every)
        cycles = batch.run(0, measured, tell)
    history = {k: np.concatenate([v, late.history[k]])[:, 0] for k, v in early.history.items()}
    return history, cycles, early.frames[0][: SHOWN * FRAMES]


def figures_of(cycles, empty, o):
    """Amplitude of the container with particles and without; their power and apparent mass."""
    figures = {
        "amplitude_mm": (1e3 * cycles.amplitude, "mm"),
        "amplitude_empty_mm": (1e3 * empty.amplitude, "mm"),
        "amplitude_left": (cycles.amplitude / empty.amplitude, "1"),
        "rms_mm": (1e3 * cycles.rms, "mm"),
        "power_mW": (1e3 * cycles.complex_power.real, "mW"),
        "apparent_damping_N_s_m": (cycles.apparent_damping, "N s/m"),
        "apparent_mass_g": (1e3 * cycles.apparent_mass, "g"),
        "damping_ratio": (cycles.damping_ratio(o.mass, o.stiffness, o.damping), "1"),
        "damping_ratio_empty": ([o.damping_ratio], "1"),
        "loss_factor": (cycles.loss_factor(o.mass), "1"),
    }
    return {name: figure(float(value[0]), unit) for name, (value, unit) in figures.items()}


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
