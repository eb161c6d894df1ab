"""What accuracy costs in the blast: the paper's rule, step control, limited and solved dashpots.

    python experiments/cost_of_accuracy_blast.py          # about ten minutes on one core
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

import math
import os
import sys
import time
from dataclasses import dataclass, replace
from typing import Callable

from _blast import blast_parser
from _blast_accuracy import MEASURES, SPLIT, Outcome, blast, displacement_error
from taichi_dem import ImplicitDashpots, Multirate, StepControl, Uniform, read_mesh
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import power, styles_of
from taichi_dem.kit.plot_style import seconds as seconds_in_words
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import Timing, cached, figure, finish, main, print_table, write_rows
from taichi_dem.kit.study.work_precision import (
    ANSWER_HEADER,
    Point,
    answer_rows,
    answers,
    percent,
    write_answers,
    write_points,
)
from taichi_dem.kit.study.work_precision_picture import picture_errors, picture_work_precision

NAME = "cost_of_accuracy_blast"
PAPER_DT0 = 1e-8
#: The paper's largest way in a step [m].
PAPER_L = 1e-8
TARGETS = (0.1, 0.01, 0.001)
#: A run that took longer is not made a second time [s].
ENOUGH = 4.0
TIME = "CPU time of one thread [s], least of its runs"


@dataclass(frozen=True)
class Method:
    """A way to step: make(step) gives the method; steps: coarse to fine [s], or [m] if by_way."""

    make: Callable
    steps: tuple
    steps_of_quick: tuple = ()
    by_way: bool = False

    def label(self, step):
        """A step in words."""
        return f"l = {1e6 * step:g} µm" if self.by_way else seconds_in_words(step)


def controlled(dt0):
    """Step control; dashpots are limited where they ask for an eighth of the largest step."""
    control = StepControl(dashpot_floor=dt0 / 8)
    return Multirate(dt0, 1e-5, control=control, dashpot="limited")


METHODS = {
    "uniform": Method(
        lambda way: Uniform(PAPER_DT0, way), (1e-6, 3e-7, 1e-7, PAPER_L), by_way=True
    ),
    "multirate_held": Method(
        lambda way: Multirate(PAPER_DT0, way),
        (1e-6, 3e-7, 1e-7, 3e-8, PAPER_L),
        (1e-7,),
        by_way=True,
    ),
    "multirate_drifted": Method(
        lambda way: Multirate(PAPER_DT0, way, "drifted"), (3e-7, 1e-7, 3e-8), by_way=True
    ),
    "controlled": Method(controlled, (3.2e-7, 1.6e-7, 8e-8, 4e-8, 2e-8)),
    "limited": Method(
        lambda dt: Uniform(dt, dashpot="limited"), (1e-7, 4e-8, 2e-8, 1e-8, 5e-9), (2e-8,)
    ),
    "implicit": Method(ImplicitDashpots, (4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7, 1e-7, 5e-8), (5e-7,)),
    "fixed": Method(Uniform, (1e-8, 4e-9, 2e-9, 1e-9)),
}
FULL = {"until": 1e-4, "methods": tuple(METHODS), "reference": 1.25e-8, "twins": tuple(METHODS)}
QUICK = {
    "until": 6e-5,
    "methods": ("multirate_held", "limited", "implicit"),
    "reference": 5e-8,
    "twins": ("multirate_held",),
}
CHECK = "multirate_held"


def options_parser():
    """Options of this experiment; times are of one thread."""
    made = blast_parser(NAME, __doc__)
    made.set_defaults(threads=1)
    return made


def run(options):
    """Run all methods, write pictures and tables, answer what an error costs."""
    sizes = QUICK if options.quick else FULL
    mesh = read_mesh(options.mesh)
    output_folder(options.out)
    started = time.perf_counter()
    with ProgressBar("reference") as bar:
        reference, kept = reference_of(mesh, sizes, options, bar)
    made = {name: Sweep(name, mesh, sizes, options, reference) for name in sizes["methods"]}
    points = [point for sweep in made.values() for point in sweep.points]
    floors = {name: sweep.floor for name, sweep in made.items() if sweep.twins}
    titles = {name: style.label for name, style in styles_of(made).items()}
    rows = answer_rows(points, TARGETS, floors, titles)
    write_all(options.out, made, points, floors, rows, reference)
    picture_all(options.out, made, points, floors, reference, sizes, titles)
    runs = [run for sweep in made.values() for run in sweep.everything]
    compiling = sum(run.compile_seconds for run in [*runs, *([] if kept else [reference])])
    print_table(rows, ANSWER_HEADER)
    print()
    figures = figures_of(made, points, floors, reference)
    spent = time.perf_counter() - started
    finish(options, NAME, figures, (compiling, spent - compiling))


def reference_of(mesh, sizes, options, bar):
    """(Outcome of the reference, whether it was kept from before)."""
    # Swept until nothing changes by a thousandth, not a twentieth, of the largest speed.
    method = ImplicitDashpots(sizes["reference"], sweeps=(6, 50), tolerance=1e-3)
    settings = (method, sizes["until"], mesh.points.tobytes(), mesh.tetrahedra.tobytes())
    found, kept = cached(
        os.path.join(options.out, "references"),
        "implicit",
        settings,
        ("taichi_dem",),
        lambda: blast(mesh, method, sizes["until"], options.driver, progress=bar).as_dict(),
    )
    return Outcome(**found), kept


class Sweep:
    """All runs of one method.

    runs: Outcome by step, coarse to fine. twins: of those that were run again disturbed. points:
    of the diagram.
    """

    def __init__(self, name, mesh, sizes, options, reference):
        self.name, self.method, self.reference = name, METHODS[name], reference
        self.mesh, self.until, self.driver = mesh, sizes["until"], options.driver
        self.runs, self.twins = {}, {}
        steps = self.method.steps_of_quick if options.quick else self.method.steps
        for step in steps:
            # The coarsest of several is too coarse for its spread to matter.
            again = name in sizes["twins"] and (step != steps[0] or len(steps) == 1)
            with ProgressBar(f"{name}, {self.method.label(step)}") as bar:
                self._run(step, again, bar)

    def _run(self, step, again, bar):
        settings = (self.mesh, self.method.make(step), self.until, self.driver)
        run = self.runs[step] = blast(*settings, progress=bar)
        if again and not run.failure and run.cpu_s < ENOUGH:
            self.twins[step] = blast(*settings, seed=1, progress=bar)

    @property
    def everything(self):
        """All runs."""
        return (*self.runs.values(), *self.twins.values())

    @property
    def points(self):
        """A Point for every run."""
        return [self._point(step, run) for step, run in self.runs.items()]

    def _point(self, step, run):
        blank = Point(self.name, step, self.method.label(step), run.evaluations)
        if run.failure:
            words = f"diverged at {1e6 * run.reached_s:.0f} µs"
            return replace(blank, evaluations=self._missed_work(step), failure=words)
        timing = Timing.of([run.cpu_s, *(self.twins[s].cpu_s for s in self.twins if s == step)])
        error = displacement_error(run, self.reference)
        return replace(blank, error=error, seconds=timing, residual=run.residual)

    def _missed_work(self, step):
        """Evaluations of a failed run, had it come to its end: as of the next finer, by steps."""
        good = [s for s in self.runs if not self.runs[s].failure]
        near = max(good, default=None)
        if near is None:
            run = self.runs[step]
            return run.evaluations * self.until / run.reached_s
        return self.runs[near].evaluations * near / step

    @property
    def floor(self):
        """Distance of two runs that differ by round-off, at the finest step that was run twice."""
        return self.apart(min(self.twins))

    def apart(self, step):
        """Distance of the two runs at a step, as a share of the displacement."""
        return displacement_error(self.twins[step], self.runs[step])


def write_all(folder, made, points, floors, rows, reference):
    """CSV of points, of every run with all its errors and its energy split, and of answers."""
    write_points(os.path.join(folder, "points.csv"), points, floors)
    write_answers(os.path.join(folder, "answers.csv"), rows)
    table = [_row("reference", math.nan, reference, reference, False)]
    for name, sweep in made.items():
        for runs, again in ((sweep.runs, False), (sweep.twins, True)):
            table += [_row(name, step, one, reference, again) for step, one in runs.items()]
    write_rows(os.path.join(folder, "runs.csv"), table)


def _row(name, step, run, reference, again):
    failed = bool(run.failure)
    measures = {
        f"{measure}_error": math.nan if failed else error(run, reference)
        for measure, (error, _) in MEASURES.items()
    }
    return {
        "method": name,
        "step": step,
        "disturbed": int(again),
        **measures,
        "broken_faces": len(run.broken),
        "evaluations": run.evaluations,
        "cpu_s": run.cpu_s,
        "wall_s": run.wall_s,
        "compile_s": run.compile_seconds,
        "residual": run.residual,
        "reached_s": run.reached_s,
        **{f"{term}_J": run.energy[term] for term in (*SPLIT, "load_work")},
        # A comma would end the cell.
        "failure": run.failure.replace(",", ";"),
    }


def picture_all(folder, made, points, floors, reference, sizes, titles):
    """The work-precision diagram, and the same for broken faces and energy."""
    scene = (
        f"{len(reference.moved)} bodies to {1e6 * sizes['until']:.0f} µs, "
        f"{len(reference.broken)} faces broken"
    )
    against = f"Reference: solved dashpots at {seconds_in_words(sizes['reference'])}"
    check = distance_of_check(made)
    # Floors far below all errors would only squeeze the picture.
    least = min(point.error for point in points if point.error > 0.0)
    shown = {name: floor for name, floor in floors.items() if floor > 0.1 * least}
    chaos = f"Runs that differ by 1 pm at the start end {power(max(floors.values()))} apart"
    picture_work_precision(
        os.path.join(folder, "work_precision.png"),
        points,
        titles,
        floors=shown,
        time_name=TIME,
        error_name="error of the displacement field [1]",
        work_name="evaluations of bonds and contact pairs [1]",
        residual_names=("step [ns], or displacement limit l [nm]", "unexplained energy / work [1]"),
        step_unit=1e-9,
        caption=f"Paper's block, {scene}. Error: RMS over all bodies of (displacement - reference) "
        f"/ RMS of the reference. Step control has limited dashpots.\n{against}; "
        f"the paper's multirate rule at its finest lies {percent(check)} from it. {chaos}.",
    )
    errors = {
        words: {
            name: [
                (point.seconds.low, error(sweep.runs[point.step], reference))
                for point in sweep.points
                if not point.failure
            ]
            for name, sweep in made.items()
        }
        for error, words in MEASURES.values()
    }
    caption = f"Paper's block, {scene}. {against}. Points at the bottom edge have no error at all."
    path = os.path.join(folder, "errors.png")
    picture_errors(path, errors, titles, time_name=TIME, caption=caption)


def distance_of_check(made):
    """Distance of the reference to the finest run of the paper's multirate rule."""
    sweep = made[CHECK]
    return displacement_error(sweep.runs[min(sweep.runs)], sweep.reference)


