"""Sources of error beside the step: the contact law, the mesh, effects left out."""

import contextlib
import copy
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import mean_and_deviation, t_quantile
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


@dataclass(frozen=True)
class Beside:
    """Measures errors that no shorter step reduces, by runs at the coarsest level."""

    runs: Any
    level: float
    report: Any
    affords: Callable[[float], bool]

    def sources(self, last: float) -> Iterator[Source]:
        """Sources that the scene has, measured where the question asks for them."""
        law = self._scene.effect("contact")
        if law is not None:
            yield self._contact(law)
        yield self._mesh(self.runs.eventful(last))
        yield self._left_out()

    @property
    def _scene(self):
        return self.runs.levels.scene

    def _contact(self, law):
        if not self.report.pair_evaluations:
            return Source("contact", 0.0, "no bodies came near", 0.0)
        finer, share = finer_law(law)
        if finer is None:
            return Source("contact", math.nan, "not measured: no finer law is known")
        words = f"one run with parts={finer.geometry.parts}"
        if not self._measures("contact", _RAYS):
            return self._unmeasured("contact", words, _RAYS)
        values, seconds = self._values([with_contact(self._scene, finer)])
        error = share * abs(values[0] - self.runs.value(self.level)) if values else math.inf
        return Source("contact", error, words if values else f"{words} diverged", seconds)

    def _mesh(self, eventful):
        """Spread over meshes of one size: half-width for the value on one of them."""
        if not self._measures("mesh", len(self.runs.meshes)):
            unknown = self._unmeasured("mesh", "give other meshes of this size", 2.0)
            common = COMMON[eventful] * abs(self.runs.value(self.level))
            return replace(unknown, common=common)
        count = f"{len(self.runs.meshes) + 1} meshes"
        values, seconds = self._values(
            [replace(self._scene, mesh=mesh) for mesh in self.runs.meshes]
        )
        if len(values) < len(self.runs.meshes):
            return Source("mesh", math.inf, f"{count}, of which one diverged", seconds)
        spread = mean_and_deviation([self.runs.value(self.level), *values])[1]
        error = spread * t_quantile(self.runs.question.confidence, len(values))
        return Source("mesh", error, f"spread over {count}", seconds)

    def _measures(self, name, runs):
        return name in self.runs.question.sources and self.affords(runs)

    def _unmeasured(self, name, words, runs):
        seconds = runs * self.runs.cost[self.level]
        return Source(name, math.nan, f"not measured: {words}", seconds)

    def _values(self, scenes):
        """Values of scenes whose runs did not diverge, and the CPU time of all [s]."""
        values, seconds = [], 0.0
        self.runs.release()
        for scene in scenes:
            runs = self.runs.of(scene)
            # A scene that cannot begin raises instead.
            with contextlib.suppress(SimulationDiverged):
                values.append(runs.value(self.level))
            seconds += runs.seconds
            runs.release()
        return [value for value in values if value is not None], seconds

    def _left_out(self):
        """What is left out where effects act on demand: nothing, or nobody knows how much."""
        certificate = self.report.certificate
        if certificate is None:
            return Source("left out", 0.0, "each listed effect acts in every step", 0.0)
        if certificate.holds:
            return Source("left out", 0.0, "the certificate holds", 0.0)
        words = "not measured: the certificate does not hold, effects='all' leaves nothing out"
        return Source("left out", math.nan, words, awake_price(self.runs, certificate))


def awake_price(runs: Any, certificate: Any) -> float:
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
        finer = copy.copy(law)
        finer.geometry = BodyGeometry(parts, geometry.outer_faces, geometry.skin)
        return finer, 1.0 / (1.0 - (geometry.parts / parts) ** 2)
    if isinstance(law, SphereContact):
        return BodyContact(_FINE, geometry.outer_faces), 1.0
    return None, math.nan


def with_contact(scene: Scene, law: Any) -> Scene:
    """The scene with another contact law."""
    if scene.effects.word == LISTED:
        effects = [law if effect.role == law.role else effect for effect in scene.effects]
        return replace(scene, effects=effects)
    loads = [effect for effect in scene.loads if effect.role != law.role]
    return replace(scene, effects=scene.effects.word, loads=[*loads, law])
