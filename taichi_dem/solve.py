"""Output of a scene to a tolerance: the program chooses method and step, and gives a bar."""

import math
from collections.abc import Iterable

from taichi_dem.accuracy.runs import Job
from taichi_dem.accuracy.search import Search
from taichi_dem.accuracy.sources import MEASURED
from taichi_dem.goals import Goal
from taichi_dem.kit.bars.answer import Answer, Plan
from taichi_dem.kit.bars.budget import named_sources
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import (
    AUTO,
    SMALLEST,
    between,
    instance,
    positive,
    several,
    whole,
)
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.scene import Scene


def solve(
    scene: Scene,
    *,
    until: float,
    goal: Goal,
    tolerance: float = 0.01,
    confidence: float = 0.95,
    budget_s: float | None = None,
    plan: Plan | None = None,
    sources: Iterable[str] = ("step",),
    meshes: Iterable[Mesh] | None = None,
    progress: Listener | str | None = AUTO,
) -> Answer:
    """Output of a scene at a time, with an error bar of the given width.

    Parameters
    ----------
    scene : Scene
        Scene.
    until : float
        Simulated time [s].
    goal : Goal
        Output, from ``taichi_dem.goals``.
    tolerance : float, default 0.01
        Largest half-width of the bar, as a share of the value, above 0 and at most 1.
    confidence : float, default 0.95
        Probability [-] with which the bar holds the true value, above 0 and below 1.
    budget_s : float, optional
        CPU time after which no run is begun [s]; None for no limit.
    plan : Plan, optional
        Plan of an answer for a similar scene: start at the steps that sufficed there.
    sources : iterable of str, default ("step",)
        Sources of error to measure and include in the bar: ``"step"``, always; ``"contact"``,
        against a contact law of finer resolution; ``"mesh"``, over other meshes. Others are named
        as not measured.
    meshes : iterable of Mesh, optional
        Other meshes of the same body and size, at least two, for the source ``"mesh"``.
    progress : callable or str or None, default "auto"
        As in ``simulate``.

    Returns
    -------
    Answer
        Value, error bar, its sources and cost; ``shortfall`` tells why a bar is too wide, and what
        would help.

    Raises
    ------
    SimulationDiverged
        No step is stable.

    Examples
    --------
    >>> wanted = goals.hole_displacement()
    >>> answer = solve(scene, until=1e-4, goal=wanted, tolerance=0.01)  # doctest: +SKIP
    >>> print(answer)  # doctest: +SKIP
    """
    instance("scene", scene, Scene)
    instance("goal", goal, Goal).check_scene(scene)
    positive("until", until)
    between("tolerance", tolerance, SMALLEST, 1.0)
    between("confidence", confidence, SMALLEST, math.nextafter(1.0, 0.0))
    budget = math.inf if budget_s is None else positive("budget_s", budget_s)
    first = 0 if plan is None else whole("begin of plan", instance("plan", plan, Plan).begin, 0, 99)
    named = named_sources(sources, MEASURED)
    others = () if meshes is None else several("meshes", meshes, _mesh)
    if ("mesh" in named) != bool(others) or len(others) == 1:
        raise InputError(
            "meshes must be two or more where sources name the mesh, and none elsewhere, "
            f"got {len(others)} and sources {', '.join(named)}"
        )
    job = Job(scene, until, goal, tolerance, confidence, named, others)
    with reporting(progress, goal.name) as report_progress:
        return Search(job, budget, report_progress, first).answer()


def _mesh(name, given):
    return instance(name, given, Mesh)
