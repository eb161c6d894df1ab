"""Goals: outputs of a run that can be asked for with a tolerance, see ``solve``.

A goal of one's own takes a line; its function gets a ``Result`` with a frame at its end:

    fastest = Goal("fastest body", "m/s", lambda result: result.peak_speed.max())
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, shown, whole, word
from taichi_dem.mesh.tetrahedra import components
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.output.hole_monitor import HoleMonitor
from taichi_dem.result import Result

#: "value": at the end. "extreme": over the run. "count": a whole number.
KINDS = ("value", "extreme", "count")
#: Rows of the time series in which an extreme is looked for.
_ROWS = 100


@dataclass(frozen=True)
class Goal:
    """An output: its name, its unit ("1" for none), how a Result gives it, and one of KINDS.

    averaged: whether the mean over runs is asked for that differ by one rounding (``mean``).
    Raises InputError.
    """

    name: str
    unit: str
    function: Callable[[Result], float] = field(repr=False)
    kind: str = "value"
    averaged: bool = False

    def __post_init__(self) -> None:
        word("name of a goal", self.name)
        word("unit of a goal", self.unit)
        choice("kind of a goal", self.kind, KINDS)
        if not callable(self.function):
            raise InputError(
                f"function of a goal must be a function of a Result, got {shown(self.function)}"
            )

    @property
    def samples(self) -> int:
        """Rows of the time series that its Results need."""
        return _ROWS if self.kind == "extreme" else 1

    def mean(self) -> "Goal":
        """The mean of the same output over runs that differ by one rounding."""
        return replace(self, name=f"mean {self.name}", averaged=True)

    def value(self, result: Result) -> float:
        """Its value in a result. Raises InputError for a function that gives no number."""
        found = np.asarray(self.function(result))
        if found.shape != () or not np.isfinite(found):
            raise InputError(
                f"function of the goal {self.name!r} must return a finite number, "
                f"got {shown(found.tolist())}"
            )
        return float(found)


def hole_displacement(group: str = "hole") -> Goal:
    """Mean displacement outward from the axis of a hole, of the bodies at its wall [mm]."""

    def found(result):
        monitor = HoleMonitor(result.model, group)
        return 1e3 * monitor.radial_displacement(result.frames[-1].position)

    return Goal("hole displacement", "mm", found)


def displacement(group: str) -> Goal:
    """Mean distance by which the bodies with a face in a group have moved [mm]."""

    def found(result):
        bodies, _ = faces_of_group(result.model.mesh, result.model.topology, group)
        return _mean_way(result, np.unique(bodies))

    return Goal(f"displacement of {group}", "mm", found)


def body_displacement(body: int) -> Goal:
    """Distance by which a body has moved [mm]."""
    whole("body", body, 0, 2**31 - 1)
    return Goal(f"displacement of body {body}", "mm", lambda result: _mean_way(result, [body]))


def broken_faces() -> Goal:
    """Number of released bonds."""
    return Goal("broken faces", "1", lambda result: result.report.broken_faces, "count")


def kinetic_energy() -> Goal:
    """Kinetic energy of all bodies [J]."""
    return Goal("kinetic energy", "J", lambda result: result.history["kinetic_J"][-1])


def peak_speed(body: int) -> Goal:
    """Largest speed of a body at 100 times of the run [m/s]."""
    whole("body", body, 0, 2**31 - 1)
    name = f"peak speed of body {body}"
    return Goal(name, "m/s", lambda result: result.peak_speed[body], "extreme")


def energy_share(term: str) -> Goal:
    """Share of the work put in that a term of the energy balance has, such as "friction"."""

    def found(result):
        account = result.report.energy_balance
        choice("term", term, tuple(account))
        return account[term] / max(account["load_work"] + account["support_work"], 1e-300)

    return Goal(f"energy share of {term}", "1", found)


def largest_fragment() -> Goal:
    """Mass of the largest part that bonds still join, as a share of the whole."""

    def found(result):
        model, held = result.model, np.isnan(result.broken_time)
        bonds = np.stack([model.topology.master, model.topology.slave], axis=1)
        part = components(model.body_count, bonds[held])
        return np.bincount(part, model.body_mass).max() / model.body_mass.sum()

    return Goal("largest fragment", "1", found)


def _mean_way(result, bodies):
    """Mean length of the displacements of some bodies at the end [mm]."""
    return 1e3 * np.linalg.norm(result.frames[-1].displacement[bodies], axis=1).mean()
