"""Output of a scene to a tolerance: the program chooses method and step, and gives a bar."""

from collections.abc import Iterable

from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.runs import Runs
from taichi_dem.accuracy.sources import MEASURED
from taichi_dem.goals import Goal
from taichi_dem.kit.bars.answer import Answer, Plan
from taichi_dem.kit.bars.runs import checked_question
from taichi_dem.kit.bars.search import Search
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, instance, positive, several, whole
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
        against finer rays of contact; ``"mesh"``, over other meshes. Others stay unmeasured.
    meshes : iterable of Mesh, optional
        Other meshes of the same body and size, at least two, for the source ``"mesh"``.
    progress : callable or str or None, default "auto"
        As in ``simulate``.

    Returns
    -------
    Answer
        Value, error bar, its sources and cost; ``shortfall`` tells why a bar is too wide.

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
    question = checked_question(
        *((goal,), MEASURED),
        tolerance=tolerance,
        confidence=confidence,
        budget_s=budget_s,
        sources=sources,
    )
    first = 0 if plan is None else whole("begin of plan", instance("plan", plan, Plan).begin, 0, 99)
    others = () if meshes is None else several("meshes", meshes, _mesh)
    if ("mesh" in question.sources) != bool(others) or len(others) == 1:
        raise InputError(
            "meshes must be two or more where sources name the mesh, and none elsewhere, "
            f"got {len(others)} and sources {', '.join(question.sources)}"
        )
    levels = Levels(scene, until, goal)
    with reporting(progress, goal.name) as listener:
        runs = Runs(levels, listener, question, others)
        return Search(question, runs, first).answers()[0]


def _mesh(name, given):
    return instance(name, given, Mesh)
