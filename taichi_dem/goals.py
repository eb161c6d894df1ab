"""Goals: outputs of a run that can be asked for with a tolerance, see ``solve``.

A user-defined goal takes one line; its function gets a ``Result`` with a frame at its end:

    fastest = Goal("fastest body", "m/s", lambda result: result.peak_speed.max(), "extreme")
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from taichi_dem.kit.bars.answer import BaseGoal
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, finite, flag, instance, shown, whole, word
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.output.fracture import fragment_of_body
from taichi_dem.output.hole_monitor import hole_of
from taichi_dem.report.energy_balance import TERMS, energy_put_in
from taichi_dem.result import Result
from taichi_dem.scene import Scene


@dataclass(frozen=True)
class Goal(BaseGoal):
    """Output of a run that can be asked for with a tolerance.

    Parameters
    ----------
    name : str
        Name of the output.
    unit : str
        Unit of the output, ``"1"`` for none.
    function : callable, optional
        Function of a Result with a frame at its end; returns a number.
    kind : str, default "value"
        ``"value"``: at the end. ``"extreme"``: over the run; Results then have a time series, and
        an extreme at its start, or that still grows at its end, is no answer. ``"count"``: a value
        that changes in steps, such as a whole number.
    averaged : bool, default False
        Whether the goal is the mean over runs that differ by chance, see ``mean``.
    check : callable or None, optional
        Function of a Scene that raises InputError where the goal needs what the scene lacks.
    """

    kinds: ClassVar[tuple[str, ...]] = ("value", "extreme", "count")
    given: ClassVar[str] = "Result"

    averaged: bool = False
    check: Callable[[Scene], Any] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        flag("averaged of a goal", self.averaged)
        if self.check is not None and not callable(self.check):
            raise InputError(
                f"check of a goal must be a function of a Scene or None, got {shown(self.check)}"
            )

    def mean(self) -> "Goal":
        """Return the goal of the mean over runs that differ by chance."""
        return replace(self, name=f"mean {self.name}", averaged=True)

    def check_scene(self, scene: Scene) -> None:
        """Refuse, before any run, a scene without what the goal needs.

        Parameters
        ----------
        scene : Scene
            Scene.
        """
        instance("scene", scene, Scene)
        if self.check is not None:
            self.check(scene)

    def value(self, result: Result) -> float:
        """Value in a result, in the unit of the goal.

        Parameters
        ----------
        result : Result
            Result with a frame at its end.
        """
        number: Any = self.function(instance("result", result, Result))
        single = isinstance(number, (np.ndarray, np.generic)) and number.size == 1
        value: Any = number.item() if single else number
        if not finite(value):
            raise InputError(
                f"function of the goal {self.name!r} must return a finite number, "
                f"got {shown(value)}"
            )
        return float(value)


def hole_displacement(group: str = "hole") -> Goal:
    """Mean displacement [mm] outward from the axis of a hole, of the bodies at its wall.

    Parameters
    ----------
    group : str, default "hole"
        Face group of the wall.
    """

    def found(result):
        monitor = hole_of(result.model, group)
        return 1e3 * monitor.radial_displacement(result.frames[-1].position)

    return Goal("hole displacement", "mm", found, check=_has_group(group))


def displacement(group: str) -> Goal:
    """Mean distance [mm] by which the bodies with a face in a group have moved.

    Parameters
    ----------
    group : str
        Face group.
    """

    def found(result):
        bodies, _ = faces_of_group(result.model.mesh, result.model.topology, group)
        return _mean_way(result, np.unique(bodies))

    return Goal(f"displacement of {group}", "mm", found, check=_has_group(group))


def body_displacement(body: int) -> Goal:
    """Distance [mm] by which a body has moved.

    Parameters
    ----------
    body : int
        Number of the body, from 0.
    """
    name, check = f"displacement of body {body}", _has_body(body)
    return Goal(name, "mm", lambda result: _mean_way(result, [body]), check=check)


def broken_faces() -> Goal:
    """Number of released bonds [-]."""
    return Goal("broken faces", "1", lambda result: result.report.broken_faces, "count")


def kinetic_energy() -> Goal:
    """Kinetic energy of all bodies [J]."""
    return Goal("kinetic energy", "J", lambda result: result.series["kinetic_J"][-1])


def peak_speed(body: int) -> Goal:
    """Largest speed of a body in the run [m/s]; shorter steps sample it more often.

    Parameters
    ----------
    body : int
        Number of the body, from 0.
    """
    name, check = f"peak speed of body {body}", _has_body(body)
    return Goal(name, "m/s", lambda result: result.peak_speed[body], "extreme", check=check)


def energy_share(term: str) -> Goal:
    """Term of the energy balance as a share [-] of the energy put in.

    Parameters
    ----------
    term : str
        Term of the energy balance, such as ``"friction"``.
    """
    choice("term", term, TERMS)

    def found(result):
        account = result.report.energy_balance
        given = energy_put_in(account)
        if given <= 0.0:
            raise InputError(
                f"an energy share must refer to energy put in above 0 J, got {given:.3g} J by "
                f"{result.report.until_s:.3g} s"
            )
        return account[term] / given

    return Goal(f"energy share of {term}", "1", found)


def largest_fragment() -> Goal:
    """Mass of the largest fragment, as a share [-] of the whole."""

    def found(result):
        mass = result.model.body_mass
        fragment = fragment_of_body(result.model, np.isfinite(result.broken_time))
        return np.bincount(fragment, mass).max() / mass.sum()

    return Goal("largest fragment", "1", found, "count")


def _mean_way(result, bodies):
    """Mean length of the displacements of some bodies at the end [mm]."""
    return 1e3 * np.linalg.norm(result.frames[-1].displacement[bodies], axis=1).mean()


def _has_group(group):
    """Check of a scene for a face group."""
    word("group", group)
    return lambda scene: scene.mesh.group_faces(group)


def _has_body(body):
    """Check of a scene for a body."""
    whole("body", body, 0, 2**31 - 1)
    return lambda scene: whole("body", body, 0, scene.mesh.body_count - 1)
