"""Effects that a scene needs: a bar is pulled open and pressed together, with any effects.

Every choice of effects is a program of its own, and to compile one takes seconds. So answers come
from three programs, with contact and friction, with contact alone and without either, in which the
other effects are silent: the same bits.
The cost of a choice is measured with its own program, on demand. Dashpots are solved, so that a
step may be twenty times as long as they would allow. All runs on the thread of the session.
"""

from functools import partial

import numpy as np

import taichi_dem as dem
from _page import percent
from taichi_dem.kit.plot_style import BLUE, GREY, RED
from taichi_dem.kit.session_thread import session
from taichi_dem.mesh.shapes import bar
from taichi_dem.plot.view import draw_bodies
from taichi_dem.simulate import result_of, simulate

LENGTH = 0.3
BAR = bar(LENGTH, 0.1, (3, 2, 2))
UNTIL, LOOKS = 9e-4, 10
METHOD = dem.ImplicitDashpots(4e-7)
#: Runs of each program to measure a cost.
TURNS = 5
#: The right end goes with v cos(2 pi f t), and sideways at half of it: v [m/s] to choose, f [Hz].
SPEEDS = (0.05, 0.2, 0.5, 0.75, 1.0, 1.5, 2.0)
SIDEWAYS, FREQUENCY = 0.5, 900.0
#: Looks at which the bar is drawn: pulled open, and pressed together.
SHOWN = {"pulled open": 3, "pressed together": LOOKS}
#: Effects to choose from and their words; the first three act without contact.
EFFECTS = {
    "bond_damping": (dem.effects.BondDamping, "dashpots of the bonds"),
    "softening": (dem.effects.Softening, "fracture"),
    "shear_slip": (dem.effects.ShearSlip, "slip in shear"),
    "body_contact": (dem.effects.BodyContact, "contact of fragments"),
    "sticking_friction": (dem.effects.StickingFriction, "friction of fragments"),
}
ALL = tuple(EFFECTS)
PAGE, WAIT = "which_effects_a_scene_needs", "Pulling."
ALT = "Bar with all effects and with those chosen, cost of a step"
SIZE, TALL = (8.8, 4.2), (4.4, 11.0)
CONTROLS = {name: (bool, True, words) for name, (_, words) in EFFECTS.items()}
CONTROLS["speed"] = (SPEEDS, 2.0, "the right end starts with [m/s]")
#: The programs that answer, each with all that can be silent.
PROGRAMS = ALL[:3], ALL[:4], ALL


class Answer:
    """Results for one choice, of the effects chosen and of all; speed: of the right end [m/s].

    stroke: largest displacement of that end [m]. change: mean distance of the bodies from where all
    effects bring them, by how far that is; None where a run did not come to its end. advice: what
    the program advises on the effects chosen. step_s: CPU seconds of a step of both, each with a
    program of its own; None if not measured.
    """

    def __init__(self, speed, chosen, complete, advice, step_s=None):
        self.chosen, self.complete = chosen, complete
        self.advice, self.step_s = advice, step_s
        self.stroke, self.change = speed / (2.0 * np.pi * FREQUENCY), None
        both = chosen, complete
        if not any(one.diverged for one in both):
            here, there = (one.frames[LOOKS].displacement for one in both)
            apart, way = (np.linalg.norm(one, axis=1).mean() for one in (here - there, there))
            self.change = float(apart / way)


def scene(names, program, speed):
    """The bar, held on the left and moved on the right; effects not named are silent."""
    moved = dem.effects.PrescribedMotion("right", (speed, SIDEWAYS * speed, 0.0), FREQUENCY)
    made = {name: EFFECTS[name][0]() for name in program}
    listed = [effect if name in names else effect.silent() for name, effect in made.items()]
    return dem.Scene(BAR, dem.CONCRETE, [*listed, dem.effects.Fixed("left"), moved])


def ran(names, speed, program=None):
    """Result with these effects, also of a run that diverged; program: of theirs alone, if None."""
    looks = {"until": UNTIL, "samples": LOOKS, "frames": LOOKS, "progress": None}
    pulled = scene(names, program or names, speed)
    return result_of(simulate, pulled, method=METHOD, **looks)


@session.remember
def outcome(names, speed):
    """The same by a program that is there already, in which other effects stand silent by."""
    program = next(program for program in PROGRAMS if {*names} <= {*program})
    return ran(names, speed, program)


@session.remember
def advice(names, speed):
    """Advice on a choice of effects; runs it again without those that did nothing."""
    return dem.needed_effects(outcome(names, speed))


def answer(speed, measured=False, **listed):
    """The Answer to one of SPEEDS and a choice of effects; friction acts in contacts only."""
    without = set() if listed.get("body_contact") else {"sticking_friction"}
    names = tuple(name for name in ALL if listed.get(name) and name not in without)
    if measured:
        return price(names, speed)
    return Answer(speed, outcome(names, speed), outcome(ALL, speed), advice(names, speed))


