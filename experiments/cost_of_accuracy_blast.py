"""What accuracy costs in the blast: the paper's rule, step control, limited and solved dashpots.

    python experiments/cost_of_accuracy_blast.py          # about four minutes on one core
    python experiments/cost_of_accuracy_blast.py --quick

Every method runs the paper's block over a sweep of its step, up to an instant at which all methods
still converge to one result: 126 faces are broken by then. (One bond is on the edge of breaking at
2e-4 s; a millionth more or less decides which way the hole then goes, 1 % apart, so that later
results compare decisions, not errors.) The error is that of the displacements of all bodies; faces
and energy are judged beside it. The reference is the implicit method at a very short step, kept in
OUT/references, and checked by the finest run of the paper's multirate rule. Runs that are cheap
and not a method's coarsest are made a second time with all positions disturbed by 1e-12 m: their
distance is the chaos floor, their time the spread. Times are CPU seconds of one thread of stepping
alone, without compiling.
"""

import sys
from dataclasses import asdict
from functools import partial

import numpy as np

from _accuracy_steps import (
    SPLIT,
    Outcome,
    StepStudy,
    displacement_error,
    energy_error,
    faces_error,
    outcome_of,
)
from _blast import blast_parser, paper_scene
from taichi_dem import ImplicitDashpots, Multirate, ProgressBar, StepControl, Uniform
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import power, seconds, styles_of
from taichi_dem.kit.study.work_precision import percent
from taichi_dem.kit.study.work_precision_picture import picture_errors, picture_work_precision

NAME = "cost_of_accuracy_blast"
TARGETS = (0.1, 0.01, 0.001)
#: The paper's largest step [s], and its largest way in a step [m].
PAPER_DT0, PAPER_L = 1e-8, 1e-8
#: A run that took longer is not made a second time [s].
ENOUGH = 4.0
TIME = "CPU time of one thread [s], least of its runs"


def controlled(dt0):
    """Step control; dashpots are limited where they ask for an eighth of the largest step."""
    control = StepControl(dashpot_floor=dt0 / 8)
    return Multirate(dt0, 1e-5, control=control, dashpot="limited")


#: How each method is made of a step.
METHODS = {
    "uniform": lambda way: Uniform(PAPER_DT0, way),
    "multirate_held": lambda way: Multirate(PAPER_DT0, way),
    "multirate_drifted": lambda way: Multirate(PAPER_DT0, way, "drifted"),
    "controlled": controlled,
    "limited": lambda dt: Uniform(dt, dashpot="limited"),
    "implicit": ImplicitDashpots,
    "fixed": Uniform,
}
#: Their steps are ways [m], those of the others times [s]; all from coarse to fine.
BY_WAY = ("uniform", "multirate_held", "multirate_drifted")
STEPS = {
    "uniform": (1e-6, 3e-7, 1e-7, PAPER_L),
    "multirate_held": (1e-6, 3e-7, 1e-7, 3e-8, PAPER_L),
    "multirate_drifted": (3e-7, 1e-7, 3e-8),
    "controlled": (3.2e-7, 1.6e-7, 8e-8, 4e-8, 2e-8),
    "limited": (1e-7, 4e-8, 2e-8, 1e-8, 5e-9),
    "implicit": (4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7, 1e-7, 5e-8),
    "fixed": (1e-8, 4e-9, 2e-9, 1e-9),
}
QUICK_STEPS = {"multirate_held": (1e-7,), "implicit": (5e-7,)}
CHECK = "multirate_held"
SETTINGS = {
    "until": (1e-4, 6e-5),
    "steps": (STEPS, QUICK_STEPS),
    "reference": (1.25e-8, 5e-8),
    "twins": (tuple(METHODS), (CHECK,)),
}
#: Errors by the picture's words, the displacements' first.
MEASURES = {
    "displacement field": displacement_error,
    "faces broken in one only": faces_error,
    "energy split / work of the gas": energy_error,
}
TERMS = (*SPLIT, "load_work")
COLUMNS = (
    "method step disturbed displacement_error faces_error energy_error broken_faces evaluations "
    f"cpu_s wall_s compile_s residual reached_s {' '.join(f'{term}_J' for term in TERMS)} failure"
)
#: Times are of one thread.
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, threads=1)


