"""What an answer with an error bar costs, and whether its bar is to be believed.

    python experiments/accuracy_on_request.py          # about 25 minutes on one core
    python experiments/accuracy_on_request.py --quick

Questions about bars under gas pressure and about dampers are drawn at random, by seeds that are
listed with what they ask in accuracy_questions.csv.

Price: CPU time of ``solve`` over that of the cheapest single run, with any of our methods and
steps, that is as near to the truth as was asked; found by scanning, with the truth known. The
longest stable step is near enough for most questions, so that nothing is spared by a coarser one:
two runs, of which one has half the step of the other, cost 2.5 times as much as the first alone,
or twice where setting up costs as much as stepping. That is the least at which the two can be
compared, and what we expect.
Bars: share that holds the value of a step 16 times finer. 95 % are meant; more would mean bars that
are too wide.
Besides, what 10, 3, 1 and 0.3 % cost for the paper's block and for the paper's damper, over runs
with steps tuned by hand; and bodies dropped on a slab, of which no single run can tell.
"""

import csv
import sys
from functools import partial
from pathlib import Path

import numpy as np

from _accuracy_blast import blast_question, dropped_question, paper_question
from _accuracy_damper import damper_question
from _accuracy_pictures import draw_calibration, draw_cost, draw_parting
from _accuracy_study import answered, cheapest, fixed_runs, judged_blast, judged_damper, twins_of
from ca_damper import Spheres, frequency_response, solve_response
from ca_damper import goals as damper_goals
from taichi_dem import ProgressBar
from taichi_dem.kit import study