def price(names, speed):
    """The Answer with costs: both programs in turn, the shortest run of each."""
    dem.Simulation(scene(names, names, speed), METHOD).start()
    both = [[ran(listed, speed) for listed in (names, ALL)] for _ in range(TURNS)]
    reports = [[result.report for result in pair] for pair in both]
    spent = [[one.run_cpu_seconds / max(1, one.substeps) for one in pair] for pair in reports]
    return Answer(speed, *both[0], advice(names, speed), np.min(spent, axis=0))


def preparation():
    """Runs of all programs, and with all effects at every speed: no later answer waits for them."""
    programs = [partial(outcome, program, SPEEDS[0]) for program in PROGRAMS]
    return [*programs, *(partial(outcome, ALL, speed) for speed in SPEEDS)]


def verdicts(answer):
    """A row for every effect: (words, whether listed, what it did, what the program advises)."""
    listed = answer.chosen.report.effects
    return [
        (words, name in listed, *answer.advice.verdict(name, kind.__name__))
        for name, (kind, words) in EFFECTS.items()
    ]


def words(answer):
    """The outcome in sentences, with what the program said of each effect."""
    spares = "is not measured"
    if answer.step_s is not None:
        spared = 1.0 - answer.step_s[0] / answer.step_s[1]
        spares = f"spares **{percent(max(0.0, spared))}** of a step"
    change = "no comparison" if answer.change is None else percent(answer.change)
    chosen = answer.chosen
    said = [f"The program says: *{chosen.diverged}.*"] if chosen.diverged else []
    said += [f"It warns: *{warning}.*" for warning in chosen.report.unresolved]
    first = f"The end is pulled out by **{1e3 * answer.stroke:.2g} mm**. Your choice {spares}; "
    rows = ["| effect | listed | what it did | the program says |", "|---|---|---|---|"]
    for words, on, did, says in verdicts(answer):
        rows.append(f"| {words} | {'yes' if on else 'no'} | {did} | **{says}** |")
    sentences = " ".join([f"{first}bodies end **{change}** away.", *said])
    return "\n".join([sentences, "", *rows])


def draw(figure, answer, tall):
    """The bar with all effects and with those chosen, and the cost of a step."""
    rows = {"all effects": answer.complete, "your choice": answer.chosen}
    # The stroke looks like a twelfth of the bar, to one digit.
    magnify = float(f"{LENGTH / 12.0 / answer.stroke:.1g}")
    titles = [[f"{name}, {instant}" for instant in SHOWN] for name in rows]
    places = [[*pair, name] for pair, name in zip(titles, rows)]
    shape = {"width_ratios": (1.0, 1.0, 0.75)}
    if tall:
        places = [[one] for one in (*sum(zip(*titles), ()), *rows)]
        shape = {"height_ratios": (1.0, 1.0, 1.0, 1.0, 0.7, 0.7)}
    panels = figure.subplot_mosaic(places, **shape)
    bars = [panels[title] for pair in titles for title in pair]
    for result, pair in zip(rows.values(), titles):
        for title, number in zip(pair, SHOWN.values()):
            drawn = _pulled(panels[title], answer, result, number, magnify)
            panels[title].set_title(title, loc="center")
    words = f"moved to the right [mm], drawn × {magnify:.0f}"
    figure.colorbar(drawn, ax=bars, label=words, location="bottom", aspect=50, pad=0.02)
    _prices(*(panels[name] for name in rows), answer)


def _pulled(axes, answer, result, number, magnify):
    """The bar at a look; words where the run did not get there."""
    ended = number >= len(result.frames)
    result = answer.complete if ended else result
    frame, end = result.frames[number], 1e3 * answer.stroke
    look = {"magnify": magnify, "cmap": "RdBu_r", "clim": (-end, end)}
    look["broken"] = np.isfinite(result.broken_time)
    drawn = draw_bodies(axes, result.model, frame, 1e3 * frame.displacement[:, 0], **look)
    axes.set(xlim=(-0.01, 0.34), ylim=(-0.04, 0.15))
    axes.set_axis_off()
    if ended:
        drawn.set_alpha(0.15)
        axes.text(0.15, 0.05, "the program ended the run", ha="center", color=RED, weight="bold")
    return drawn


def _prices(above, below, answer):
    """Time of a step of both, where it has been measured, and their broken bonds."""
    far, words = answer.change, "one of the runs did not end"
    words = words if far is None else f"bodies end {percent(far)} away"
    above.set(xlabel="time of a step [µs]", title="what it costs")
    below.set(xlabel="broken bonds [1]", title=words)
    broken = [one.report.broken_faces for one in (answer.chosen, answer.complete)]
    costs = None if answer.step_s is None else 1e6 * answer.step_s
    for axes, values, form in ((above, costs, "%.3g"), (below, broken, "%d")):
        if values is None:
            axes.set(xticks=[], yticks=[])
            axes.text(0.5, 0.5, "not measured", ha="center", va="center")
            continue
        bars = axes.barh(["your choice", "all effects"], values, color=[BLUE, GREY], height=0.5)
        axes.bar_label(bars, fmt=form, padding=3)
        axes.set_xlim(0.0, 1.25 * max(values) or 1.0)
        axes.grid(False, axis="y")