def figures_of(made, points, floors, reference):
    """Cheapest ways to an error, price of the paper's rule, floors, check of the reference."""
    figures = {}
    for target, prefix in ((0.01, "cheapest_seconds_at_"), (0.001, "seconds_at_")):
        words = percent(target).replace(" %", "_percent")
        best = answers(points, target, floors)[0]
        figures[f"{prefix}{words}"] = figure(best.point and best.point.seconds.low, "s")
        figures[f"cheapest_method_at_{words}"] = figure(best.point and best.method, "")
    if "uniform" in made:
        paper = made["uniform"].runs[PAPER_L]
        figures["paper_rule_seconds"] = figure(paper.cpu_s, "s")
        figures["paper_rule_error"] = figure(displacement_error(paper, reference), "1")
    figures["chaos_floor"] = figure(max(floors.values()), "1")
    apart = [sweep.apart(step) for sweep in made.values() for step in sweep.twins]
    figures["chaos_at_any_step"] = figure(max(apart), "1")
    figures["reference_check"] = figure(distance_of_check(made), "1")
    if "fixed" in made:
        good = [step for step, run in made["fixed"].runs.items() if not run.failure]
        figures["longest_fixed_step_full_dashpots"] = figure(max(good, default=None), "s")
    for name in made:
        best = next(a for a in answers(points, 0.01, floors) if a.method == name)
        seconds = best.point and best.point.seconds.low
        figures[f"seconds_at_1_percent_{name}"] = figure(seconds, "s")
    return figures


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
