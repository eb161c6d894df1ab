"""Shake a box of grains beside an empty one, and show which swings less.

A container hangs on a spring and is shaken; the particles in it fly, fall and hit its walls.
Beside it hangs an empty one. Both begin as the empty one swings for good, so that one sees what
the particles take. Try other numbers of particles, frequencies (1 is where the empty container
swings most) and amplitudes of the shaking base.

    python -m ca_damper demo                                   # ten seconds
    python -m ca_damper demo --particles 60 --frequency 0.95
    python -m ca_damper demo --filling spheres --amplitude 1.2

With --effects auto, which is the default, the program computes the effects that the scene calls
for (the spheres turn where friction makes them); "listed" takes the filling as it is.

Writes damper.gif, view.html (the same to play), motion.png, motion.csv, caption.txt and
summary.json to results/damper_demo/.
"""

from argparse import Namespace
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from ca_damper.automaton import Automaton
from ca_damper.batch import Batch
from ca_damper.certificate import EFFECTS
from ca_damper.demo_pictures import figures_of, sentences, write
from ca_damper.film import film
from ca_damper.fixed_mass import Empty
from ca_damper.oscillator import Oscillator
from ca_damper.progress import Stages
from ca_damper.scenes.table import SceneTable
from ca_damper.spheres import Spheres
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.entries import Entry
from taichi_dem.kit.study.summary_entries import add_to_summary
from taichi_dem.kit.terminal import show_paragraph

NAME = "damper_demo"
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
#: Cycles of the animation, the first ones, and frames in each; samples a cycle of the curves.
SHOWN, FRAMES, SAMPLES = 3, 13, 40
_ENTRY = Entry(
    name=NAME,
    part="",
    question="What does a handful of grains in a box do to its vibration?",
    look="",
    time="10 s",
    quick="10 s",
    pictures=("damper.gif", "view.html", "motion.png"),
    figures=("amplitude*", "damping*", "apparent*", "loss*"),
)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the program on a command line, that of the process by default; returns its exit code."""
    made = study.parser(NAME, __doc__, settings=SETTINGS)
    made.prog, made.entry = "python -m ca_damper demo", _ENTRY
    return study.main(lambda options: swing(options, NAME), made, arguments)


class Swing:
    """A container that swings: columns over time, measured Cycles, frames of the first cycles."""

    def __init__(self, title: str, batch: Batch, begin: int, measured: int, o: Oscillator):
        batch.start("empty")
        steps, ends = int(batch.steps_per_cycle[0]), np.array([SHOWN, begin, begin + measured])
        with ProgressBar(f"{title} container") as progress:
            tell = Stages(progress, ends / ends[-1])
            every: dict[str, Any] = {"sample_every": steps // SAMPLES, "progress": tell}
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


def swing(options: Namespace, name: str) -> None:
    """Let the full and the empty container swing, compare, picture.

    Parameters
    ----------
    options
        Those of ``SETTINGS``, and out, the folder of the output.
    name
        Of the study, in summary.json.
    """
    filling, o = FILLINGS[options.filling](), Oscillator(base_amplitude=1e-3 * options.amplitude)
    frequency, measured = options.frequency * o.natural_frequency, options.measured
    own = o.base_amplitude, o.mass, o.stiffness, o.damping
    shaken = options.dt or filling.default_dt, frequency, *own
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
    for sentence in words:
        show_paragraph(sentence)
    print(f"\n{report}\n")
    study.finish(options, name, figures, batches.values())
    if report.certificate is not None:
        add_to_summary(options.out, certificate=report.certificate.as_dict())
