"""Price of an answer: the far end of a struck bar is asked for with any tolerance.

All runs on the thread of the session.
"""

import math
from typing import Any, NamedTuple

import _page  # noqa: F401
import taichi_dem as dem
from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, RED
from taichi_dem.kit.session_thread import session
from taichi_dem.mesh.shapes import bar

LENGTH, WIDTH, CELLS = 0.4, 0.05, (12, 1, 1)
#: The far end is asked for when the wave comes to it [s].
UNTIL = 1.2e-4
#: Tolerances to choose from [%], and the first.
TOLERANCES, FIRST = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01), 3.0
PAGE, WAIT = "what_an_answer_costs", "Asking."
ALT = "Answers with their bars, sources of error, bars and true errors, and CPU time"
SIZE, TALL = (8.8, 5.4), (4.4, 10.6)
CONTROLS = {"tolerance": (TOLERANCES, FIRST, "largest error that you allow [%]")}
#: Step of the truth [s], a tenth or less of those of answers to 0.03 %.
FINEST = 1e-8
#: Other meshes of the bar, and how far their nodes are moved at most [m]: a tenth of an element.
MESHES, MOVED = 3, 0.1 * LENGTH / CELLS[0]
GOAL = dem.goals.displacement("right")
NANO = 1e6


class Asked(NamedTuple):
    """The answer to a choice, all answers so far by tolerance [%], and the true value [mm].

    mesh: the source of error that a step does not mend.
    """

    chosen: Any
    answers: dict
    truth: float
    mesh: Any

    def shares(self):
        """Half-widths by source, as shares of the truth [%]."""
        parts = {"step": self.chosen.error, "mesh": self.mesh.error}
        return {name: 100.0 * error / self.truth for name, error in parts.items()}

    def error(self, tolerance):
        """Error of an answer, a share of the truth."""
        return abs(self.answers[tolerance].value / self.truth - 1.0)

    def bar(self, tolerance):
        """Half-width of the bar of an answer, a share of the truth."""
        return self.answers[tolerance].error / self.truth


def scene():
    """The bar under a short blow on its left end."""
    blow = dem.effects.GasPressure("left", peak=1e6, rise=1e-5, decay_ratio=1.0)
    return dem.Scene(bar(LENGTH, WIDTH, CELLS), dem.CONCRETE, [blow, dem.effects.BondDamping()])


@session.remember
def solved(tolerance):
    """The answer to a tolerance [%]."""
    question = {"until": UNTIL, "goal": GOAL, "tolerance": 0.01 * tolerance, "progress": None}
    return dem.solve(scene(), **question)


@session.remember
def mesh_source():
    """The mesh as a source of error: the spread over meshes of this size."""
    from _meshes import with_moved_nodes  # of the folder above, which ``_page`` makes known

    meshes = [with_moved_nodes(scene().mesh, MOVED, seed) for seed in range(MESHES)]
    asked = {"tolerance": 0.01 * TOLERANCES[0], "sources": ["mesh"], "meshes": meshes}
    found = dem.solve(scene(), until=UNTIL, goal=GOAL, **asked, progress=None)
    return next(one for one in found.sources if one.name == "mesh")


@session.remember
def truth():
    """The value at a step far finer than those of any answer [mm]."""
    method = dem.ImplicitDashpots(FINEST, sweeps=(2, 400), tolerance=1e-9)
    looks = {"until": UNTIL, "samples": 1, "frames": 1, "progress": None}
    return GOAL.value(dem.simulate(scene(), method=method, **looks))


def answer(tolerance):
    """Ask to the tolerance nearest to this one [%]; returns an Asked."""
    nearest = min(TOLERANCES, key=lambda one: abs(one - tolerance))
    # The truth first: it compiles, and no answer's price has that in it.
    true, answers = truth(), session.kept("answers by tolerance", dict)
    answers[nearest] = solved(nearest)
    known = dict(sorted(answers.items(), reverse=True))
    return Asked(answers[nearest], known, true, mesh_source())


