"""What does an answer with an error bar cost?

    python experiments/accuracy_on_request.py
    python experiments/accuracy_on_request.py --quick

Questions about bars under gas pressure are drawn at random. The price of an answer is the CPU time
of ``solve`` over that of the cheapest single run whose error is within the tolerance. That run is
found by a scan of all methods and steps, with the truth known. For most questions the longest
stable step is accurate enough. We then expect a price of 2.1: two runs, the second with a tenth
more steps. Where bonds break, five more runs measure the spread by chance.

It also compares answers to 10, 3, 1 and 0.3 % for the paper's block and damper with runs whose
steps are tuned by hand, and drops bodies on a slab, where no single run can answer. bar_coverage.py
tests whether the bars hold.
"""

import sys
from functools import partial

import numpy as np
import pandas as pd

import _accuracy as judge
from _questions import bar_question, dropped_question, paper_question
from ca_damper import Spheres, frequency_response, solve_response
from ca_damper import goals as damper_goals
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREY, ORANGE, RED, picture

NAME = "accuracy_on_request"
SETTINGS = {
    "prices": (30, 1, study.whole(1, 1000), "questions whose cost is compared, default 30"),
    # A short bar in a quick run.
    "first": (0, 3),
    # Whether single runs are made by other methods than that of the answers, too.
    "others": (True, False),
    "until": (1e-4, 5e-5),
    "later": (5e-4, 5e-5),
    "tolerances": ((0.1, 0.03, 0.01, 0.003), (0.1,)),
    "damper_tolerances": ((0.1, 0.03, 0.01), (0.3,)),
    "ratios": (33, 3),
    "cycles": ((150, 20), (5, 5)),
    "particles": (30, 10),
    "dropped": (0.02, 0.008),
    "twins": (8, 2),
}
#: Times are of one thread.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def price_row(seed, others):
    """Row of the table of prices; None where no single run, or no answer, is good enough."""
    question = bar_question(seed)
    found, runs = judge.judged(question), judge.fixed_runs(question, others)
    if found is None or not found.reached:
        return None
    most = question.tolerance * abs(found.true)
    good = [(spent, words) for words, value, spent in runs if abs(value - found.true) <= most]
    if not good:
        return None
    least, method = min(good)
    # The first may have compiled.
    spent = min(found.cpu_s, judge.answered(question, repeats=1)[1])
    row = {"seed": seed, "question": found.question, "solve_s": spent, "cheapest_s": least}
    return {**row, "cheapest_method": method, "half_step_s": runs[1][2]}


def cost_of_blast(options):
    """Panel of the paper's block, and what 1 % costs there [s]."""
    asked = [paper_question(options.until, share) for share in options.tolerances]
    found, true, fixed = zip(*map(judge.answered, asked)), judge.judged(asked[-1]).true, {}
    for words, value, spent in judge.fixed_runs(asked[-1], options.others):
        fixed.setdefault(words.split(",")[0], []).append((abs(value / true - 1.0), spent))
    return panel_of(true, *found, fixed)


def cost_of_damper(options):
    """Panel of the paper's damper, what 1 % costs there, and the fixed job: 150 + 20 cycles [s]."""
    given = {"particles": options.particles, "progress": None}
    asked = {"goal": [damper_goals.peak_ratio(), damper_goals.peak_rms()], **given}
    shares = options.damper_tolerances
    found = [solve_response(Spheres(), tolerance=share, **asked)[1] for share in shares]
    job = {"ratios": np.linspace(0.88, 1.04, options.ratios), "seeds": 1, **given}
    # Compiles.
    frequency_response(Spheres(), **job, transient_cycles=0, measured_cycles=1)
    begun, cycles = study.clock(), zip(("transient_cycles", "measured_cycles"), options.cycles)
    peak = float(frequency_response(Spheres(), **job, **dict(cycles)).rms[0].max())
    spent, true = study.clock() - begun, found[-1].value
    fixed = {"fixed cycles and frequencies": [(abs(peak / true - 1.0), spent)]}
    return *panel_of(true, found, [one.plan.seconds for one in found], fixed), spent


def panel_of(true, answers, seconds, fixed):
    """Answers and fixed runs as ``draw_cost`` takes them, and the seconds nearest to 1 %."""
    print(*(f"{100 * one.tolerance:g} %: {one}" for one in answers), sep="\n")
    shares = [(one.error / true, abs(one.value / true - 1.0)) for one in answers]
    nearest = np.abs(np.log([one.tolerance / 0.01 for one in answers])).argmin()
    return ([(*both, spent) for both, spent in zip(shares, seconds)], fixed), seconds[nearest]