def run(options):
    """Run all methods, write pictures and tables, answer what an error costs."""
    scene = paper_scene(options.mesh)
    folder = study.begin(options)
    reference, kept = reference_of(scene, options, folder)
    studies = {name: study_of(name, steps, scene, options) for name, steps in options.steps.items()}
    points = [point for one in studies.values() for point in one.points(reference)]
    floors = {name: one.floor for name, one in studies.items() if one.twins}
    titles = {name: style.label for name, style in styles_of(studies).items()}
    check = displacement_error([*studies[CHECK].runs.values()][-1], reference)
    study.give_answers(options.out, points, TARGETS, floors, titles)
    rows = [row_of(("reference", np.nan, 0), reference, reference)]
    for name, one in studies.items():
        for disturbed, some in enumerate((one.runs, one.twins)):
            rows += [row_of((name, step, disturbed), some[step], reference) for step in some]
    study.write_rows(folder / "runs.csv", rows, COLUMNS)
    picture_all(folder, options, studies, points, floors, reference, check, titles)
    figures = {
        **study.cheapest_figures(points, 0.01, floors, "cheapest_seconds"),
        **study.cheapest_figures(points, 0.001, floors, "seconds"),
        **figures_of(points, studies, reference),
        "chaos_floor": (max(floors.values()), "1"),
        "chaos_at_any_step": (max(max(studies[name].spread.values()) for name in floors), "1"),
        "reference_check": (check, "1"),
        **study.figures_by_method(points, 0.01, floors),
    }
    made = [run for one in studies.values() for run in one.outcomes] + [reference] * (not kept)
    study.finish(options, NAME, figures, float(sum(one.compile_seconds for one in made)))


def reference_of(scene, options, folder):
    """(Outcome of the reference, whether it was kept from before)."""
    # Swept until nothing changes by a thousandth, not a twentieth, of the largest speed.
    method = ImplicitDashpots(options.reference, sweeps=(6, 50), tolerance=1e-3)
    place = folder / "references", "implicit", (scene, method, options.until), ("taichi_dem",)
    with ProgressBar("reference") as bar:
        job = {"driver": options.driver, "progress": bar}
        made = partial(outcome_of, scene, method, options.until, **job)
        found, kept = study.cached(*place, lambda: asdict(made()))
    return Outcome(**found), kept


def study_of(name, steps, scene, options):
    """Runs of a method at all steps, with their disturbed twins."""
    job = {"driver": options.driver, "label": partial(label_of, name)}
    made = StepStudy(name, METHODS[name], scene, options.until, **job)
    for step in steps:
        # The coarsest of several is too coarse for its spread to matter.
        again = name in options.twins and (step != steps[0] or len(steps) == 1)
        made.run(step, ENOUGH if again else 0.0)
    return made


def label_of(name, step):
    """A step in words."""
    return f"l = {1e6 * step:g} µm" if name in BY_WAY else seconds(step)


def row_of(key, run, reference):
    """Row of runs.csv: all errors of a run, its cost and its energy split."""
    errors = [np.nan if run.failure else error(run, reference) for error in MEASURES.values()]
    cost = run.evaluations, run.cpu_s, run.wall_s, run.compile_seconds, run.residual, run.reached_s
    energy = [run.energy[term] for term in TERMS]
    # A comma would end the cell.
    return (*key, *errors, len(run.broken), *cost, *energy, run.failure.replace(",", ";"))


def picture_all(folder, options, studies, points, floors, reference, check, titles):
    """The work-precision diagram, and the same for broken faces and energy."""
    scene = (
        f"Paper's block, {len(reference.moved)} bodies to {1e6 * options.until:.0f} µs, "
        f"{len(reference.broken)} faces broken"
    )
    against = f"Reference: solved dashpots at {seconds(options.reference)}"
    # Floors far below all errors would only squeeze the picture.
    least = min(point.error for point in points if point.error > 0.0)
    picture_work_precision(
        folder / "work_precision.png",
        points,
        titles,
        floors={name: floor for name, floor in floors.items() if floor > 0.1 * least},
        time_name=TIME,
        error_name="error of the displacement field [1]",
        work_name="evaluations of bonds and contact pairs [1]",
        residual_names=("step [ns], or displacement limit l [nm]", "unexplained energy / work [1]"),
        step_unit=1e-9,
        caption=f"{scene}. Error: RMS over all bodies of (displacement - reference) "
        f"/ RMS of the reference. Step control has limited dashpots.\n{against}; "
        f"the paper's multirate rule at its finest lies {percent(check)} from it. "
        f"Runs that differ by 1 pm at the start end {power(max(floors.values()))} apart.",
    )
    own = {name: [p for p in points if p.method == name and not p.failure] for name in titles}
    errors = {
        words: {
            name: [(p.low, error(studies[name].runs[p.step], reference)) for p in good]
            for name, good in own.items()
        }
        for words, error in MEASURES.items()
    }
    caption = f"{scene}. {against}. Points at the bottom edge have no error at all."
    picture_errors(folder / "errors.png", errors, titles, time_name=TIME, caption=caption)


def figures_of(points, studies, reference):
    """Price of the paper's rule, and the longest step that full dashpots bear."""
    figures = {}
    paper = studies["uniform"].runs.get(PAPER_L) if "uniform" in studies else None
    if paper:
        error = displacement_error(paper, reference)
        figures = {"paper_rule_seconds": (paper.cpu_s, "s"), "paper_rule_error": (error, "1")}
    fixed = [point for point in points if point.method == "fixed"]
    if fixed:
        longest = max((point.step for point in fixed if not point.failure), default=None)
        figures["longest_fixed_step_full_dashpots"] = (longest, "s")
    return figures


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