def words(asked):
    """The answer in a sentence, beside the truth."""
    found = asked.chosen
    value, error, true = (NANO * one for one in (found.value, found.error, asked.truth))
    digits = max(0, 1 - math.floor(math.log10(error))) if error > 0.0 else 6
    outcome = "" if found.reached else f" {found.shortfall}."
    return (
        f"You allow {100.0 * found.tolerance:g} %. The far end has moved by "
        f"**{value:.{digits}f} ± {error:.{digits}f} nm**, after **{found.plan.runs} runs** and "
        f"**{found.plan.seconds:.2g} s** of one core ({found.plan.method}).{outcome} "
        f"The truth is **{true:.{digits}f} nm**, of this mesh: others of its size move it by "
        f"± {asked.shares()['mesh']:.1f} %, which no step reduces ({asked.mesh.seconds:.2g} s)."
    )


def draw(figure, asked, tall):
    """Values with their bars, bars and errors over what was asked, seconds over it."""
    drawn = {"values": _values, "budget": _budget, "errors": _errors, "price": _price}
    places, heights = [["values", "budget"], ["errors", "price"]], (0.75, 1.0)
    if tall:
        places, heights = [[name] for name in drawn], (0.8, 0.6, 1.0, 1.0)
    panels = figure.subplot_mosaic(places, height_ratios=heights)
    for name, draw_panel in drawn.items():
        draw_panel(panels[name], asked)


def _values(axes, asked):
    """All answers so far with their bars, a row each, and the truth."""
    for tolerance, found in asked.answers.items():
        row, colour = TOLERANCES.index(tolerance), RED if found is asked.chosen else BLUE
        look = {"fmt": "o", "color": colour, "capsize": 4, "ms": 4}
        axes.errorbar(NANO * found.value, row, xerr=NANO * found.error, **look)
    true, count = NANO * asked.truth, len(TOLERANCES)
    axes.axvline(true, color=GREY, lw=4.0, alpha=0.5, label="truth")
    axes.set_yticks(range(count), [f"{one:g} %" for one in TOLERANCES])
    axes.set(xlabel="far end moved by [nm]", ylabel="error allowed")
    axes.set(xlim=(0.82 * true, 1.18 * true), ylim=(count - 0.4, -0.6))
    axes.set_title("each answer with its bar, of the step")
    axes.legend(loc="lower left")


def _budget(axes, asked):
    """Half-widths by source of the chosen answer, beside the error allowed."""
    shares = asked.shares()
    axes.barh([*shares], [*shares.values()], color=[RED, BLUE])
    axes.axvline(100.0 * asked.chosen.tolerance, color=GREY, ls=":", label="allowed error")
    axes.set(xscale="log", xlim=(1e-3, 1e2), xlabel="half-width [%]")
    axes.set_title("sources of error of the chosen answer")
    axes.invert_yaxis()
    axes.minorticks_off()
    axes.legend(loc="upper right")


def _errors(axes, asked):
    """Half-widths of bars and true errors over the error allowed."""
    asked_for = list(asked.answers)
    axes.plot(TOLERANCES, TOLERANCES, color=GREY, ls=":", label="allowed error")
    bars = [100.0 * asked.bar(one) for one in asked_for]
    axes.plot(asked_for, bars, "o-", color=BLUE, ms=5, label="bar")
    errors = [100.0 * asked.error(one) for one in asked_for]
    axes.plot(asked_for, errors, "x", color=BLACK, label="true error")
    axes.set(ylabel="bar, error [%]", title="bar and true error", ylim=(1e-4, 1e2))
    _over_what_is_allowed(axes)


def _price(axes, asked):
    """Seconds of the answers so far, and what the chosen one predicts of others."""
    chosen = asked.chosen
    curve = [(100.0 * one.tolerance, one.seconds) for one in chosen.cost_curve]
    axes.plot(*zip(*curve), color=RED, ls="--", label="predicted by the chosen answer")
    spent = [(one, found.plan.seconds) for one, found in asked.answers.items()]
    axes.plot(*zip(*spent), "o-", color=BLUE, ms=5, label="paid")
    place = 100.0 * chosen.tolerance, chosen.plan.seconds
    axes.plot(*place, "o", ms=12, mfc="none", color=RED, label="the chosen answer")
    axes.set(ylabel="CPU time of one core [s]", title="cost of an answer", ylim=(5e-3, 5.0))
    _over_what_is_allowed(axes)


def _over_what_is_allowed(axes):
    """Both panels alike: less is allowed further right."""
    axes.set(xscale="log", yscale="log", xlabel="error allowed [%]")
    axes.set_xlim(1.5 * TOLERANCES[0], TOLERANCES[-1] / 1.5)
    # Minor ticks would take a third of the time of the picture.
    axes.minorticks_off()
    axes.legend(loc="upper right")