def draw_cost(path, panels):
    """CPU time against error: answers as a line, single runs with a fixed step as points.

    panels: by title, the answers as (share of the value that the bar is, share that the value is
    off, seconds), and the fixed runs by method as lists of (share off, seconds).
    """
    with picture(path, 1, len(panels), size=(4.5 * len(panels), 4.4), squeeze=False) as (_, axes):
        for one, (title, (answers, fixed)) in zip(axes[0], panels.items()):
            for (name, runs), colour, mark in zip(fixed.items(), (ORANGE, RED, GREY), "sDv"):
                tried = np.maximum(np.array(runs).T, [[1e-6], [0.0]])
                one.plot(100.0 * tried[0], tried[1], mark, color=colour, label=name, markersize=4)
            bars, off, seconds = np.maximum(np.array(answers).T, 1e-6)
            look = {"color": BLUE, "zorder": 3}
            one.plot(100.0 * bars, seconds, "-o", label="answer, by its bar", **look)
            one.plot(100.0 * off, seconds, "x", label="the same, by its true error", **look)
            one.set(xscale="log", yscale="log", title=title, xlabel="error / value [%]")
            one.set_ylabel("CPU time, all runs of an answer [s]")
            one.invert_xaxis()
            one.legend(loc="lower center", bbox_to_anchor=(0.5, 1.1), ncols=2)


def draw_parting(path, time_ms, ways, apart, answer):
    """How far bodies have gone in runs that differ by one rounding, and how far these are apart.

    time_ms (frames,). ways (runs, frames): mean way [mm]. apart (runs - 1, frames): difference of
    the usual body, as a share of its way. answer: to the question what the way is at the end.
    """
    with picture(path, 1, 2, size=(9.0, 4.2)) as (_, (left, right)):
        left.plot(time_ms, ways.T, color=BLUE, linewidth=0.8)
        left.set(xlabel="time [ms]", ylabel="mean path of the bodies [mm]")
        left.set_title(f"{len(ways)} runs whose starts differ by one rounding")
        right.semilogy(time_ms[1:], np.maximum(apart[:, 1:].T, 1e-16), color=BLUE, linewidth=0.8)
        words = f"tolerance, {100 * answer.tolerance:g} %"
        right.axhline(answer.tolerance, color=ORANGE, label=words)
        look = {"color": RED, "linestyle": "--", "label": "from here on solve sees them separate"}
        right.axvline(1e3 * answer.plan.parting_s, **look)
        right.set(xlabel="time [ms]", ylabel="distance from the first run / path [1]")
        right.set_title("how far they are apart")
        right.legend(loc="lower right")


def run(options):
    """Ask all questions, compare the prices, write tables and pictures."""
    folder = study.begin(options)
    seeds = range(options.first, options.first + options.prices)
    prices = [price_row(seed, options.others) for seed in seeds]
    prices = pd.DataFrame([row for row in prices if row]).eval("ratio = solve_s / cheapest_s")
    prices.to_csv(folder / "prices.csv", index=False)
    (block, block_s), (damper, damper_s, fixed_s) = cost_of_blast(options), cost_of_damper(options)
    late, late_s = judge.answered(paper_question(options.later, 0.01))
    panels = {"paper's block, hole displacement": block, "paper's damper, peak RMS": damper}
    draw_cost(folder / "cost.png", panels)
    dropped = dropped_question(options.dropped)
    answer, _ = judge.answered(dropped, repeats=1)
    print(f"dropped bodies: {answer}")
    draw_parting(folder / "twins.png", *judge.twins_of(dropped, options.twins), answer)
    figures = {
        "price_ratio_median": (float(prices.ratio.median()), "1"),
        "price_ratio_worst": (float(prices.ratio.max()), "1"),
        "priced": (len(prices), "1"),
        "seconds_at_1_percent_blast": (block_s, "s"),
        "seconds_at_1_percent_blast_later": (late_s, "s"),
        "hole_later_mm": (late.value, "mm"),
        "hole_later_error_mm": (late.error, "mm"),
        "seconds_at_1_percent_damper": (damper_s, "s"),
        "fixed_damper_s": (fixed_s, "s"),
    }
    study.finish(options, NAME, figures, 0.0, see="cost.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
