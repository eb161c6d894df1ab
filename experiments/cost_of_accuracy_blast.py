"""What accuracy costs in the blast: the paper's rule, step control, limited and solved dashpots.

    python experiments/cost_of_accuracy_blast.py          # about four minutes on one core
    python experiments/cost_of_accuracy_blast.py --quick

Every method runs the paper's block over a sweep of its step, up to a time at which all methods
still converge to one result: 126 faces are broken by then. (At 2e-4 s a change of a millionth
decides whether one bond breaks, which moves the hole by 1 %.) The error is that of the
displacements of all bodies; broken faces and energy are also compared. The reference is the
implicit method at a very short step, kept in OUT/references, and checked by the finest run of the
paper's multirate rule. Cheap runs, except a method's coarsest, are repeated with all positions
disturbed by 1e-12 m: the difference is the chaos floor, the times give the spread. Times are CPU
seconds of one thread of stepping alone, without compiling.
"""

import sys
from functools import partial

import numpy as np

from _blast import blast_parser, paper_scene
from taichi_dem import ImplicitDashpots, Multirate, Simulation, StepControl, Uniform
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import power, seconds, styles_of
from taichi_dem.kit.study.work_precision import Point, percent
from taichi_dem.kit.study.work_precision_picture import picture_errors, picture_work_precision
from taichi_dem.simulate import result_of, run_simulation

NAME = "cost_of_accuracy_blast"
#: The paper's largest step [s], and its largest way in a step [m].
PAPER_DT0, PAPER_L = 1e-8, 1e-8
#: A run that took longer is not made a second time [s]; how far that one is disturbed [m].
ENOUGH, DISTURBANCE = 4.0, 1e-12
TIME = "CPU time of one thread [s], least of its runs"


def controlled(dt0):
    """Step control; dashpots are limited where they ask for an eighth of the largest step."""
    return Multirate(dt0, 1e-5, control=StepControl(dashpot_floor=dt0 / 8), dashpot="limited")


drifted = partial(Multirate, PAPER_DT0, neighbour="drifted")
#: How each method is made of a step, from coarse to fine; the first three of ways [m], not times.
METHODS = {
    "uniform": (partial(Uniform, PAPER_DT0), (1e-6, 3e-7, 1e-7, PAPER_L)),
    "multirate_held": (partial(Multirate, PAPER_DT0), (1e-6, 3e-7, 1e-7, 3e-8, PAPER_L)),
    "multirate_drifted": (drifted, (3e-7, 1e-7, 3e-8)),
    "controlled": (controlled, (3.2e-7, 1.6e-7, 8e-8, 4e-8, 2e-8)),
    "limited": (partial(Uniform, dashpot="limited"), (1e-7, 4e-8, 2e-8, 1e-8, 5e-9)),
    "implicit": (ImplicitDashpots, (4e-6, 2e-6, 1e-6, 5e-7, 2.5e-7, 1e-7, 5e-8)),
    "fixed": (Uniform, (1e-8, 4e-9, 2e-9, 1e-9)),
}
STEPS = {name: steps for name, (_, steps) in METHODS.items()}
BY_WAY, CHECK = (*METHODS,)[:3], "multirate_held"
SETTINGS = {
    "until": (1e-4, 6e-5),
    "steps": (STEPS, {CHECK: (1e-7,), "implicit": (5e-7,)}),
    "reference": (1.25e-8, 5e-8),
    "twins": (tuple(METHODS), (CHECK,)),
}
#: Where the work of the gas goes.
SPLIT = """kinetic bond_strain sphere_strain bond_dashpot softening release slip sphere_dashpot
    friction injected""".split()
#: Times are of one thread.
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, threads=1)


def outcome_of(scene, method, until, disturbance=0.0, **looks):
    """Run a scene by a method to a time [s]: numbers that a JSON file holds, of its end.

    moved: displacements [m], (n, 3). broken: bonds. energy: terms of the balance [J]. failure: the
    sentence of a run that diverged, or nothing. disturbance: most that each coordinate is moved by
    at the start [m]: runs that differ by round-off alone show how far a result can be trusted.
    """
    simulation = Simulation(scene, method, looks.pop("driver", "auto"))
    if disturbance:
        centre = simulation.model.centre
        noise = np.random.default_rng(1).uniform(-disturbance, disturbance, centre.shape)
        simulation.state.set_motion(centre + noise, **scene.initial_motion)
    result = result_of(run_simulation, simulation, until=until, samples=1, frames=1, **looks)
    report = result.report
    return {
        "moved": result.frames[-1].displacement.tolist(),
        "broken": np.flatnonzero(~np.isnan(result.broken_time)).tolist(),
        "energy": report.energy_balance,
        "evaluations": report.contact_evaluations,
        "cpu_s": report.run_cpu_seconds,
        "compile_s": report.compile_seconds,
        "residual": report.energy_residual_fraction,
        "reached_s": report.until_s,
        "failure": result.diverged,
    }


def displacement_error(run, reference):
    """RMS over all bodies of the difference in displacement, as a share of the reference's RMS."""
    true = np.array(reference["moved"])
    apart, size = np.linalg.norm(np.array(run["moved"]) - true), np.linalg.norm(true)
    return float(apart / size)


def faces_error(run, reference):
    """Faces broken in one of the two only, as a share of the reference's broken faces."""
    odd = set(run["broken"]) ^ set(reference["broken"])
    return len(odd) / max(1, len(reference["broken"]))


