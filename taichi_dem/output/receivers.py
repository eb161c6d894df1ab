"""Receivers: velocity and displacement against time at points of the solid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_dem.kit.display import by_fields, in_brief
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.validation import FileName, direction, instance, shown, word
from taichi_dem.mesh.topology import body_at
from taichi_dem.observers import At, Every, RunView
from taichi_dem.scene import Scene


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

    Raises
    ------
    InputError
        A name or place is none.

    Notes
    -----
    ``result.receivers[name]`` holds what a run gave, a ``Received``, and ``result.write`` leaves
    receivers.csv. A resumed run gives what followed.

    Examples
    --------
    >>> Receivers({"far": (1.9, 1.0, 0.1)}, when=Every(time_s=1e-6)).points
    {'far': (1.9, 1.0, 0.1)}
    """

    def __init__(
        self,
        points: Mapping[str, Sequence[float]],
        when: Every | At | None = None,
    ):
        if not isinstance(points, Mapping) or not points:
            raise InputError(f"points must be a dict of name to (x, y, z), got {shown(points)}")
        self.points = {
            word("name of a receiver", name): direction(f"receiver {name}", point)
            for name, point in points.items()
        }
        self.when = Every(samples=1) if when is None else instance("when", when, (Every, At))
        self._bodies = np.zeros(0, dtype=np.int64)
        self._rows: list[tuple[float, np.ndarray]] = []

    def __repr__(self) -> str:
        return in_brief(self, ", ".join(self.points), repr(self.when))

    def check_scene(self, scene: Scene) -> None:
        """Find the bodies that hold the points, and forget an earlier run.

        Parameters
        ----------
        scene : Scene
            Scene of the run.

        Raises
        ------
        InputError
            A point is in no body of the mesh.
        """
        places = self.points.items()
        found = [body_at(scene.mesh, f"receiver {name}", np.array(at)) for name, at in places]
        self._bodies, self._rows = np.array(found), []

    def observe(self, view: RunView) -> None:
        """Keep displacements and velocities of the points.

        Parameters
        ----------
        view : RunView
            View of the run.
        """
        motion, bodies = view.motion(), self._bodies
        centre = view.model.centre[bodies]
        arm = np.array(list(self.points.values())) - centre
        turned = (motion["rotation"][bodies] * arm[:, None, :]).sum(axis=2)
        moved = (motion["position"][bodies] - centre) + (turned - arm)
        velocity = motion["velocity"][bodies] + np.cross(motion["spin"][bodies], turned)
        self._rows.append((view.time_s, np.stack([moved, velocity])))

    def received(self) -> dict[str, Received]:
        """Return what was kept so far.

        Returns
        -------
        dict
            A ``Received`` by the name of its receiver.
        """
        times = np.array([time_s for time_s, _ in self._rows])
        motion = np.array([motion for _, motion in self._rows]).reshape(-1, 2, len(self.points), 3)
        return {
            name: Received(at, int(self._bodies[k]), times, motion[:, 0, k], motion[:, 1, k])
            for k, (name, at) in enumerate(self.points.items())
        }


def write_receivers(path: FileName, receivers: Mapping[str, Received]) -> None:
    """Write a CSV row for each receiver and time; InputError when it cannot be written."""
    names = [np.full(len(one.time_s), name) for name, one in receivers.items()]
    times = [one.time_s for one in receivers.values()]
    columns = {"receiver": np.concatenate(names), "time_s": np.concatenate(times)}
    for letter, unit, kind in (("u", "m", "displacement"), ("v", "m_s", "velocity")):
        rows = np.vstack([getattr(one, kind) for one in receivers.values()])
        columns.update({f"{letter}{axis}_{unit}": rows[:, k] for k, axis in enumerate("xyz")})
    write_csv(path, columns)
