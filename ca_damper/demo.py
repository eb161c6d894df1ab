"""Release a box of grains beside a rigid mass of the same weight, and count the cycles.

A container on a spring is released 30 mm above its rest, beside one whose particles are fixed.
Nothing shakes them, so a faster decay is damping. The particles damp while the container's peak
acceleration is above about 1 g; below it they lie on the floor.

    python -m ca_damper demo
    python -m ca_damper demo --particles 50 --amplitude 40
    python -m ca_damper demo --filling spheres  # in place of the automaton
    python -m ca_damper demo --compare          # figures of both
    python -m ca_damper demo --all-pictures     # also a page that plays the film

Figures are medians over nine starts; an amplitude is sqrt(2) times the RMS of an empty cycle.

Writes damper.gif, decay.png, decay.csv, report.json and summary.json to results/damper_demo/;
with --all-pictures also view.html, which plays the film; with --no-pictures no picture or film.
"""

import textwrap
from argparse import Namespace
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ca_damper.automaton import Automaton
from ca_damper.batch import Batch
from ca_damper.demo_pictures import (
    LEVEL,
    Decay,
    draw_films,
    figures_of,
    plot_decay,
    sentences,
    write_decays,
)
from ca_damper.fixed_mass import RigidMass
from ca_damper.oscillator import Oscillator
from ca_damper.report.certificate import EFFECTS
from ca_damper.report.progress import Stages
from ca_damper.runs.film import Film, film
from ca_damper.scenes.table import SceneTable
from ca_damper.spheres import Spheres
from taichi_dem.kit import study
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.study.entries import Entry

NAME = "damper_demo"
FILLINGS = {"automaton": Automaton, "spheres": Spheres}
#: Numbers of particles of which the figures tell, and most starts of each.
COUNTS, STARTS = (10, 30, 50), 9
SETTINGS = {
    "particles": (30, 30, study.whole(0, 160), "number of particles, from 0 to 160, default 30"),
    "amplitude": (30.0, 30.0, study.number(2.0 * LEVEL, 100), "displacement [mm], default 30"),
    "filling": ("automaton", "automaton", study.one_of(FILLINGS), "default automaton"),
    "effects": ("listed", "listed", study.one_of(EFFECTS), "effects: listed (default) or auto"),
    "dt": (None, None, study.number(0, 1), "step [s], default 1e-4, of spheres 2e-5"),
    "seed": (1, 1, study.whole(0, 2**31 - STARTS), "seed of the first start, default 1"),
    "starts": (STARTS, 5),
    # Those of the animation.
    "shown": (5, 2),
}
#: Cycles of a decay, as many as decay.png shows; samples in each, frames in one of the animation.
CYCLES, SAMPLES, FRAMES = 26, 40, 8
_ENTRY = Entry(
    name=NAME,
    part="",
    question="What does a handful of grains in a box do to its vibration?",
    look="",
    time="10",
    quick="10",
    pictures=("damper.gif", "decay.png", "view.html"),
    figures=("cycles_*", "decrement_*"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program on a command line, that of the process by default; returns its exit code."""
    parser = study.parser(NAME, __doc__, settings=SETTINGS)
    parser.prog, parser.entry = "python -m ca_damper demo", _ENTRY
    add_options(parser)
    return study.main(lambda options: let_go(options, NAME), parser, arguments)


def add_options(made: study.Parser) -> None:
    """Add the options of this job that are no settings to its parser."""
    made.add_argument("--compare", action="store_true", help="print figures of both fillings")
    study.add_pictures(made)


def let_go(options: Namespace, name: str) -> None:
    """Let containers go with free and with fixed particles, compare, picture."""
    wanted = FILLINGS if options.compare else (options.filling,)
    fillings = {word: FILLINGS[word]() for word in wanted}
    shown, rigid = fillings[options.filling], RigidMass()
    counts, starts = sorted({*COUNTS, options.particles}), options.seed + np.arange(options.starts)
    scenes = np.repeat(counts, options.starts), np.tile(starts, len(counts))
    jobs = [(rigid, counts, options.seed), *((filling, *scenes) for filling in fillings.values())]
    batches = {job[0].label: _batch(*job, options) for job in jobs}
    at = study.output_paths(options.out)
    titles = "fixed particles", *fillings
    decays = {
        label: _decay(counts, batch, title)
        for title, (label, batch) in zip(titles, batches.items())
    }
    reports = {label: batch.report() for label, batch in batches.items()}
    # Their engines are idle again.
    batches.clear()
    write_decays(at("decay.csv"), decays)
    words, report = sentences(decays, shown, options), reports[shown.label]
    report.write(at("report.json"))
    for sentence in words:
        print(textwrap.fill(sentence, 100))
    study.show_report(options, report)
    draw = partial(picture, decays, (rigid, shown), options)
    study.finish(options, name, figures_of(decays, options), reports.values(), draw=draw)
    study.add_to_summary(options.out, certificate=report.certificate.as_dict())


def picture(decays: Mapping[str, Decay], fillings: Sequence[Any], options: Namespace) -> None:
    """Draw decays, and film fixed and free particles, as ``study.add_pictures`` has it asked."""
    if options.pictures == "no":
        return
    at = study.output_paths(options.out)
    plot_decay(at("decay.png"), decays, options.particles, options.amplitude)
    fixed, free = (_filmed(filling, options) for filling in fillings)
    page = at("view.html") if options.pictures == "all" else None
    draw_films(at("damper.gif"), page, (fixed, free), options)


def _batch(filling: Any, particles: Any, seeds: Any, options: Namespace) -> Batch:
    """Containers on a base at rest, let go from the amplitude asked for."""
    # Equal room for results, so that the film runs in the engines of the other batches.
    chosen = isinstance(filling, FILLINGS[options.filling])
    dt = options.dt if chosen and options.dt else filling.default_dt
    table = SceneTable(particles, seeds, dt, Oscillator().natural_frequency, 0.0)
    room: dict[str, Any] = {"measured_cycles": CYCLES, "recorded_samples": 2 * SAMPLES * CYCLES}
    batch = Batch(filling, table, effects=options.effects, **room)
    batch.start(displacement=1e-3 * options.amplitude)
    return batch


def _decay(counts: Sequence[int], batch: Batch, title: str) -> Decay:
    every = max(1, int(batch.steps_per_cycle[0]) // SAMPLES)
    with ProgressBar(title) as progress:
        cycles = batch.run(0, CYCLES, Stages(progress, [1.0]), record_every=every)
    return Decay(counts, np.sqrt(2.0) * cycles.rms_by_cycle, batch.time_series()["x"].T)


def _filmed(filling: object, options: Namespace) -> Film:
    batch = _batch(filling, options.particles, options.seed, options)
    steps = int(batch.steps_per_cycle[0])
    samples, frames = (max(1, steps // number) for number in (SAMPLES, FRAMES))
    return film(batch, options.shown * steps, sample_every=samples, frame_every=frames)
