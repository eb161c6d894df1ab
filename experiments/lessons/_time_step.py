"""Cost of a time step: a bar is struck with any step by any method, and compared with the truth.

The bar has 12 cells of six tetrahedra. All runs on the thread of the session.
"""

import itertools
import math
import textwrap
from functools import partial
from typing import NamedTuple

import numpy as np

import taichi_dem as dem
from _page import percent
from taichi_dem.kit.plot_style import BLACK, GREY, RED, seconds, styles_of
from taichi_dem.kit.session_thread import session
from taichi_dem.mesh.shapes import bar
from taichi_dem.observers import macro_steps
from taichi_dem.plot.view import draw_bodies
from taichi_dem.simulate import result_of, run_simulation

LENGTH, WIDTH, CELLS = 0.4, 0.05, (12, 1, 1)
#: Steps to choose from [s], and that of the truth.
STEPS, FINEST = tuple(4e-8 * 2**k for k in range(7)), 2e-8
#: Samples after the first, three of the longest steps apart; the one that is drawn.
SAMPLES, SHOWN = 40, 18
UNTIL = SAMPLES * 3 * STEPS[-1]
TIME_MS = 1e3 * np.linspace(0.0, UNTIL, SAMPLES + 1)
#: Times to the peak of the blow [s], and the peak [Pa].
RISES, PEAK = (1e-5, 2e-5, 5e-5), 1e6
PAGE, WAIT = "what_a_time_step_costs", "Striking."
ALT = "Bar, far end, error over cost"
SIZE, TALL = (8.8, 5.4), (4.4, 9.4)
METHODS = {
    "explicit": dem.Uniform,
    "limited": partial(dem.Uniform, dashpot="limited"),
    "solved": partial(dem.ImplicitDashpots, tolerance=1e-3),
}
STYLES = styles_of(METHODS)
LABELS = {style.label: name for name, style in STYLES.items()}
#: Steps in ns, rises in us.
CONTROLS = {
    "method": (LABELS, next(iter(LABELS)), "method"),
    "step": ([round(1e9 * one) for one in STEPS], 80, "step [ns]"),
    "rise": ([round(1e6 * one) for one in RISES], 20, "the blow rises in [µs]"),
}
#: Of the displacement of the drawn bar.
MAGNIFY = 1500.0


class Strike:
    """A run of the bar with a step [s].

    moved: mean displacement of the far end [m], (SAMPLES + 1,), NaN after a divergence. motion:
    frame that is drawn, None where the run ended before. sentence: of the program where it ended
    the run, or "". seconds: of one core for the run without frames on the way, NaN where that was
    not measured.
    """

    def __init__(self, step, result):
        self.step, self.result, self.seconds = step, result, math.nan
        self.sentence = result.diverged
        end, frames = result.model.centre[:, 0] > LENGTH * (1.0 - 1.0 / CELLS[0]), result.frames
        self.moved = np.full(SAMPLES + 1, np.nan)
        self.moved[: len(frames)] = [frame.displacement[end, 0].mean() for frame in frames]
        self.motion = frames[SHOWN] if len(frames) > SHOWN else None

    def error(self, truth):
        """Largest distance from the truth, over the largest displacement there; NaN if diverged."""
        return float(np.abs(self.moved - truth.moved).max() / np.abs(truth.moved).max())


class Answer(NamedTuple):
    """Strikes for one choice; ladders: those at all STEPS, by the methods tried so far."""

    method: str
    chosen: Strike
    truth: Strike
    ladders: dict


def scene(rise=RISES[0]):
    """The bar under a short blow on its left end, with a rise [s]."""
    blow = dem.effects.GasPressure("left", peak=PEAK, rise=rise, decay_ratio=1.0)
    return dem.Scene(bar(LENGTH, WIDTH, CELLS), dem.CONCRETE, [blow, dem.effects.BondDamping()])


def facts():
    """Longest stable explicit step of the worst body, in words."""
    own = dem.step_report(scene()).limits
    names = {"dashpots": "bond_dashpot", "springs": "bond_stiffness"}
    return {words: seconds(float(own[name].min())) for words, name in names.items()}


#: One scene a rise, so that another step finds the limits of its bodies there.
kept_scene = session.remember(scene)


@session.remember
def simulation(method):
    """The bar with a method; compiles it."""
    made = dem.Simulation(kept_scene(RISES[0]), METHODS[method](STEPS[0]))
    made.start()
    return made


def ready(method, step, rise):
    """The bar at rest, with a step and a rise of the blow [s]; a method is compiled once."""
    made = simulation(method)
    made.reset(kept_scene(rise), METHODS[method](step))
    return made


def strike(method, step, rise):
    """Run the bar with a step and a rise of the blow [s]."""
    looks = {"until": UNTIL, "samples": 1, "frames": SAMPLES, "progress": None, "brief": True}
    return Strike(step, result_of(run_simulation, ready(method, step, rise), **looks))


@session.remember
def timed(method, step, rise):
    """The same with its cost, which a gentler blow does not change."""
    found = strike(method, step, rise)
    if not found.sentence:
        found.seconds = session.kept(("cost", method, step), partial(cost, method, step, rise))
    return found


def cost(method, step, rise):
    """CPU seconds of a run without frames on the way."""
    bare = ready(method, step, rise)
    bare.advance_to(macro_steps(UNTIL, step))
    return bare.run_cpu_seconds


@session.remember
def truth(rise):
    """The Strike that all others are compared with."""
    return strike("solved", FINEST, rise)


