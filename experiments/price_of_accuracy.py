"""What does the hole of the paper's blast cost, known to 1 %, and what makes its error?

    python experiments/price_of_accuracy.py          # two minutes on one core
    python experiments/price_of_accuracy.py --quick

The opening of the hole at 0.1 ms is computed in four ways: by the paper's rule with its step and
displacement limit l; with limited dashpots and one short step; with solved dashpots and one long
step; and by ``solve`` to 10, 1 and 0.1 %. Of both fixed steps, the cheapest run is shown whose
error is within 1 %, also at all shorter steps. The reference has solved dashpots and a much shorter
step; the error of an answer is its own bar. Expect the cheapest run to cost a thousandth of the
paper's rule, and an answer some tens of such runs: these find the step, the error, and the effect
of chance, which with the paper's contact exceeds 0.1 %.

Then the same hole, at 0.5 ms, and the swing of a damped mass are asked for with all sources of
error measured: runs at half the step measure step and chance; a run with four times the rays
measures the contact law; meshes of the same size, with moved inner nodes, measure the mesh; spheres
measure the automaton. Expect the step, on which the runs are spent, to be the smallest source.

The paper's times are those of another, unnamed machine with one process: 16 min to 0.05 ms and 3897
min to 0.5 ms (Konno et al., section 4.3). The time to 0.1 ms lies between. For this machine the
summary has times of the rule to half and to all of the simulated time. A quick run ends at 0.06 ms
and has ten times the paper's l.

Seconds are CPU seconds of one thread of stepping, without compiling. Writes price_of_accuracy.png,
price_of_accuracy.csv, budget.png, budget.csv and summary.json to results/price_of_accuracy/.
"""

import itertools
import sys
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

import taichi_dem as dem
from ca_damper import Automaton, solve_response
from ca_damper import goals as damper_goals
from cases.blast import blast_parser, paper_scene, run_costs
from cases.meshes import with_moved_nodes
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREY, LIGHT_GREY, picture, seconds, styles_of

NAME = "price_of_accuracy"
#: The paper's largest step [s], and its largest way in a step [m].
PAPER_DT0, PAPER_L = 1e-8, 1e-8
SETTINGS = {
    "until": (1e-4, 6e-5, study.number(0, 1), "simulated time [s], default 1e-4"),
    "l": (PAPER_L, 1e-7, study.number(0, 1), "limit of a displacement in a step [m], default 1e-8"),
    "reference": (1.25e-8, 5e-8),
    "tolerances": ((0.1, 0.01, 0.001), (0.01,)),
    # Steps of the methods of a fixed step [s], from the longest down.
    "limited": ((1.6e-7, 8e-8, 4e-8, 2e-8, 1e-8), (4e-8, 2e-8)),
    "implicit": ((4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7), (2e-6, 1e-6)),
    # Of the budget: end [s] and meshes of the blast, tolerance of the damper.
    "later": (5e-4, 5e-5),
    "meshes": (5, 2, study.whole(2, 50), "other meshes of the block, default 5"),
    "damper_tolerance": (0.05, 0.5),
}
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, threads=1)
METHODS = {"limited": partial(dem.Uniform, dashpot="limited"), "implicit": dem.ImplicitDashpots}
WORDS = {"limited": "limited dashpots", "implicit": "solved dashpots"}
GOAL, ASKED = dem.goals.hole_displacement(), 0.01
#: The paper's times [s] to 0.05 and to 0.5 ms, and its first simulated time [s].
PAPER_SECONDS, PAPER_UNTIL = (16.0 * 60.0, 3897.0 * 60.0), 5e-5
#: Times that the axis names [s].
TICKS = {0.1: "0.1 s", 1.0: "1 s", 60.0: "1 min", 3600.0: "1 h", 86400.0: "1 d"}


#: How far inner nodes are moved, as a share of the size of an element; shares that are drawn [%].
MOVED, SHARES = 0.1, (1e-3, 1e3)


