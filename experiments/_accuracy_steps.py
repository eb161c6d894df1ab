"""Outcome of a blast, and how it depends on the step of a method: error, cost, and chaos.

Two methods that solve one scene are compared by their outcomes: where all bodies are, which bonds
broke, and where the work went (``cost_of_accuracy_blast.py``).
"""

import math
from dataclasses import dataclass

import numpy as np

from taichi_dem import ProgressBar, Simulation
from taichi_dem.kit.plot_style import seconds
from taichi_dem.kit.study.timing import Timing
from taichi_dem.kit.study.work_precision import Point
from taichi_dem.simulate import result_of, run_simulation

#: Where the work of the loads goes; together with the rest they are the energy split.
SPLIT = (
    *("kinetic", "bond_strain", "sphere_strain", "bond_dashpot", "softening", "release"),
    *("slip", "sphere_dashpot", "friction", "injected"),
)
#: How far bodies are displaced at the start of a run that differs by round-off only [m].
DISTURBANCE = 1e-12


@dataclass(frozen=True)
class Outcome:
    """A run at its end, in numbers that a JSON file holds.

    moved: displacements [m], (n, 3) as lists. broken: released bonds. energy: terms of the energy
    balance [J]. evaluations: of bonds and contact pairs. cpu_s, wall_s: of stepping.
    compile_seconds: before it. residual: share of the work that the energy balance does not
    explain. reached_s: time. failure: the sentence of a run that diverged, or nothing; the figures
    are then those at that time.
    """

    moved: list
    broken: list
    energy: dict
    evaluations: int
    cpu_s: float
    wall_s: float
    compile_seconds: float
    residual: float
    reached_s: float
    failure: str = ""

    @classmethod
    def of(cls, result):
        """Outcome of a result with at least one frame, the last at its end."""
        report = result.report
        return cls(
            moved=result.frames[-1].displacement.tolist(),
            broken=np.flatnonzero(~np.isnan(result.broken_time)).tolist(),
            energy=report.energy_balance,
            evaluations=report.contact_evaluations,
            cpu_s=report.run_cpu_seconds,
            wall_s=report.run_seconds,
            compile_seconds=report.compile_seconds,
            residual=report.energy_residual_fraction,
            reached_s=report.until_s,
            failure=result.diverged,
        )


def outcome_of(scene, method, until, *, driver="auto", progress=None, disturbance=0.0):
    """Run a scene by a method to a time [s]; returns its Outcome, also where it diverges.

    disturbance: most that each coordinate of the bodies is moved by at the start [m], at random:
    two runs that differ by round-off alone show how far a result can be trusted.
    """
    simulation = Simulation(scene, method, driver)
    if disturbance:
        centre = simulation.model.centre
        noise = np.random.default_rng(1).uniform(-disturbance, disturbance, centre.shape)
        simulation.state.set_motion(centre + noise, **scene.initial_motion)
    looks = {"samples": 1, "frames": 1, "progress": progress}
    return Outcome.of(result_of(run_simulation, simulation, until=until, **looks))


def displacement_error(run, reference):
    """RMS over all bodies of the difference in displacement, as a share of the reference's RMS."""
    true = np.array(reference.moved)
    return _over(float(np.linalg.norm(np.array(run.moved) - true)), float(np.linalg.norm(true)))


def faces_error(run, reference):
    """Faces broken in one of the two only, as a share of the reference's broken faces."""
    odd = set(run.broken) ^ set(reference.broken)
    return len(odd) / max(1, len(reference.broken))


def energy_error(run, reference):
    """Half the sum over the terms of their differences, as a share of the loads' work.

    Half, as what is missing in one term is too much in another.
    """
    apart = sum(abs(run.energy[name] - reference.energy[name]) for name in SPLIT)
    return _over(0.5 * apart, abs(reference.energy["load_work"]))


def _over(apart, whole):
    """A difference over the size of a reference; infinite where only the reference is zero."""
    return apart / whole if whole else math.inf if apart else 0.0


class StepStudy:
    """Outcomes of a scene by one method at several steps, and twins disturbed by ``DISTURBANCE``.

    name: of the method. make: makes it of a step, a time [s] or a displacement limit [m]. until:
    [s]. label: gives a step in words. runs, twins: Outcomes by step, in the order of ``run``.
    """

    def __init__(self, name, make, scene, until, *, driver="auto", label=seconds):
        self.name, self.make, self.label = name, make, label
        self.scene, self.until, self.driver = scene, until, driver
        self.runs, self.twins = {}, {}

    def run(self, step, enough=0.0):
        """Run at a step, and again as a twin if that took less than enough [s] and did not fail."""
        made = self.runs[step] = self._outcome(step)
        if not made.failure and made.cpu_s < enough:
            self.twins[step] = self._outcome(step, DISTURBANCE)

    def _outcome(self, step, disturbance=0.0):
        job = {"driver": self.driver, "disturbance": disturbance}
        with ProgressBar(f"{self.name}, {self.label(step)}") as bar:
            return outcome_of(self.scene, self.make(step), self.until, progress=bar, **job)

    @property
    def outcomes(self):
        """All runs and twins."""
        return [*self.runs.values(), *self.twins.values()]

    @property
    def spread(self):
        """Distance of the displacements of each twin from those of its run, by step."""
        return {step: displacement_error(one, self.runs[step]) for step, one in self.twins.items()}

    @property
    def floor(self):
        """Error that no step can take away: the spread at the last twin's step, 0 without one."""
        return [0.0, *self.spread.values()][-1]

    def points(self, reference):
        """Points with errors of the displacements against a reference, in the order of ``run``."""
        return [self._point(step, run, reference) for step, run in self.runs.items()]

    def _point(self, step, run, reference):
        if run.failure:
            words = f"diverged at {1e6 * run.reached_s:.0f} µs"
            return Point(self.name, step, self.label(step), self._work(step, run), failure=words)
        twin = self.twins.get(step, run)
        timing = Timing.of([run.cpu_s] if twin is run else [run.cpu_s, twin.cpu_s])
        figures = displacement_error(run, reference), timing, run.residual
        return Point(self.name, step, self.label(step), run.evaluations, *figures)

    def _work(self, step, failed):
        """Evaluations of a failed run: those of the next finer by steps, or its own to the end."""
        near = max((at for at, run in self.runs.items() if not run.failure), default=None)
        if near is None:
            gone = failed.reached_s / self.until
            return failed.evaluations / gone if gone else failed.evaluations
        return self.runs[near].evaluations * near / step
