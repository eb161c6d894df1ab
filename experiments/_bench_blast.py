"""The blast's figures: contact units a second, and the paper's problem by several methods."""

import numpy as np

from _blast import METHODS, paper_scene
from taichi_dem import Multirate, Simulation, Uniform
from taichi_dem.kit.study import on_device, seconds_of
from taichi_dem.simulation import macro_steps


def measure(quick):
    """Yield the figures of the blast: name, unit, values, bound; quick: of a shorter problem."""
    yield "bonded phase", "million units/s", bonded_phase(3 if quick else 7), ">= 30"
    problem = "paper's problem to 0.1 ms" if quick else "paper's problem"
    repeats, until = (1, 1e-4) if quick else (3, 5e-4)
    bounds = [""] * 4 if quick else ["<= 0.9", "<= 5", "<= 8", "<= 20"]

    def reports(name, step=None):
        make, own = METHODS[name]
        return paper_problem(make(step or own), repeats, until)

    yield f"{problem}, implicit", "s", run_seconds(reports("implicit")), bounds[0]
    yield f"{problem}, limited", "s", run_seconds(reports("explicit_limited")), bounds[1]
    controlled = reports("multirate_controlled")
    yield f"{problem}, controlled", "s", run_seconds(controlled), bounds[2]
    yield "controlled, ideal gain", "1", [controlled[0].ideal_gain], ""
    own = run_seconds(paper_problem(Multirate(1e-8, 1e-7), repeats, until))
    yield f"{problem}, l = 1e-07 m", "s", own, bounds[3]
    if not quick:
        # One step for all of equal accuracy is that of the finest body in the controlled run.
        uniform = reports("explicit_limited", METHODS["multirate_controlled"][1] / 8.0)
        gain = np.median(run_seconds(uniform)) / np.median(run_seconds(controlled))
        yield "controlled, realised gain", "1", [gain], ">= 3"
        own = run_seconds(paper_problem(Multirate(1e-8, 1e-8), 1, until))
        yield f"{problem}, l = 1e-08 m", "s", own, "<= 130"


def bonded_phase(repeats, steps=4000):
    """Million contact units a second while all bonds hold: whole steps, bodies included."""
    simulation = Simulation(paper_scene(), Uniform(1e-9))
    simulation.advance_to(steps)
    units = 3e-6 * simulation.model.bond_count * steps
    ends = [(k + 2) * steps for k in range(repeats)]
    return [units / seconds_of(simulation.advance_to, end) for end in ends]


def paper_problem(method, repeats, until):
    """Reports of the paper's problem by a method; compiling is not in their seconds."""
    reports = []
    for _ in range(repeats):
        simulation = Simulation(paper_scene(), method)
        simulation.advance_to(macro_steps(until, method.dt0))
        reports.append(simulation.report())
    return reports


def run_seconds(reports):
    """Seconds of runs, of CPU or of the wall; compiling is not in them."""
    return [r.run_seconds if on_device() else r.run_cpu_seconds for r in reports]
