"""Observers of a run, called with a view of it; receivers of motion at points of the solid."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from taichi_dem.kit.data_table import locked
from taichi_dem.kit.display import by_fields
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.validation import (
    FileName,
    direction,
    instance,
    plain_fields,
    positive,
    shown,
    told_apart,
    whole,
    word,
)
from taichi_dem.mesh.topology import body_at
from taichi_dem.methods import Method
from taichi_dem.output.record import Frame, Recorder
from taichi_dem.report.report import Report
from taichi_dem.scene import Scene
from taichi_dem.simulation import MOST_STEPS, Simulation
from taichi_dem.state.model import Model

#: Samples, frames and calls of an observer in a run, at most.
MOST_CALLS = 1_000_000


def macro_steps(until: float, dt0: float) -> int:
    """Number of largest steps that reach a time [s]; InputError unless it can be counted to."""
    steps = positive("until", until) / dt0
    if steps > MOST_STEPS:
        got, most = told_apart(until, MOST_STEPS * dt0)
        raise InputError(
            f"until must be at most {most} s, {MOST_STEPS} largest steps of {dt0:g} s, got {got}"
        )
    return max(1, math.ceil(steps - 1e-9))


@dataclass(frozen=True)
class Every:
    """Calls of an observer at even intervals, and at the start and the end of the run.

    One of the four is given.

    Parameters
    ----------
    time_s : float, optional
        Simulated time between calls, each at the nearest largest step [s].
    steps : int, optional
        Number of largest steps between calls.
    samples : int, optional
        Number of rows of the time series between calls.
    wall_s : float, optional
        Wall time between calls [s], between any two steps; bodies may then be at different times.

    Examples
    --------
    >>> sorted(Every(steps=2).marks(last=5, dt=1e-7))
    [0, 2, 4, 5]
    """

    time_s: float | None = None
    steps: int | None = None
    samples: int | None = None
    wall_s: float | None = None

    def __post_init__(self):
        plain_fields(self)
        given = [name for name, value in vars(self).items() if value is not None]
        if len(given) != 1:
            words = " and ".join(given) or "none"
            raise InputError(
                f"Every must be given one of time_s, steps, samples, wall_s, got {words}"
            )
        value = getattr(self, given[0])
        if given[0] in ("steps", "samples"):
            whole(given[0], value, 1, MOST_STEPS)
        else:
            positive(given[0], value)

    def marks(self, last: int, dt: float, samples: int = 1) -> set:
        """Largest steps at which to call, from 0 to ``last``; samples: rows after the first."""
        if self.wall_s is not None:
            return {last}
        if self.samples is not None:
            return {round(last * k / samples) for k in range(0, samples, self.samples)} | {last}
        name, unit = ("steps", 1.0) if self.time_s is None else ("time_s", dt)
        distance = (self.time_s or float(self.steps or 1)) / unit
        if last > MOST_CALLS * distance:
            least = last * unit / MOST_CALLS
            got, bound = told_apart(distance * unit, least)
            raise InputError(f"{name} must be at least {bound} for {MOST_CALLS} calls, got {got}")
        count = math.floor(last / distance * (1.0 + 1e-12))
        return {min(last, round(k * distance)) for k in range(count + 1)} | {last}


@dataclass(frozen=True)
class At:
    """Calls of an observer at chosen times, each at the nearest largest step.

    Parameters
    ----------
    times_s : sequence of float
        Times [s].
    """

    times_s: tuple

    #: Not among the options: none of the calls comes by the clock.
    wall_s: ClassVar[None] = None

    def __post_init__(self):
        plain_fields(self)
        listed = hasattr(self.times_s, "__iter__") and getattr(self.times_s, "ndim", 1) == 1
        if isinstance(self.times_s, (str, bytes, dict, set)) or not listed:
            raise InputError(f"times_s must be a sequence of times in s, got {shown(self.times_s)}")
        checked = tuple(positive("times_s", time, zero_allowed=True) for time in self.times_s)
        object.__setattr__(self, "times_s", checked)

    def marks(self, last: int, dt: float, samples: int = 1) -> set:
        """Largest steps at which to call, a set from 0 to ``last``."""
        for time in self.times_s:
            if round(time / dt) > last:
                got, most = told_apart(time, last * dt)
                raise InputError(f"times_s must lie in [0, {most}] s, got {got}")
        return {round(time / dt) for time in self.times_s}


class Observer(Protocol):
    """Measurement during a run: the property ``when`` and the method ``observe``.

    It may also have a method ``check_scene(scene)``, which is called before anything is compiled,
    and raises InputError where the scene lacks what is observed.

    Examples
    --------
    >>> class Watch:
    ...     when = Every(time_s=1e-5)
    ...
    ...     def observe(self, view):
    ...         print(view.time_s, abs(view.motion()["velocity"]).max())
    """

    @property
    def when(self) -> Every | At:
        """Times of the calls."""

    def observe(self, view: "RunView") -> None:
        """Measure; an exception here ends the run, and no result is written."""


class Collector:
    """Observer that keeps values of functions of the view, in lists by name.

    Parameters
    ----------
    when : Every or At
        Times of its calls.
    **read : callable
        Functions of a RunView by name.

    Attributes
    ----------
    rows : dict of list
        Values by name; ``collector[name]`` is an array of them.
    view : RunView or None
        View of the last call, also of a run that diverged.

    Examples
    --------
    >>> cost = Collector(Every(samples=10), cpu=lambda view: view.cpu_seconds)
    >>> list(cost.rows)
    ['cpu']
    """

    def __init__(self, when: Every | At, **read: Callable[["RunView"], Any]):
        self.when, self.read = instance("when", when, (Every, At)), read
        for name, function in read.items():
            if not callable(function):
                raise InputError(f"{name} must be a function of a RunView, got {shown(function)}")
        self.rows: dict[str, list] = {name: [] for name in read}
        self.view: RunView | None = None

    def observe(self, view: "RunView") -> None:
        """Keep a value of every function."""
        self.view = view
        for name, read in self.read.items():
            self.rows[name].append(read(view))

    def __getitem__(self, name: str) -> np.ndarray:
        return np.array(self.rows[name])

    def __getstate__(self) -> dict:
        """All but the view, which belongs to a session."""
        return {**vars(self), "view": None}


def _read(name, words) -> Any:
    """A member of the simulation of a view, as a property."""
    return property(lambda view: getattr(view._simulation, name), doc=words)


class RunView:
    """Read-only view of a run at its present step.

    An observer gets it. Arrays are copies that refuse to be written.

    Parameters
    ----------
    simulation : Simulation
        Simulation that runs.
    recorder : Recorder
        Recorder of its samples and frames.
    """

    def __init__(self, simulation: Simulation, recorder: Recorder):
        self._simulation, self._recorder = simulation, recorder

    time_s: float = _read("time_s", "Present time [s].")
    step: int = _read("macro_step", "Number of largest steps done.")
    model: Model = _read("model", "Constants of the bodies and bonds, as arrays.")
    method: Method = _read("method", "Method that steps.")
    cpu_seconds: float = _read("run_cpu_seconds", "CPU time spent stepping so far [s].")
    wall_seconds: float = _read("run_seconds", "Wall time spent stepping so far [s].")

    @property
    def broken(self) -> np.ndarray:
        """Whether each bond has been released, (bond_count,)."""
        return locked(self._simulation.state.broken())

    @property
    def peak_speed(self) -> np.ndarray:
        """Largest speed of each body at the samples so far [m/s], (body_count,)."""
        return locked(self._recorder.peak_speed)

    @property
    def evaluations(self) -> int:
        """Bonds and contact pairs evaluated so far."""
        return self._simulation.evaluations()

    def motion(self) -> dict:
        """Motion of the bodies by name, as in ``State.motion``: position [m], velocity, ..."""
        return {name: locked(array) for name, array in self._simulation.motion().items()}

    def energy_balance(self) -> dict:
        """Terms of the energy balance by name [J]."""
        return self._simulation.energy_balance.account()

    def frame(self) -> Frame:
        """Snapshot of the block."""
        return self._recorder.frame()

    def report(self) -> Report:
        """Report of the run so far."""
        return self._simulation.report()

    def history(self) -> dict:
        """Samples so far; one at this step is among them."""
        return {name: locked(array) for name, array in self._recorder.history().items()}


@dataclass(frozen=True, eq=False)
class Received:
    """Motion of a point over time.

    Parameters
    ----------
    point : tuple of float
        Place at the start [m], (3,).
    body : int
        Number of the body that holds it.
    time_s : ndarray
        Times [s], (k,).
    displacement : ndarray
        Displacements [m], (k, 3).
    velocity : ndarray
        Velocities [m/s], (k, 3).
    """

    point: tuple[float, ...]
    body: int
    time_s: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray

    __repr__ = by_fields


class Receivers:
    """Observer that keeps the motion of points of the solid.

    A point moves with the body that holds it at the start, as a point of that rigid body.

    Parameters
    ----------
    points : mapping
        Place (x, y, z) of each receiver at the start [m], by its name.
    when : Every or At, optional
        Times of the readings; those of the time series by default.

    Notes
    -----
    ``result.receivers[name]`` is a ``Received``, and ``result.write`` writes receivers.csv. A
    resumed run has only what followed.
    """

    def __init__(self, points: Mapping[str, Sequence[float]], when: Every | At | None = None):
        if not isinstance(points, Mapping) or not points:
            raise InputError(f"points must be a dict of name to (x, y, z), got {shown(points)}")
        self.points = {
            word("name of a receiver", name): direction(f"receiver {name}", point)
            for name, point in points.items()
        }
        self.when = Every(samples=1) if when is None else instance("when", when, (Every, At))
        self._bodies = np.zeros(0, dtype=np.int64)
        self._rows: list[tuple[float, np.ndarray]] = []

    def check_scene(self, scene: Scene) -> None:
        """Find the bodies that hold the points, and forget an earlier run."""
        places = self.points.items()
        bodies = [body_at(scene.mesh, f"receiver {name}", np.array(at)) for name, at in places]
        self._bodies, self._rows = np.array(bodies), []

    def observe(self, view: RunView) -> None:
        """Keep displacements and velocities of the points."""
        motion, bodies = view.motion(), self._bodies
        centre = view.model.centre[bodies]
        arm = np.array(list(self.points.values())) - centre
        turned = (motion["rotation"][bodies] * arm[:, None, :]).sum(axis=2)
        moved = (motion["position"][bodies] - centre) + (turned - arm)
        velocity = motion["velocity"][bodies] + np.cross(motion["spin"][bodies], turned)
        self._rows.append((view.time_s, np.stack([moved, velocity])))

    def received(self) -> dict[str, Received]:
        """What was kept so far, a ``Received`` by the name of its receiver."""
        times = np.array([time_s for time_s, _ in self._rows])
        motion = np.array([motion for _, motion in self._rows]).reshape(-1, 2, len(self.points), 3)
        return {
            name: Received(at, int(self._bodies[k]), times, motion[:, 0, k], motion[:, 1, k])
            for k, (name, at) in enumerate(self.points.items())
        }


def peak_velocities(
    receivers: Mapping[str, Received], source: np.ndarray, charge: float
) -> dict[str, np.ndarray]:
    """Columns of ``Result.peak_velocities``."""
    away = np.linalg.norm([np.subtract(r.point, source) for r in receivers.values()], axis=1)
    order = np.argsort(away, kind="stable")
    speed = [np.linalg.norm(receiver.velocity, axis=1).max() for receiver in receivers.values()]
    parts = np.array([np.abs(receiver.velocity).max(axis=0) for receiver in receivers.values()])
    return {
        "receiver": np.array(list(receivers))[order],
        "distance_m": away[order],
        "scaled_distance_m_kg05": away[order] / np.sqrt(charge),
        "peak_m_s": np.array(speed)[order],
        **{f"peak_{axis}_m_s": parts[order, k] for k, axis in enumerate("xyz")},
    }


def write_receivers(path: FileName, receivers: Mapping[str, Received]) -> None:
    """Write a CSV row for each receiver and time; InputError when it cannot be written."""
    names = [np.full(len(receiver.time_s), name) for name, receiver in receivers.items()]
    times = [receiver.time_s for receiver in receivers.values()]
    columns = {"receiver": np.concatenate(names), "time_s": np.concatenate(times)}
    for letter, unit, kind in (("u", "m", "displacement"), ("v", "m_s", "velocity")):
        rows = np.vstack([getattr(receiver, kind) for receiver in receivers.values()])
        columns.update({f"{letter}{axis}_{unit}": rows[:, k] for k, axis in enumerate("xyz")})
    write_csv(path, columns)


def checked_observers(observers: object) -> Sequence[Any]:
    """Observers as a tuple; InputError for one without a member, or with a wrong one."""
    if not isinstance(observers, (list, tuple)):
        raise InputError(f"observers must be a list of observers, got {shown(observers)}")
    for place, observer in enumerate(observers):
        timed = isinstance(getattr(observer, "when", None), (Every, At))
        if isinstance(observer, type) or not (
            timed and callable(getattr(observer, "observe", None))
        ):
            raise InputError(
                f"observers[{place}] must have a member when, an Every or an At, and a method "
                f"observe(view), got {shown(observer)}"
            )
    return observers


def receivers_among(observers: Sequence[Any]) -> list[Receivers]:
    """Receivers among observers; InputError where two have one name."""
    receivers = [observer for observer in observers if isinstance(observer, Receivers)]
    names = [name for observer in receivers for name in observer.points]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"observers must have receivers of different names, got {twice[0]} twice")
    return receivers
