"""Motion along bars over time, slice by slice, and where they have broken."""

from typing import Any, Union

import numpy as np

from taichi_dem.observers import At, Every, RunView


class Profile:
    """Observer that keeps the mean motion of slices of bodies, and the joints between them.

    when: of its looks. slices: numbers of the bodies of every slice, (..., slices, bodies each),
    along one bar or several. axis: of the motion, 0 for x.

    Afterwards: time (looks,) [s]; displacement [m] and velocity [m/s] along the axis, (looks, ...,
    slices); joints: whether all bonds between a slice and the next have broken, (looks, ...,
    slices - 1), not so where no bond is.
    """

    def __init__(self, when: Union[Every, At], slices: Any, axis: int = 0):
        self.when, self.axis, self.slices = when, axis, np.asarray(slices)
        self._rows: list[tuple] = []

    def observe(self, view: RunView) -> None:
        """Keep all slices as they are now."""
        motion = view.motion()
        moved = (motion["position"] - view.model.centre, motion["velocity"])
        means = (vectors[self.slices, self.axis].mean(axis=-1) for vectors in moved)
        self._rows.append((view.time_s, *means, self._broken(view)))

    def __getattr__(self, name):
        names = ("time", "displacement", "velocity", "joints")
        if name not in names:
            raise AttributeError(f"Profile has no {name}")
        return np.array([row[names.index(name)] for row in self._rows])

    def stress(self, modulus: float, distance: float) -> np.ndarray:
        """Stress between a slice and the next [Pa], (looks, ..., slices - 1), tension positive.

        modulus [Pa] of the bar; distance [m] from slice to slice. Zero where the joint is broken.
        """
        strain = np.diff(self.displacement, axis=-1) / distance
        return np.where(self.joints, 0.0, modulus * strain)

    def _broken(self, view):
        shape, topology = self.slices.shape[:-1], view.model.topology
        count = int(np.prod(shape))
        owner = np.full(view.model.body_count, -1)
        owner[self.slices.reshape(count, -1)] = np.arange(count)[:, None]
        ends = np.sort(owner[np.stack([topology.master, topology.slave])], axis=0)
        between = (ends[0] >= 0) & (ends[1] - ends[0] == 1)
        bonds = np.bincount(ends[0, between], minlength=count)
        broken = np.bincount(ends[0, between & view.broken], minlength=count)
        return ((bonds > 0) & (broken == bonds)).reshape(shape)[..., :-1]


def travel_time(time_s: np.ndarray, first: np.ndarray, second: np.ndarray, step: float) -> float:
    """Time that a pulse takes from one record to another [s]: where they agree best.

    time_s: of both records, ascending from zero [s]. step: resolution of the result [s].
    """
    fine = np.arange(0.0, time_s[-1], step)
    early, late = (np.interp(fine, time_s, record) for record in (first, second))
    return float(np.correlate(late, early, mode="full")[len(fine) - 1 :].argmax() * step)