def energy_error(run, reference):
    """Half the sum over the terms of their differences, as a share of the loads' work.

    Half, as what is missing in one term is too much in another.
    """
    apart = sum(abs(run["energy"][name] - reference["energy"][name]) for name in SPLIT)
    return 0.5 * apart / abs(reference["energy"]["load_work"])


#: Errors by the picture's words, the displacements' first.
MEASURES = {
    "displacement field": displacement_error,
    "faces broken in one only": faces_error,
    "energy split / work of the gas": energy_error,
}


def label_of(name, step):
    """A step in words."""
    return f"l = {1e6 * step:g} µm" if name in BY_WAY else seconds(step)


def runs_of(scene, options):
    """Outcomes by method and step; spread, again_s: distance and time of the twin, if any."""
    runs = {}
    for name, steps in options.steps.items():
        for step in steps:
            job = scene, METHODS[name][0](step), options.until
            shown = {"driver": options.driver, "title": f"{name}, {label_of(name, step)}"}
            made = runs[name, step] = outcome_of(*job, **shown)
            # The coarsest of several is too coarse for its spread to matter.
            again = name in options.twins and (step != steps[0] or len(steps) == 1)
            if again and not made["failure"] and made["cpu_s"] < ENOUGH:
                twin = outcome_of(*job, DISTURBANCE, **shown)
                made.update(spread=displacement_error(twin, made), again_s=twin["cpu_s"])
                made["compile_s"] += twin["compile_s"]
    return runs


def point_of(name, step, runs, reference):
    """Point of the work-precision diagram."""
    run, known = runs[name, step], (name, step, label_of(name, step))
    if not run["failure"]:
        spent = study.Timing.of([run["cpu_s"], run.get("again_s", run["cpu_s"])])
        error = displacement_error(run, reference)
        return Point(*known, run["evaluations"], error, spent, run["residual"])
    # To the end it would take what the next finer one takes, by steps.
    done = [key for key, one in runs.items() if key[0] == name and not one["failure"]]
    near = max(done, default=(name, step))
    work = runs[near]["evaluations"] * near[1] / step
    return Point(*known, work, failure=f"diverged at {1e6 * run['reached_s']:.0f} µs")


def run(options):
    """Run all methods, write pictures and tables, answer what an error costs."""
    scene, folder = paper_scene(options.mesh), study.begin(options)
    # Swept until nothing changes by a thousandth, not a twentieth, of the largest speed.
    method = ImplicitDashpots(options.reference, sweeps=(6, 50), tolerance=1e-3)
    job, shown = (scene, method, options.until), {"driver": options.driver, "title": "reference"}
    place = folder / "references", "implicit", job, ("taichi_dem",)
    reference, kept = study.cached(*place, partial(outcome_of, *job, **shown))
    runs = runs_of(scene, options)
    points = [point_of(*key, runs, reference) for key in runs]
    spreads = {key: one["spread"] for key, one in runs.items() if "spread" in one}
    # Of the finest.
    floors = {name: spread for (name, _), spread in spreads.items()}
    check = [point.error for point in points if point.method == CHECK][-1]
    titles = {name: style.label for name, style in styles_of(options.steps).items()}
    figures = study.give_answers(options.out, points, floors, titles)
    figures["chaos_floor"] = max(floors.values()), "1"
    figures["chaos_at_any_step"] = max(spreads.values()), "1"
    figures["reference_check"] = check, "1"
    draw(folder, options, runs, points, floors, reference, check)
    if paper := runs.get(("uniform", PAPER_L)):
        figures["paper_rule_seconds"] = paper["cpu_s"], "s"
        figures["paper_rule_error"] = displacement_error(paper, reference), "1"
    if fixed := [point for point in points if point.method == "fixed"]:
        longest = max((point.step for point in fixed if not point.failure), default=None)
        figures["longest_fixed_step_full_dashpots"] = longest, "s"
    compiling = sum(one["compile_s"] for one in [*runs.values(), *[reference] * (not kept)])
    study.finish(options, NAME, figures, float(compiling))


def draw(folder, options, runs, points, floors, reference, check):
    """The work-precision diagram, and the same for broken faces and energy."""
    scene = (
        f"Paper's block, {len(reference['moved'])} bodies to {1e6 * options.until:.0f} µs, "
        f"{len(reference['broken'])} faces broken"
    )
    against = f"Reference: solved dashpots at {seconds(options.reference)}"
    # Floors far below all errors would only squeeze the picture.
    least = min(point.error for point in points if point.error > 0.0)
    picture_work_precision(
        *(folder / "work_precision.png", points),
        floors={name: floor for name, floor in floors.items() if floor > 0.1 * least},
        **{"time_name": TIME, "error_name": "error of the displacement field [1]"},
        work_name="evaluations of bonds and contact pairs [1]",
        residual_names=("step [ns], or displacement limit l [nm]", "unexplained energy / work [1]"),
        step_unit=1e-9,
        caption=f"{scene}. Error: RMS over all bodies of (displacement - reference) "
        f"/ RMS of the reference. Step control has limited dashpots.\n{against}; "
        f"the paper's multirate rule at its finest lies {percent(check)} from it. "
        f"Runs that differ by 1 pm at the start end {power(max(floors.values()))} apart.",
    )
    errors = {words: {name: [] for name in options.steps} for words in MEASURES}
    for point in (point for point in points if not point.failure):
        for words, error in MEASURES.items():
            pair = point.low, error(runs[point.method, point.step], reference)
            errors[words][point.method].append(pair)
    caption = f"{scene}. {against}. Points at the bottom edge have no error at all."
    picture_errors(folder / "errors.png", errors, time_name=TIME, caption=caption)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
