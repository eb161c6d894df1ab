"""Sources of error beside the step: resolution of the contact law, mesh, effects left out."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import mean_and_deviation, t_quantile
from taichi_dem.kit.errors import SimulationDiverged
from taichi_dem.laws.body_contact import MOST_PARTS, BodyContact
from taichi_dem.laws.roles import LISTED
from taichi_dem.laws.sphere_contact import SphereContact
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


@dataclass(frozen=True)
class Beside:
    """Measures errors that no shorter step reduces, by runs at the coarsest level.

    They are as large there, and cost least.
    """

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
        words = f"one run with BodyContact(parts={finer.parts})"
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


def finer_law(law: Any) -> tuple[BodyContact | None, float]:
    """A contact law of finer resolution, and the error of the given one over their difference."""
    # Rays converge with the second power of the parts of an edge; spheres do not converge to
    # bodies.
    if isinstance(law, BodyContact):
        parts = min(2 * law.parts, MOST_PARTS)
        if parts == law.parts:
            return None, math.nan
        same = law.outer_faces, law.restitution, law.stiffness
        lists = law.skin, law.neighbours_per_body, law.pairs_per_body
        return BodyContact(parts, *same, *lists), 1.0 / (1.0 - (law.parts / parts) ** 2)
    if isinstance(law, SphereContact):
        return BodyContact(_FINE, law.outer_faces), 1.0
    return None, math.nan


def with_contact(scene: Scene, law: Any) -> Scene:
    """The scene with another contact law."""
    if scene.effects.word == LISTED:
        effects = [law if one.role == law.role else one for one in scene.effects]
        return replace(scene, effects=effects)
    loads = [one for one in scene.loads if one.role != law.role]
    return replace(scene, effects=scene.effects.word, loads=[*loads, law])