def answer(method, step, rise):
    """The Answer to a choice: method by name, step [ns] and rise [us] nearest to these."""
    step, rise = nearest(STEPS, 1e-9 * step), nearest(RISES, 1e-6 * rise)
    tried = session.kept("methods tried", set)
    tried.add(method)
    ladders = {name: [timed(name, one, rise) for one in STEPS] for name in METHODS if name in tried}
    return Answer(method, ladders[method][STEPS.index(step)], truth(rise), ladders)


def nearest(values, value):
    """The one of some values that lies nearest to a value, as sliders round."""
    return min(values, key=lambda one: abs(one - value))


def words(answer):
    """Error and cost of the chosen run, or what the program said, in a sentence."""
    strike = answer.chosen
    if strike.sentence:
        return f"The program says: *{strike.sentence}.*"
    return (
        f"With {seconds(strike.step)} a step the far end is wrong by "
        f"**{percent(strike.error(answer.truth))}** at most, for **{seconds(strike.seconds)}** of "
        "one core."
    )


def preparation():
    """Strikes of the bar by every method with all blows: later answers look them up."""
    every = itertools.product(METHODS, STEPS, RISES)
    return [partial(truth, rise) for rise in RISES] + [partial(timed, *one) for one in every]


def draw(figure, answer, tall):
    """The bar on its way, its far end over time, and error over cost of every step."""
    places, heights = [["bar", "bar"], ["end", "price"]], (0.5, 1.0)
    if tall:
        places, heights = [["bar"], ["end"], ["price"]], (0.4, 1.0, 1.2)
    panels = figure.subplot_mosaic(places, height_ratios=heights)
    _struck(figure, panels["bar"], answer, tall)
    _far_end(panels["end"], answer)
    _price(panels["price"], answer)


def _struck(figure, axes, answer, tall):
    """The bar coloured by velocity when the wave is on its way, or the sentence of its end."""
    chosen, model = answer.chosen, answer.truth.result.model
    frame, high = chosen.motion or answer.truth.motion, model.mesh.points.max(axis=0)
    top = 1e3 * float(np.abs(answer.truth.motion.velocity[:, 0]).max())
    look = {"magnify": MAGNIFY, "clim": (-top, top), "cmap": "RdBu_r"}
    drawn = draw_bodies(axes, model, frame, 1e3 * frame.velocity[:, 0], **look)
    axes.set(xlim=(-0.02, high[0] + 0.03), ylim=(-0.02, high[1] + 0.02), xlabel="x [m]", yticks=[])
    axes.set_title(f"t = {TIME_MS[SHOWN]:.2f} ms, displacement × {MAGNIFY:g}")
    axes.spines["left"].set_visible(False)
    beside = {"label": "velocity\n[mm/s]", "aspect": 8, "pad": 0.01}
    below = {"label": "velocity [mm/s]", "aspect": 30, "location": "bottom"}
    figure.colorbar(drawn, ax=axes, **(below if tall else beside))
    if not chosen.motion:
        drawn.set_alpha(0.15)
        axes.set_title("the run ended before")
        look = {"ha": "center", "va": "center", "color": RED, "weight": "bold"}
        words = textwrap.fill(chosen.sentence.split(";")[0], 30 if tall else 60)
        axes.text(0.5 * high[0], 0.5 * high[1], words, **look)


def _far_end(axes, answer):
    """Displacement of the far end, of the truth and of the chosen run."""
    style, label = STYLES[answer.method], f"{seconds(answer.chosen.step)} a step"
    axes.plot(TIME_MS, 1e6 * answer.truth.moved, color=GREY, lw=4.0, alpha=0.5, label="truth")
    axes.plot(TIME_MS, 1e6 * answer.chosen.moved, color=style.colour, label=label)
    axes.set(xlabel="time [ms]", ylabel="far end moved by [µm]", title=style.label)
    axes.yaxis.set_major_formatter("{x:.1f}")
    axes.legend(loc="upper left")


def _price(axes, answer):
    """Error over seconds at every step of the methods tried so far, the chosen one ringed."""
    axes.set(xscale="log", yscale="log", xlim=(7e-4, 1.0), ylim=(1e-14, 3.0))
    axes.axhspan(1.0, 3.0, color="0.94", lw=0, label="× diverged: cost without an error")
    axes.axhline(1e-2, color=GREY, ls=":", lw=1.0, label="error of 1 %")
    for row, (method, strikes) in enumerate(answer.ladders.items()):
        style = STYLES[method]
        good = [(one.seconds, one.error(answer.truth)) for one in strikes if not one.sentence]
        look = {"marker": style.marker, "color": style.colour, "ms": 5, "lw": 1.2}
        axes.plot(*zip(*good), label=style.label, **look)
        # A run that failed at once would have taken as long as the finest, by its steps.
        cost = [strikes[0].seconds * STEPS[0] / one.step for one in strikes if one.sentence]
        axes.plot(cost, [1.15 * 1.4**row] * len(cost), "x", color=style.colour, ms=5, mew=1.4)
    chosen = answer.chosen
    if not chosen.sentence:
        place = chosen.seconds, chosen.error(answer.truth)
        axes.plot(*place, "o", ms=14, mfc="none", mec=BLACK, mew=1.5)
        look = {"textcoords": "offset points", "weight": "bold"}
        # Below a point that lies high, clear of the title.
        axes.annotate(seconds(chosen.step), place, (10, 8 if place[1] < 0.1 else -22), **look)
    axes.set(xlabel="CPU time of one core [s]", ylabel="largest error of the far end [1]")
    axes.set_title("lower left is better")
    axes.set_yticks([1e-8, 1e-6, 1e-4, 1e-2, 1.0])
    # Minor ticks would take a third of the time of the picture.
    axes.minorticks_off()
    axes.legend(loc="lower left")
