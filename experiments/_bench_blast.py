"""Speed of the blast of the paper's block: rates, the visit of a bond, and whole runs."""

from statistics import median
from types import SimpleNamespace

import taichi as ti

from _bench_figure import Figure, by_turns
from _bench_work import VISIT, bytes_a_step, work_since
from _blast import METHODS, paper_scene
from taichi_dem import ImplicitDashpots, Multirate, Simulation, Uniform, simulate
from taichi_dem.kit import study
from taichi_dem.kit.study import on_device
from taichi_dem.kit.study.floors import Work
from taichi_dem.observers import macro_steps
from taichi_dem.step.implicit.bonds import BOND_COLOURS

#: Ends of the short and of the whole run [s].
SHORT, WHOLE = 1e-4, 5e-4
#: Step and displacement limit of the paper, end of its run here [s], and the evaluations of bonds
#: and pairs that this method makes to the end of the whole run, counted in one.
FINEST, EARLY, EVALUATIONS = (1e-8, 1e-8), 1e-4, 1_278_384_011
#: Step that 1 % allows in the short run [s]; step [s] and sweeps of what it is compared with.
ROUGH, EXACT = 8e-7, (2.5e-8, (6, 40))
#: Step of the bonded phase [s], and its steps that are timed together.
STEP, STEPS = 1e-9, 4000
#: Visits of all bonds in a call.
SWEEPS = 500
#: By the words of a figure: method, runs in the full bench, bound of a whole run.
RUNS = {
    "implicit": ("implicit", 5, "<= 0.45"),
    "limited": ("explicit_limited", 1, "<= 5"),
    "controlled": ("multirate_controlled", 2, "<= 8"),
    "l = 1e-07 m": ("paper_multirate", 1, "<= 14"),
}


def measure(quick):
    """Yield the blast's contact units a second, and the paper's problem by several methods."""
    yield from bonded_phase(3 if quick else 7)
    yield from visits(3 if quick else 7)
    yield from short_runs(quick)
    if not quick:
        yield from whole_runs()


def driver():
    """The driver of one core, where there is a core."""
    return "auto" if on_device() else "resident"


def bonded_phase(repeats):
    """Yield million contact units a second while all bonds hold: whole steps with the bodies."""
    simulation = Simulation(paper_scene(), Uniform(STEP), driver())
    simulation.advance_to(STEPS)
    bonds = simulation.model.bond_count
    # Three units a bond.
    work = Work(bytes_a_step(simulation.engine) / (3 * bonds))
    ends = [(k + 2) * STEPS for k in range(repeats)]
    seconds = [study.seconds_of(simulation.advance_to, end) for end in ends]
    values = [3e-6 * bonds * STEPS / one for one in seconds]
    yield Figure("bonded phase", "million units/s", values, ">= 60", work)


def visits(repeats):
    """Yield the time of a visit of an intact bond in a sweep, after a run to 0.1 ms."""
    if on_device():
        return
    method = METHODS["implicit"][0](METHODS["implicit"][1])
    simulation = Simulation(paper_scene(), method, driver())
    simulation.advance_to(macro_steps(SHORT, method.dt0))
    # A broken bond is no visit, although its place is looked at.
    broken = simulation.state.broken()
    count, solver = SWEEPS * int((~broken).sum()), simulation.engine.advance.solver
    sweep_bonds(solver, 1)
    seconds = [study.seconds_of(sweep_bonds, solver, SWEEPS) for _ in range(repeats)]
    yield Figure("visit of a bond", "ns", [1e9 * one / count for one in seconds], "<= 14", VISIT)


@ti.kernel
def sweep_bonds(solver: ti.template(), times: ti.i32):
    """Visit all bonds one after the other, in their order, several times."""
    ti.loop_config(serialize=True)
    for _ in range(times):
        for g in range(solver.bonds.colour_first[BOND_COLOURS]):
            solver.bonds_of(g)


