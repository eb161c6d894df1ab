"""Sources of error beside the step: chance, the contact law, the mesh, effects left out."""

import contextlib
import copy
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.kit.bars.answer import Answer, branched, branches_of
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import clusters_of, mean_and_deviation, t_quantile
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.laws.body_geometry import MOST_PARTS, BodyGeometry
from taichi_dem.laws.contact import BodyContact, SphereContact
from taichi_dem.laws.roles import LISTED
from taichi_dem.scene import Scene

#: Sources that ``solve`` measures when asked; chance and what is left out are always looked at.
MEASURED = ("step", "contact", "mesh")
#: Parts of an edge by which bodies meet that stand for the limit of spheres.
_FINE = 6
#: Share of all bodies that a run with all effects is compared with, at least.
_LEAST_AWAKE = 1e-3
#: Half-width by the mesh that half of all questions exceed, as a share of the value: where nothing
#: breaks, touches or slips, and elsewhere (docs/decisions/028-error-bars.md).
COMMON = {False: 0.008, True: 0.03}
#: Times that a run with four times the rays takes longer, about.
_RAYS = 4.0
#: Share of what is allowed below which a single twin is enough to know of chance.
NEGLIGIBLE = 0.25
#: Runs of which a spread is taken at first, and at most.
_FEW, MANY = 6, 96
#: Runs there must be of each end, on average, to call it one: more ends are a distribution.
_OF_EACH = 3


@dataclass(frozen=True)
class Beside:
    """Measures errors that no shorter step reduces, by runs at the coarsest level."""

    job: Job
    runs: Runs
    level: float
    report: Any
    affords: Callable[[float], bool]
    eventful: bool = False

    def sources(self) -> Iterator[Source]:
        """Sources that the scene has, measured where the question asks for them."""
        law = self.job.scene.effect("contact")
        if law is not None:
            yield self._contact(law)
        yield self._mesh()
        yield self._left_out()

    def _contact(self, law):
        if not self.report.pair_evaluations:
            return Source("contact", 0.0, "no bodies came near", 0.0)
        finer, share = finer_law(law)
        if finer is None:
            return Source("contact", math.nan, "not measured: no finer law is known")
        words = f"one run with parts={finer.geometry.parts}"
        if not self._measures("contact", _RAYS):
            return self._unmeasured("contact", words, _RAYS)
        values, seconds = self._values([with_contact(self.job.scene, finer)])
        error = share * abs(values[0] - self.runs.value(self.level)) if values else math.inf
        return Source("contact", error, words if values else f"{words} diverged", seconds)

    def _mesh(self):
        """Spread over meshes of one size: half-width for the value on one of them."""
        if not self._measures("mesh", len(self.job.meshes)):
            unknown = self._unmeasured("mesh", "give other meshes of this size", 2.0)
            common = COMMON[self.eventful] * abs(self.runs.value(self.level))
            return replace(unknown, common=common)
        count = f"{len(self.job.meshes) + 1} meshes"
        values, seconds = self._values(
            [replace(self.job.scene, mesh=mesh) for mesh in self.job.meshes]
        )
        if len(values) < len(self.job.meshes):
            return Source("mesh", math.inf, f"{count}, of which one diverged", seconds)
        spread = mean_and_deviation([self.runs.value(self.level), *values])[1]
        error = spread * t_quantile(self.job.confidence, len(values))
        return Source("mesh", error, f"spread over {count}", seconds)

    def _measures(self, name, runs):
        return name in self.job.sources and self.affords(runs)

    def _unmeasured(self, name, words, runs):
        seconds = runs * self.runs.cost[self.level]
        return Source(name, math.nan, f"not measured: {words}", seconds)

    def _values(self, scenes):
        """Values of scenes whose runs did not diverge, and the CPU time of all [s]."""
        values, seconds = [], 0.0
        self.runs.release()
        for scene in scenes:
            made = Runs(replace(self.job, scene=scene), self.runs.listen)
            # A scene that cannot begin raises instead.
            with contextlib.suppress(SimulationDiverged):
                values.append(made.value(self.level))
            seconds += made.seconds
            made.release()
        return [value for value in values if value is not None], seconds

    def _left_out(self):
        """What is left out where effects act on demand: nothing, or nobody knows how much."""
        found = self.report.certificate
        if found is None:
            return Source("left out", 0.0, "each listed effect acts in every step", 0.0)
        if found.holds:
            return Source("left out", 0.0, "the certificate holds", 0.0)
        words = "not measured: the certificate does not hold, effects='all' leaves nothing out"
        return Source("left out", math.nan, words, awake_price(self.runs, found))