class Price(NamedTuple):
    """A bar: name of its figures, words, colour, price [s], error, and whether it is as asked."""

    key: str
    words: str
    colour: str
    seconds: float
    error: float
    reached: bool


def run_of(scene, method, options, title):
    """Displacement of the hole [mm], and CPU seconds of stepping to half of the time and to all."""
    seen = run_costs()
    looks = {"samples": 2, "frames": 1, "title": title, "observers": [seen]}
    result = dem.simulate(scene, method=method, until=options.until, **looks)
    return GOAL.value(result), seen["cpu_s"][1], result.report.run_cpu_seconds


def cheapest_run(name, scene, options, true):
    """Price of a method of a fixed step at the cheapest one that reaches what is asked."""
    prices, look = [], styles_of([name])[name]
    for step in getattr(options, name):
        value, _, spent = run_of(scene, METHODS[name](step), options, f"{name}, {seconds(step)}")
        words, error = f"{WORDS[name]}, {seconds(step)}", abs(value / true - 1.0)
        prices.append(Price(name, words, look.colour, spent, error, True))
    return cheapest(prices, ASKED) or prices[-1]._replace(reached=False)


def cheapest(prices, target):
    """The cheapest price with an error up to a target, or None; prices: with the finest step last.

    All finer steps must be as good: a single lucky run answers nothing. NaN is no error at all.
    """
    reached = itertools.takewhile(lambda one: one.error <= target, reversed(prices))
    return min(reached, key=lambda one: one.seconds, default=None)


def answer_of(scene, options, tolerance):
    """Price of an answer of ``solve``."""
    asked = {"until": options.until, "goal": GOAL, "tolerance": tolerance}
    answer = dem.solve(scene, **asked)
    study.show_answer("solve", answer)
    words = f"solve to {100.0 * tolerance:g} %"
    error = answer.error / answer.value
    key = f"solve_{100.0 * tolerance:g}_percent"
    return Price(key, words, BLUE, answer.plan.seconds, error, answer.reached)


def draw(path, prices, until):
    """Bars of all prices over those of the paper; names left, times and errors right."""
    names, levels = ["paper's machine", *(price.words for price in prices)], range(len(prices) + 1)
    times = [f"{PAPER_SECONDS[1] / 86400.0:.1f} d, error unknown", *map(time_and_error, prices)]
    with picture(path, size=(4.8, 3.3), dpi=300) as (_, axes):
        early, late = PAPER_SECONDS
        axes.barh(0, late, color=LIGHT_GREY)
        axes.barh(0, early, color=GREY)
        for end, words in ((early, "0.05 ms "), (late, "0.5 ms ")):
            axes.text(end, 0, words, ha="right", va="center")
        for level, price in enumerate(prices, 1):
            axes.barh(level, price.seconds, color=price.colour)
            if not price.reached:
                axes.text(1.2 * price.seconds, level, "missed", va="center")
        axes.set(xscale="log", xlim=(0.01, 1.2 * late), ylim=(levels[-1] + 0.5, -0.5))
        axes.set_yticks(levels, names)
        axes.set_xticks(list(TICKS), list(TICKS.values()))
        axes.set_xticks([], minor=True)
        axes.set_xlabel(f"time to compute {1e3 * until:g} ms to {100.0 * ASKED:g} %")
        right = axes.twinx()
        right.set_yticks(levels, times)
        right.set_ylim(axes.get_ylim())
        for one in (axes, right):
            one.tick_params(axis="y", length=0)
            one.grid(axis="y", visible=False)


def time_and_error(price):
    """Seconds and error of a price; the error of an answer is its own bar."""
    sign = "±" if price.key.startswith("solve") else ""
    return f"{float(f'{price.seconds:.2g}'):g} s, {sign}{100.0 * price.error:.2g} %"


