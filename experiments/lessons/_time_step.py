"""Cost of a time step: a bar is struck with any step by any method, and compared with the truth.

The bar has 12 cells of six tetrahedra. All runs on the engine's thread.
"""

import math
import time
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from _engine import engine
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    quality_report,
)
from taichi_dem.engine.model import Model
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.mesh.shapes import bar

LENGTH, WIDTH, CELLS = 0.4, 0.05, (12, 1, 1)
#: Steps to choose from [s], and that of the truth.
STEPS = tuple(4e-8 * 2**k for k in range(7))
FINEST = 2e-8
#: Samples after the first; each is a whole number of the longest steps after the one before.
SAMPLES = 40
UNTIL = SAMPLES * 3 * STEPS[-1]
#: Times to the peak of the blow [s], and the peak [Pa].
RISES = (1e-5, 2e-5, 5e-5)
PEAK = 1e6
#: Sample at which the bar is drawn: the wave is on its way.
SHOWN = 18
#: Method by name, as a user writes it; in words.
METHODS = {
    "explicit": Uniform(STEPS[0]),
    "limited": Uniform(STEPS[0], dashpot="limited"),
    "solved": ImplicitDashpots(STEPS[0], tolerance=1e-3),
}
WORDS = {name: style.label for name, style in styles_of(METHODS).items()}

#: Questions of the notebook, and what unfolds below them.
QUESTIONS = {
    "Explicit: go from 80 to 160 ns. Does the error grow, or does something else happen?": (
        "The run diverges. At 80 ns it was wrong by 0.01 %: what bounds the step is "
        "**stability**, not accuracy. You pay for small steps only because a larger one is "
        "impossible."
    ),
    "How does each curve fall when the step is halved?": (
        "Explicit: the error halves, **first order**. A dashpot takes the velocity of half a "
        "step ago. Solved together: the error falls to about a quarter, **second order**. The "
        "dashpots act in the middle of the step."
    ),
    "Limited dashpots do not diverge up to 1280 ns. Why not take them?": (
        "A dashpot that the step does not bear is weakened until the step bears it. That is "
        "another material: wrong by 4 % at 80 ns, by about half at 320. **Stable is not "
        "right.** At 40 ns nothing is weakened, and both explicit runs agree."
    ),
    "You want 1 %. Which method, and which step?": (
        "Dashpots solved together, with the longest step. One of its steps costs several "
        "explicit ones, but it is 32 times as long as the longest explicit one here. Beyond "
        "it the springs end the run: they are explicit in every method."
    ),
    "Make the blow gentler, from 10 to 50 µs. Which error falls?": (
        "At 80 ns that of the solved dashpots, to a twentieth: what changes slowly needs few "
        "steps. The explicit error hardly changes. Its dashpots lag by half a step, whatever "
        "the blow."
    ),
}


@dataclass(frozen=True, eq=False)
class Strike:
    """A run of the bar.

    step [s]; moved: mean displacement of the far end [m], (SAMPLES + 1,), NaN after a divergence;
    sentence: of the program where it ended the run, "" where it did not; motion: of all
    bodies at sample SHOWN, None where the run ended before. seconds: of one core for the run
    without looks on the way, NaN where that was not measured.
    """

    step: float
    moved: np.ndarray
    sentence: str
    motion: Optional[dict]
    seconds: float = math.nan

    def error(self, truth):
        """Largest distance from the truth, over the largest displacement there; NaN if diverged."""
        return float(np.abs(self.moved - truth.moved).max() / np.abs(truth.moved).max())


@dataclass(frozen=True, eq=False)
class Answer:
    """Runs for one choice.

    method, rise [s]: the choice. chosen: its Strike. truth: that of the finest step. ladders: the
    Strikes at all STEPS by method, of those asked for so far with this blow. model: of the bar.
    """

    method: str
    rise: float
    chosen: Strike
    truth: Strike
    ladders: dict
    model: object

    @property
    def time(self):
        """Of the samples [s]."""
        return np.linspace(0.0, UNTIL, SAMPLES + 1)


def scene(rise=RISES[0]):
    """The bar under a short blow on its left end, with a rise [s]."""
    blow = effects.GasPressure("left", peak=PEAK, rise=rise, decay_ratio=1.0)
    return Scene(bar(LENGTH, WIDTH, CELLS), CONCRETE, [blow, effects.BondDamping()])


def limits():
    """Longest stable explicit step of the worst body [s]: by its dashpots, and by its springs."""
    report = quality_report(scene().mesh, CONCRETE)
    return float(report.dashpot_step_s.min()), float(report.spring_step_s.min())


def ready(method, step, rise):
    """The bar at rest, with a step and a rise of the blow [s]; a method is compiled once."""
    chosen = METHODS[method]
    name = "dt" if hasattr(chosen, "dt") else "dt0"
    made = Simulation(scene(rise), replace(chosen, **{name: step}))
    made.start()
    return made


def strike(method, step, rise):
    """Run the bar with a step and a rise of the blow [s], and look on; returns a Strike."""
    made = ready(method, step, rise)
    every = round(UNTIL / SAMPLES / step)
    moved, motion, sentence = np.full(SAMPLES + 1, np.nan), None, ""
    end = made.model.centre[:, 0] > LENGTH * (1.0 - 1.0 / CELLS[0])
    try:
        for k in range(SAMPLES + 1):
            made.advance_to(every * k)
            found = made.state.motion()
            moved[k] = (found["position"] - made.model.centre)[end, 0].mean()
            motion = found if k == SHOWN else motion
    except SimulationDiverged as diverged:
        moved[k:], sentence = np.nan, str(diverged)
    return Strike(step, moved, sentence, motion)


@engine.remember
def timed(method, step, rise):
    """The same with its cost, from a second run without looks on the way."""
    found = strike(method, step, rise)
    if found.sentence:
        return found
    made = ready(method, step, rise)
    started = time.thread_time()
    made.advance_to(round(UNTIL / step))
    return replace(found, seconds=time.thread_time() - started)


@engine.remember
def truth(rise):
    """The Strike that all others are compared with."""
    return strike("solved", FINEST, rise)


@engine.remember
def model():
    """Constants of the bar."""
    return Model(scene().mesh, CONCRETE, [])


@engine.remember
def tried(rise):
    """Methods that have been asked for with a blow: a dict of the Strikes at all STEPS, to fill."""
    return {}


def answer(method, step, rise):
    """The Answer to a choice: method by name, step out of STEPS and rise out of RISES [s]."""
    own = tried(rise)[method] = [timed(method, one, rise) for one in STEPS]
    ladders = {name: tried(rise)[name] for name in METHODS if name in tried(rise)}
    chosen = own[STEPS.index(step)]
    return Answer(method, rise, chosen, truth(rise), ladders, model())


def nearest(values, value):
    """The one of some values that lies nearest to a value, as sliders round."""
    return min(values, key=lambda one: abs(one - value))


def compile_all():
    """Compile the bar of every method, so that no later answer has to wait for it."""
    for method in METHODS:
        ready(method, STEPS[0], RISES[0])