NAME = "accuracy_on_request"
QUESTIONS = Path(__file__).with_name("accuracy_questions.csv")
SETTINGS = {
    "prices": (30, 1, study.whole(1, 30), "questions whose price is compared"),
    "blasts": (100, 2, study.whole(1, 120), "questions to the blast whose bars are checked"),
    "dampers": (24, 1, study.whole(1, 40), "questions to the damper whose bars are checked"),
    # Of a quick run: short bars, all with the same effects.
    "first": ({}, {"price": 3, "blast": 27}),
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
ROWS = "kind seed question tolerance_percent value error true holds reached cpu_s"
PRICES = "seed question tolerance_percent solve_s cheapest_s cheapest_method half_step_s ratio"
#: Times are of one thread.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


def run(options):
    """Ask all questions, judge the answers, write tables and pictures."""
    folder = study.begin(options)
    asked = {
        kind: seeds_of(kind, getattr(options, f"{kind}s"), options.first.get(kind, 0))
        for kind in ("price", "blast", "damper")
    }
    prices = [price_row(blast_question(seed), options.others) for seed in asked["price"]]
    study.write_rows(folder / "prices.csv", [row for row in prices if row], PRICES)
    judged = {
        "blast": [judged_blast(blast_question(seed)) for seed in asked["blast"]],
        "damper": [judged_damper(damper_question(seed)) for seed in asked["damper"]],
    }
    judged = {kind: [one for one in some if one is not None] for kind, some in judged.items()}
    rows = [one.row(kind) for kind, some in judged.items() for one in some]
    study.write_rows(folder / "bars.csv", rows, ROWS)
    ratios = [row[-1] for row in prices if row]
    found = {**figures_of(ratios, judged), **draw_all(folder, options, judged)}
    blasts = (one.answer.result.report for one in judged["blast"])
    compiling = sum(report.compile_seconds for report in blasts)
    study.finish(options, NAME, found, compiling, see="cost.png")


def seeds_of(kind, count, first):
    """So many seeds of a kind of question in the file, from the first on."""
    with open(QUESTIONS, newline="", encoding="utf-8") as lines:
        found = [int(row["seed"]) for row in csv.DictReader(lines) if row["kind"] == kind]
    return found[first : first + count]


def price_row(question, others):
    """Cells of the table of prices; None where no single run, or no answer, is good enough."""
    found, runs = judged_blast(question), fixed_runs(question, others)
    best = found and cheapest(runs, found.true, question.tolerance)
    if best is None or not found.answer.reached:
        return None
    words = str(question).replace(",", ";"), 100.0 * question.tolerance
    fixed = best.seconds, best.method.replace(",", ";"), runs[1].seconds
    return (question.seed, *words, found.seconds, *fixed, found.seconds / best.seconds)


def figures_of(ratios, judged):
    """Figures of all answers."""
    everyone = [one for some in judged.values() for one in some]
    singles = [one for one in everyone if one.single]
    figures = {
        "price_ratio_median": (float(np.median(ratios)), "1"),
        "price_ratio_worst": (max(ratios), "1"),
        "coverage_percent": (share_held(singles), "%"),
        "answers": (len(everyone), "1"),
        "without_a_single_number": (len(everyone) - len(singles), "1"),
        "reached_percent": (100.0 * np.mean([one.answer.reached for one in everyone]), "%"),
    }
    each = {f"coverage_percent_{name}": (share_held(some), "%") for name, some in judged.items()}
    return {**figures, **each}


def share_held(judged):
    """Share of the bars that hold the true value [%], of answers with a single number."""
    return 100.0 * float(np.mean([one.holds for one in judged if one.single]))


def draw_all(folder, options, judged):
    """Draw all pictures; figures of the papers' scenes."""
    panels, figures = {}, {}
    panels["paper's block, hole displacement"], seconds = cost_of_blast(options)
    figures["seconds_at_1_percent_blast"] = (seconds, "s")
    late, spent = answered(paper_question(options.later, 0.01))
    figures["seconds_at_1_percent_blast_later"] = (spent, "s")
    figures["hole_later_mm"], figures["hole_later_error_mm"] = (
        (late.value, "mm"),
        (late.error, "mm"),
    )
    panels["paper's damper, peak RMS"], times = cost_of_damper(options)
    figures.update({name: (seconds, "s") for name, seconds in times.items()})
    draw_cost(folder / "cost.png", panels)
    deviations = {
        name: [one.deviation for one in some if one.single] for name, some in judged.items()
    }
    everyone = [one for some in judged.values() for one in some]
    draw_calibration(folder / "calibration.png", deviations, share_held(everyone))
    dropped = dropped_question(options.dropped)
    answer, _ = answered(dropped, repeats=1)
    print(f"dropped bodies: {answer}")
    draw_parting(folder / "twins.png", *twins_of(dropped, options.twins), answer)
    return figures


def cost_of_blast(options):
    """Panel of the paper's block, and what 1 % costs there [s]."""
    found = [judged_blast(paper_question(options.until, share)) for share in options.tolerances]
    for one in found:
        print(f"{100 * one.question.tolerance:g} %: {one.answer}")
    true, fixed = found[-1].true, {}
    for one in fixed_runs(found[-1].question, options.others):
        name = one.method.split(",")[0]
        fixed.setdefault(name, []).append((abs(one.value / true - 1.0), one.seconds))
    seconds = at_one_percent(options.tolerances, [one.seconds for one in found])
    answers = [
        (one.answer.error / true, abs(one.answer.value / true - 1.0), one.seconds) for one in found
    ]
    return (answers, fixed), seconds


def cost_of_damper(options):
    """Panel of the paper's damper, and CPU times [s] at 1 % and of the fixed job."""
    asked = [damper_goals.peak_ratio(), damper_goals.peak_rms()]
    found = []
    with ProgressBar("damper") as bar:
        for share in options.damper_tolerances:
            given = {"particles": options.particles, "tolerance": share, "progress": bar}
            found.append(solve_response(Spheres(), goal=asked, **given))
            print(f"{100 * share:g} %: {found[-1][0]}\n{found[-1][1]}")
    height, (fixed_s, peak) = [both[1] for both in found], fixed_damper(options)
    true, times = height[-1].value, [one.plan.seconds for one in height]
    answers = [(a.error / true, abs(a.value / true - 1.0), a.plan.seconds) for a in height]
    seconds = at_one_percent(options.damper_tolerances, times)
    points = {"fixed cycles and frequencies": [(abs(peak / true - 1.0), fixed_s)]}
    return (answers, points), {"seconds_at_1_percent_damper": seconds, "fixed_damper_s": fixed_s}


def fixed_damper(options):
    """CPU time [s] and peak RMS [m] of the usual job: 150 + 20 cycles at 33 frequencies."""
    ratios = np.linspace(0.88, 1.04, options.ratios)
    given = {"particles": options.particles, "ratios": ratios, "seeds": 1, "progress": None}
    # Compiles.
    frequency_response(Spheres(), **given, transient_cycles=0, measured_cycles=1)
    begun, (transient, measured) = study.clock(), options.cycles
    cycles = {"transient_cycles": transient, "measured_cycles": measured}
    made = frequency_response(Spheres(), **given, **cycles)
    return study.clock() - begun, float(made.rms[0].max())


def at_one_percent(tolerances, seconds):
    """What the tolerance next to 1 % costs [s]."""
    return seconds[int(np.abs(np.log(np.array(tolerances) / 0.01)).argmin())]


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