def blast_budget(options):
    """Displacement of the hole with the sources that the paper's mesh and contact add."""
    mesh = dem.read_mesh(options.mesh)
    element = (np.prod(np.ptp(mesh.points, axis=0)) / mesh.body_count) ** (1.0 / 3.0)
    most = np.full((len(mesh.points), 1), MOVED * element)
    for faces in mesh.groups.values():
        most[np.unique(faces)] = 0.0
    meshes = [with_moved_nodes(mesh, most, seed) for seed in range(options.meshes)]
    scene = dem.Scene(mesh, dem.CONCRETE, "auto", loads=[dem.effects.GasPressure()])
    asked = {"tolerance": 0.05, "sources": ("step", "contact", "mesh"), "meshes": meshes}
    return dem.solve(scene, until=options.later, goal=GOAL, **asked)


def damper_budget(options):
    """Swing at resonance of a mass with a box of grains, by the automaton and by spheres."""
    asked = {"goal": damper_goals.rms_at(1.0), "tolerance": options.damper_tolerance}
    return solve_response(Automaton(), particles=20, sources=["filling"], **asked)


def budget_of(question, answer):
    """Rows of a table: each source as a share of the value, and its seconds."""
    print(f"{question}: {answer}\n")
    table = answer.budget.reset_index()
    table["share_percent"] = 100.0 * table.error / abs(answer.value)
    return table.assign(question=question, value=answer.value, unit=answer.unit)


def draw_budget(path, table):
    """Shares by source, a panel a question, with what each has cost."""
    with picture(path, 1, 2, (7.2, 2.8)) as (_, panels):
        for axes, (question, rows) in zip(panels, table.groupby("question", sort=False)):
            mine = rows[rows.share_percent > 0.0]
            axes.barh(mine.source, mine.share_percent, color=BLUE)
            for name, share, cpu_s in zip(mine.source, mine.share_percent, mine.cpu_s):
                words = f" {share:.2g} %, {cpu_s:.2g} s" if cpu_s else f" {share:.2g} %"
                axes.text(max(share, SHARES[0]), name, words, va="center", fontsize=7)
            axes.set(title=question, xlabel="half-width of the bar [%]", xscale="log")
            axes.set_xlim(SHARES)
            axes.invert_yaxis()


def run(options):
    """Run, ask, draw, print."""
    folder, scene = study.begin(options), paper_scene(options.mesh)
    true, _, _ = run_of(scene, dem.ImplicitDashpots(options.reference), options, "reference")
    job = scene, dem.Uniform(PAPER_DT0, options.l), options, "the paper's rule"
    value, half, spent = run_of(*job)
    words, error = f"paper's rule, l = {1e9 * options.l:g} nm", abs(value / true - 1.0)
    colour = styles_of(["uniform"])["uniform"].colour
    prices = [Price("paper_rule", words, colour, spent, error, error <= ASKED)]
    prices += [cheapest_run(name, scene, options, true) for name in METHODS]
    prices += [answer_of(scene, options, tolerance) for tolerance in options.tolerances]
    study.write_rows(folder / f"{NAME}.csv", prices, Price._fields)
    draw(folder / f"{NAME}.png", prices, options.until)
    figures = {f"{price.key}_seconds": (price.seconds, "s") for price in prices}
    figures.update({f"{price.key}_error": (price.error, "1") for price in prices})
    halfway = 0.5 * options.until
    early = PAPER_SECONDS[0] if abs(halfway / PAPER_UNTIL - 1.0) < 1e-9 else None
    figures["paper_rule_half_time_seconds"] = half, "s", early
    asked = {"hole of a blast": blast_budget, "damped mass": damper_budget}
    budget = pd.concat([budget_of(name, ask(options)) for name, ask in asked.items()])
    budget.to_csv(folder / "budget.csv", index=False)
    draw_budget(folder / "budget.png", budget)
    figures |= {
        f"{row.question}_{row.source}_percent".replace(" ", "_"): (row.share_percent, "%")
        for row in budget.itertuples()
    }
    study.finish(options, NAME, figures, 0.0)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