def awake_price(runs: Runs, certificate: Any) -> float:
    """CPU time of the same runs with all bodies awake [s], about."""
    return runs.seconds / max(_LEAST_AWAKE, 1.0 - certificate.asleep)


def finer_law(law: Any) -> tuple[Any, float]:
    """A contact law of finer resolution, and the error of the given one over their difference."""
    # Rays converge with the second power of the parts of an edge; spheres do not converge to
    # bodies.
    geometry: Any = getattr(law, "geometry", None)
    if isinstance(geometry, BodyGeometry):
        parts = min(2 * geometry.parts, MOST_PARTS)
        if parts == geometry.parts:
            return None, math.nan
        made = copy.copy(law)
        made.geometry = BodyGeometry(parts, geometry.outer_faces, geometry.skin)
        return made, 1.0 / (1.0 - (geometry.parts / parts) ** 2)
    if isinstance(law, SphereContact):
        return BodyContact(_FINE, geometry.outer_faces), 1.0
    return None, math.nan


def with_contact(scene: Scene, law: Any) -> Scene:
    """The scene with another contact law."""
    if scene.effects.word == LISTED:
        effects = [law if one.role == law.role else one for one in scene.effects]
        return replace(scene, effects=effects)
    loads = [one for one in scene.loads if one.role != law.role]
    return replace(scene, effects=scene.effects.word, loads=[*loads, law])


class Twins:
    """Twins of the run at one level; parted: whether those of a level before differed too much."""

    def __init__(self, job: Job, runs: Runs, affords: Callable[[float, float], bool]):
        self.job, self.runs, self.affords = job, runs, affords
        self.count, self.level, self.parted = 0, 0.0, False

    def go_to(self, level: float) -> None:
        """Begin anew at a finer level: at the one before, twins may part by the step alone."""
        self.count, self.level, self.parted = 0, level, True

    def sample(self, level: float) -> list[float]:
        """Values of a run and its twins that did not diverge, as many as were asked for."""
        found = (self.runs.value(level, twin) for twin in range(self.count + 1))
        return [value for value in found if value is not None]

    def spread(self, levels: Sequence[float], allowed: float, is_last: bool) -> float:
        """Half-width by which runs that differ by chance spread, of one or of their mean."""
        # Twins cannot separate if half the step breaks the same faces and hardly moves bodies.
        averaged = self.job.goal.averaged
        if self.count == 0:
            if not averaged and not self.parted and self._is_calm(*levels[-2:]):
                return 0.0
            if not self.affords(1.0, self.level):
                return math.inf
            self.count = 1
        if self.count == 1 and not averaged and self.job.goal.kind != "count":
            here, twin = self.runs.value(self.level), self.runs.value(self.level, 1)
            apart = math.inf if twin is None else abs(twin - here)
            bar = t_quantile(self.job.confidence, 1) * apart
            if bar <= NEGLIGIBLE * allowed or (apart > allowed and not is_last):
                return bar
        if self.count < _FEW - 1 and self.affords(_FEW - 1.0 - self.count, self.level):
            self.count = _FEW - 1
        spread = self.deviation() * t_quantile(self.job.confidence, self.count)
        # Of a single value the truth is another one, as far from the mean.
        return spread / math.sqrt(self.count + 1) if averaged else math.sqrt(2.0) * spread

    def _is_calm(self, coarse, fine):
        """Whether half the step moves a usual body by little, and breaks the same faces."""
        change = self.runs.change(coarse, fine)
        little = change <= NEGLIGIBLE * self.job.tolerance
        return little and self.runs.same_breaks(coarse, fine)

    def deviation(self) -> float:
        """Standard deviation of single runs; infinite where one diverged."""
        found = self.sample(self.level)
        return mean_and_deviation(found)[1] if len(found) > self.count else math.inf

    def branched(self, made: Answer, allowed: float, step: float) -> Answer:
        """The answer with its branches, where twins have a few outcomes; else unchanged."""
        values = np.array(self.sample(self.level))
        clusters = clusters_of(values, 0.0, 0.5 * allowed)
        few = 2 <= len(clusters) <= len(values) // _OF_EACH
        if self.job.goal.averaged or not few:
            return made
        branches = branches_of(values, clusters, range(len(values)), step, 1.0)
        ends = "that differ by chance had {} outcomes"
        return branched(made, branches, made.parts.step, "run", ends)
