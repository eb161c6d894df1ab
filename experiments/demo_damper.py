"""What does a handful of particles in a box do to its vibration?

A container hangs on a spring and is shaken; the particles in it fly, fall and hit its walls.
Beside it hangs an empty one. Both begin as the empty one swings for good, so that one sees what
the particles take. Try other numbers of particles, frequencies (1 is where the empty container
swings most) and amplitudes of the shaking base.

    python experiments/demo_damper.py                                  # ten seconds
    python experiments/demo_damper.py --particles 60 --frequency 0.95
    python experiments/demo_damper.py --filling spheres --amplitude 1.2

With --effects auto, which is the default, the program computes the effects that the scene calls
for (the spheres turn where friction makes them); "listed" takes the filling as it is.

Writes damper.gif, view.html (the same to play), motion.png, motion.csv, caption.txt and
summary.json to results/demo_damper/.
"""

import sys
from functools import partial

import numpy as np

from _demo_damper import figures_of, sentences, write
from ca_damper import Automaton, Batch, Empty, Oscillator, SceneTable, Spheres, film
from ca_damper.certificate import EFFECTS
from ca_damper.progress import Stages
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.summary_entries import add_to_summary

NAME = "demo_damper"
FILLINGS = {"automaton": Automaton, "spheres": Spheres}
SETTINGS = {
    "particles": (30, 30, study.whole(0, 160), "0 to 160, 30"),
    "frequency": (1.0, 1.0, study.number(0.2, 3), "by the container's, 1"),
    "amplitude": (0.6, 0.6, study.number(0, 10), "of the base [mm], 0.6"),
    "filling": ("automaton", "automaton", study.one_of(FILLINGS), "automaton"),
    "effects": ("auto", "auto", study.one_of(EFFECTS), "auto; or listed"),
    "dt": (None, None, study.number(0, 1), "step [s], 1e-4 or 2e-5 of spheres"),
    "seed": (1, 1, study.whole(0, 2**31 - 1), "of the first places, 1"),
    "begin": (40, 10),
    "measured": (20, 5),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Cycles of the animation, the first ones, and frames in each; samples a cycle of the curves.
SHOWN, FRAMES, SAMPLES = 3, 13, 40


class Swing:
    """A container that swings: columns over time, measured Cycles, frames of the first cycles."""

    def __init__(self, title, batch, begin, measured, o):
        batch.start("empty")
        steps, ends = int(batch.steps_per_cycle[0]), np.array([SHOWN, begin, begin + measured])
        with ProgressBar(f"{title} container") as progress:
            tell = Stages(progress, ends / ends[-1])
            every = {"sample_every": steps // SAMPLES, "progress": tell}
            early = film(batch, SHOWN * steps, frame_every=steps // FRAMES, **every)
            late = film(batch, (begin - SHOWN) * steps, **every)
            self.cycles = batch.run(0, measured, tell)
        self.frames = early.frames[0][: SHOWN * FRAMES]
        history = {k: np.concatenate([v, late.history[k]])[:, 0] for k, v in early.history.items()}
        self.columns = {
            "time_s": history["time_s"],
            "x_mm": 1e3 * history["x"],
            "energy_mJ": 1e3 * o.energy(history["x"], history["v"], history["y"]),
            "particles_mJ": 1e3 * history["energy"],
        }


def run(options):
    """Let the full and the empty container swing, compare, picture."""
    filling, o = FILLINGS[options.filling](), Oscillator(base_amplitude=1e-3 * options.amplitude)
    frequency, measured = options.frequency * o.natural_frequency, options.measured
    shaken = options.dt or filling.default_dt, frequency
    shaken += o.base_amplitude, o.mass, o.stiffness, o.damping
    batches = {}
    for title, one, particles in (("full", filling, options.particles), ("empty", Empty(), 0)):
        table = SceneTable(particles, options.seed, *shaken)
        batches[title] = Batch(one, table, measured_cycles=measured, effects=options.effects)
    at = study.output_paths(options.out)
    full, empty = (Swing(*pair, options.begin, measured, o) for pair in batches.items())
    figures = figures_of(full.cycles, empty.cycles, o)
    write(at, full, empty, filling, options, 2.0 * np.pi * frequency)
    words, report = sentences(figures, filling, o, options), batches["full"].report()
    report.write(at("report.json"))
    write_text(at("caption.txt"), " ".join(words) + "\n")
    print(*words, f"\n{report}", sep="\n")
    study.finish(options, NAME, figures, batches.values(), see="view.html", show=False)
    add_to_summary(options.out, certificate=report.certificate.as_dict())


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
