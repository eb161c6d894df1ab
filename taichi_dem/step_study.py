"""How the outcome of a scene depends on the step of a method: error, cost, and chaos."""

from typing import Any, Callable

from taichi_dem.kit.plot_style import seconds
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.timing import Timing
from taichi_dem.kit.study.work_precision import Point
from taichi_dem.outcome import Outcome, displacement_error, outcome_of
from taichi_dem.scene import Scene

#: How far bodies are displaced at the start of a run that differs by round-off only [m].
DISTURBANCE = 1e-12


class StepStudy:
    """Outcomes of a scene by one method at several steps, and twins disturbed by ``DISTURBANCE``.

    name: of the method. make: makes it of a step, a time [s] or a displacement limit [m]. until:
    [s]. label: gives a step in words. runs, twins: Outcomes by step, in the order of ``run``.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[float], Any],
        scene: Scene,
        until: float,
        *,
        driver: str = "auto",
        label: Callable[[float], str] = seconds,
    ):
        self.name, self.make, self.label = name, make, label
        self.scene, self.until, self.driver = scene, until, driver
        self.runs: dict[float, Outcome] = {}
        self.twins: dict[float, Outcome] = {}

    def run(self, step: float, enough: float = 0.0) -> None:
        """Run at a step, and again as a twin if that took less than enough [s] and did not fail."""
        made = self.runs[step] = self._outcome(step)
        if not made.failure and made.cpu_s < enough:
            self.twins[step] = self._outcome(step, DISTURBANCE)

    def _outcome(self, step, disturbance=0.0):
        job: Any = {"driver": self.driver, "disturbance": disturbance}
        with ProgressBar(f"{self.name}, {self.label(step)}") as bar:
            return outcome_of(self.scene, self.make(step), self.until, progress=bar, **job)

    @property
    def outcomes(self) -> list[Outcome]:
        """All runs and twins."""
        return [*self.runs.values(), *self.twins.values()]

    @property
    def spread(self) -> dict[float, float]:
        """Distance of the displacements of each twin from those of its run, by step."""
        return {step: displacement_error(one, self.runs[step]) for step, one in self.twins.items()}

    @property
    def floor(self) -> float:
        """Error that no step can take away: the spread at the last twin's step, 0 without one."""
        return [0.0, *self.spread.values()][-1]

    def points(self, reference: Outcome) -> list[Point]:
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