def short_runs(quick):
    """Yield the time of runs to 0.1 ms, in the quick bench of a second method too.

    A step of ``ROUGH`` is what an error of 1 % allows there; the error is measured.
    """
    repeats = 3 if quick else 5
    rough = f"implicit, {1e6 * ROUGH:g} us"
    works = {
        "implicit": run_of("implicit", SHORT, repeats),
        rough: run_of("implicit", SHORT, repeats, ROUGH),
    }
    if quick:
        works["limited"] = run_of("explicit_limited", SHORT, 1)
    for words, runs in by_turns(works).items():
        bound = "<= 0.06" if words == rough else ""
        yield timed(f"paper's problem to 0.1 ms, {words}", runs, bound)
    if not quick:
        error = abs(hole_at(SHORT, ROUGH) / hole_at(SHORT, EXACT[0], sweeps=EXACT[1]) - 1.0)
        yield Figure(f"error at 0.1 ms, {rough}", "%", [100.0 * error], "<= 1")


def hole_at(until, step, **sweeping):
    """Displacement of the hole at a time [mm], with solved dashpots."""
    method = ImplicitDashpots(step, **sweeping)
    result = simulate(paper_scene(), method=method, until=until, progress=None)
    return float(result.series["hole_radial_displacement_mm"][-1])


def whole_runs():
    """Yield the time of whole runs, and what different steps save over one step for all."""
    works = {words: run_of(name, WHOLE, repeats) for words, (name, repeats, _) in RUNS.items()}
    # One step for all of equal accuracy is that of the finest body in the controlled run.
    step = METHODS["multirate_controlled"][1] / 8.0
    works["uniform"] = run_of("explicit_limited", WHOLE, 1, step)
    works["finest"] = lambda: paper_run(Multirate(*FINEST), EARLY), 1
    found = by_turns(works)
    uniform, finest = found.pop("uniform"), found.pop("finest")
    for words, runs in found.items():
        yield timed(f"paper's problem, {words}", runs, RUNS[words][2])
    controlled = found["controlled"]
    yield Figure("controlled, ideal gain", "1", [controlled[0].gain])
    gain = median(one.seconds for one in uniform) / median(one.seconds for one in controlled)
    yield Figure("controlled, realised gain", "1", [gain])
    yield Figure("controlled, realised over ideal", "1", [gain / controlled[0].gain], ">= 0.9")
    yield from finest_run(finest)


def finest_run(runs):
    """Yield the time of early runs by the paper's own displacement limit, and what it foretells.

    Evaluations of bonds and pairs cost alike early and late: the whole run takes as many times
    longer as it evaluates more.
    """
    words = "l = 1e-08 m"
    yield timed(f"paper's problem to {1e3 * EARLY:g} ms, {words}", runs)
    values = [one.seconds * EVALUATIONS / one.evaluations for one in runs]
    work = runs[0].work * (EVALUATIONS / runs[0].evaluations)
    yield Figure(f"paper's problem, {words}, extrapolated", "s", values, "<= 95", work)


def run_of(name, until, repeats, step=None):
    """A function that runs a method to a time [s], and how often it is called."""
    make, usual = METHODS[name]
    return lambda: paper_run(make(step or usual), until), repeats


def paper_run(method, until):
    """Seconds of a run of the paper's problem without compiling, its least work and ideal gain."""
    simulation = Simulation(paper_scene(), method, driver())
    simulation.advance_to(macro_steps(until, method.dt0))
    report = simulation.report()
    seconds = report.run_seconds if on_device() else report.run_cpu_seconds
    made = {"seconds": seconds, "gain": report.ideal_gain, "work": work_since(simulation)}
    return SimpleNamespace(**made, evaluations=simulation.evaluations())


def timed(name, runs, bound=""):
    """Figure of the seconds of runs."""
    return Figure(name, "s", [one.seconds for one in runs], bound, runs[0].work)
