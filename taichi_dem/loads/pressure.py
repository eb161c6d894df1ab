"""Weight, pressure on a group of outer faces, gas of a blast (Konno et al., eq. 4)."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import ArrayLike

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import fifth_root, sine_and_cosine, sine_shortfall
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import ACCELERATION, BLAST_RISE, EDGE, PRESSURE, in_unit
from taichi_dem.kit.products import cross, dot, matvec, norm
from taichi_dem.kit.types import vec3
from taichi_dem.kit.validation import direction, finite, positive, real_numbers, shown, word
from taichi_dem.laws.contracts import Load, Travel
from taichi_dem.loads.history import History, history_points, shortest_piece
from taichi_dem.materials import Material
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Capacity

#: Largest exponent, and how far a wall may close, in radii, before it closes no further.
_MOST_EXPONENT, _CLOSED = 5.0, -0.5


@ti.data_oriented
class Gravity(Load):
    """Uniform acceleration of all bodies.

    Parameters
    ----------
    acceleration : sequence of float, default (0.0, -9.81, 0.0)
        Acceleration along x, y and z [m/s^2].
    """

    order = 2

    def __init__(self, acceleration: Sequence[float] = (0.0, -9.81, 0.0)):
        self._acceleration = direction("acceleration", acceleration)
        in_unit("size of acceleration", math.hypot(*self._acceleration), ACCELERATION)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Acceleration [m/s^2], three components."""
        return self._acceleration

    def stress(self, material: Material, size: float) -> float:
        """Weight of a column as high as the block."""
        return material.density * size * sum(x * x for x in self._acceleration) ** 0.5

    def travel(self) -> Travel:
        """Without end along the acceleration."""
        low = tuple(-math.inf if x < 0.0 else 0.0 for x in self._acceleration)
        return low, tuple(math.inf if x > 0.0 else 0.0 for x in self._acceleration)

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m] on body i."""
        return self.tables.mass[i] * vec3(self.law[0], self.law[1], self.law[2]), vec3(0.0)


@ti.data_oriented
class FaceLoad(Load):
    """Base of loads on the faces of a group; the area stays the mesh's."""

    order = 2

    def declare(self, capacity: Capacity) -> None:
        """Loaded faces of every body: area vectors [m^2] and arms from the centre [m]."""
        self.first = ti.field(ti.i32, shape=capacity.bodies + 1)
        self.area = ti.Vector.field(3, ti.f64, shape=capacity.faces)
        self.arm = ti.Vector.field(3, ti.f64, shape=capacity.faces)

    def upload(self, model: Model) -> None:
        """Find the loaded faces; InputError when the mesh has no such group."""
        body, face = faces_of_group(model.mesh, model.topology, self.group)
        order = np.argsort(body, kind="stable")
        body = body[order]
        corners = face_vertices(model.mesh, body, face[order])
        assign(self.first, np.searchsorted(body, np.arange(model.body_count + 1)))
        assign(self.area, area_vectors(model.mesh.points, corners))
        assign(self.arm, model.mesh.points[corners].mean(axis=1) - model.centre[body])

    @ti.func
    def acts_on(self, i):
        """Nonzero for a body with a face in the group."""
        return self.first[i + 1] - self.first[i]


@ti.data_oriented
class FacePressure(FaceLoad):
    """Base of loads that push on the faces of a group along their current normal."""

    @abstractmethod
    def mean_pressure(self, since, until):
        """Mean pressure [Pa] from a time to a later one [s]."""

    @abstractmethod
    def changes(self, since, until):
        """Nonzero where the pressure changes between two times [s]."""

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m] on body i in a motion."""
        pressure = self.mean_pressure(motion.since, motion.until)
        force, torque = vec3(0.0), vec3(0.0)
        for k in range(self.first[i], self.first[i + 1]):
            push = -pressure * self.area[k]
            force += push
            torque += cross(self.arm[k], push)
        return matvec(motion.rotation, force), matvec(motion.rotation, torque)


@ti.data_oriented
class Pressure(FacePressure):
    """Pressure on the faces of a group along their current normal, also after they came loose.

    Parameters
    ----------
    group : str
        Group of outer faces, or of inner faces without bonds, whose sides are pushed apart.
    values : float or sequence of float
        Pressures [Pa] at the times: linear between them, constant before the first and after the
        last. Negative values pull. A single number is a constant pressure from time zero.
    times : sequence of float, default (0.0,)
        Times [s], ascending.
    """

    def __init__(self, group: str, values: object, times: object = (0.0,)):
        self.group = word("group", group)
        self.times, self.values = history_points(times, values)
        in_unit("largest of values", max(self.values, key=abs), PRESSURE)

    @classmethod
    def triangle(cls, group: str, peak: float, rise: float, fall: float) -> "Pressure":
        """Triangular pulse of pressure.

        Parameters
        ----------
        group : str
            Group of faces.
        peak : float
            Peak pressure [Pa]; negative ones pull.
        rise : float
            Time to the peak [s]; may be 0.
        fall : float
            Time from the peak to zero [s].
        """
        rise, fall = positive("rise", rise, zero_allowed=True), positive("fall", fall)
        if not finite(peak) or peak == 0.0:
            raise InputError(f"peak must be a finite number other than 0, got {shown(peak)}")
        times, values = [0.0, rise, rise + fall], [0.0, peak, 0.0]
        first = 0 if rise > 0.0 else 1
        return cls(group, values[first:], times[first:])

    def stress(self, material: Material, size: float) -> float:
        """The largest pressure."""
        return max(map(abs, self.values))

    def change_time(self) -> float:
        """Shortest time between two points of the history."""
        return shortest_piece(self.times, self.values)

    def declare(self, capacity: Capacity) -> None:
        """The loaded faces, and the history."""
        super().declare(capacity)
        self.history = History()

    def upload(self, model: Model) -> None:
        """Find the loaded faces and upload the history; InputError for an unknown group."""
        super().upload(model)
        self.history.upload(self.times, self.values)

    @ti.func
    def changes(self, since, until):
        """Nonzero where the pressure changes between two times [s]."""
        return self.history.changes(since, until)

    @ti.func
    def mean_pressure(self, since, until):
        """Mean pressure [Pa] from a time to a later one [s]."""
        return self.history.mean(since, until)


@ti.pyfunc
def pulse(peak, rise, decay_ratio, t):
    """Pressure [Pa] of eq. 4: a squared cosine up to the peak, a cosine down to zero."""
    pressure = 0.0
    s = t / rise - 1.0
    if 0.0 <= t and s <= 0.0:
        _, swing = sine_and_cosine(0.5 * math.pi * s)
        pressure = peak * (swing * swing)
    elif 0.0 < s and s <= decay_ratio:
        _, swing = sine_and_cosine(0.5 * math.pi * s / decay_ratio)
        pressure = peak * swing
    return pressure


@ti.func
def mean_pulse(peak, rise, decay_ratio, since, until):
    """Mean of ``pulse`` [Pa] from a time to a later one."""
    # Mean of a cosine: its middle value times sin(w) / w, w half the angle; no cancellation.
    end, mean = (1.0 + decay_ratio) * rise, 0.0
    low, high = ti.max(since, 0.0), ti.min(until, rise)
    if low < high:
        less = sine_shortfall(0.5 * math.pi * (high - low) / rise)
        middle = pulse(peak, rise, decay_ratio, 0.5 * (low + high))
        mean += (high - low) / (until - since) * (middle - less * (middle - 0.5 * peak))
    low, high = ti.max(since, rise), ti.min(until, end)
    if low < high:
        less = sine_shortfall(0.25 * math.pi * (high - low) / (decay_ratio * rise))
        middle = pulse(peak, rise, decay_ratio, 0.5 * (low + high))
        mean += (high - low) / (until - since) * (1.0 - less) * middle
    return mean


@ti.data_oriented
class GasPressure(FacePressure):
    """Pressure on the faces of a group along their current normal, also after they came loose.

    Parameters
    ----------
    group : str, default "hole"
        Name of the face group.
    peak : float, default 575000000.0
        Peak pressure [Pa].
    rise : float, default 0.000133
        Time to the peak [s].
    decay_ratio : float, default 2.75
        Ratio of the time from the peak to zero to the rise.
    start : float, default 0.0
        Time at which the pressure begins [s], such as for holes that fire one after the other.

    Notes
    -----
    The pressure is a squared cosine up to the peak, a cosine down to zero; areas are the mesh's.

    References
    ----------
    Konno et al., section 4.1, eq. 4, Fig. 11.
    """

    def __init__(
        self,
        group: str = "hole",
        peak: float = 575e6,
        rise: float = 1.33e-4,
        decay_ratio: float = 2.75,
        start: float = 0.0,
    ):
        self.group = word("group", group)
        self.peak = in_unit("peak", positive("peak", peak), PRESSURE)
        self.rise = in_unit("rise", positive("rise", rise), BLAST_RISE)
        self.decay_ratio = positive("decay_ratio", decay_ratio)
        self.start = positive("start", start, zero_allowed=True)

    @property
    def duration(self) -> float:
        """Time from its start until the pressure is zero [s]."""
        return (self.decay_ratio + 1.0) * self.rise

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Peak [Pa], rise [s], decay ratio and start [s]."""
        return self.peak, self.rise, self.decay_ratio, self.start

    def stress(self, material: Material, size: float) -> float:
        """The peak pressure."""
        return self.peak

    def change_time(self) -> float:
        """Time to the peak, or from there to zero."""
        return self.rise * min(1.0, self.decay_ratio)

    @ti.func
    def changes(self, since, until):
        """Nonzero where there is pressure between two times [s]."""
        end = self.law[3] + (1.0 + self.law[2]) * self.law[1]
        return since < end and self.law[3] < until

    @ti.func
    def mean_pressure(self, since, until):
        """Mean pressure [Pa] from a time to a later one [s]."""
        start = self.law[3]
        return mean_pulse(self.law[0], self.law[1], self.law[2], since - start, until - start)

    def pressure_at(self, times: ArrayLike) -> np.ndarray:
        """Pressure [Pa] at given times, for pictures.

        Parameters
        ----------
        times : array_like
            Times [s].
        """
        since = real_numbers("times", times) - self.start
        at = np.vectorize(pulse, otypes=[float])
        return at(self.peak, self.rise, self.decay_ratio, since)


@ti.data_oriented
class ExpandingGas(GasPressure):
    """Gas pressure in round holes that falls with the volume: p V^exponent stays constant.

    Parameters
    ----------
    group : str, default "hole"
        Face group of the walls.
    radius : float, default 0.025
        Radius of the holes [m].
    exponent : float, default 1.4
        Adiabatic exponent, a multiple of 0.2 up to 5.
    **pulse
        Peak, rise, decay_ratio, start of a ``GasPressure``: the pressure if the walls stood still.

    Notes
    -----
    The volume is local: a face whose wall has moved by u along its normal, away from the gas, has a
    hole (1 + u / radius)^2 times as large. Gas does not flow along a hole, nor into cracks.
    """

    def __init__(
        self, group: str = "hole", radius: float = 0.025, exponent: float = 1.4, **pulse: Any
    ):
        super().__init__(group, **pulse)
        self.radius = in_unit("radius", positive("radius", radius), EDGE)
        self.exponent = positive("exponent", exponent)
        fifths = round(5.0 * exponent)
        if self.exponent > _MOST_EXPONENT or abs(5.0 * self.exponent - fifths) > 1e-9:
            raise InputError(
                f"exponent must be a multiple of 0.2 up to {_MOST_EXPONENT:g}, got "
                f"{shown(exponent)}"
            )

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Those of the pulse, radius [m] and fifths of the exponent."""
        return *super().numbers(material), self.radius, 5.0 * self.exponent

    def declare(self, capacity: Capacity) -> None:
        """The loaded faces, and the place of each body at rest [m]."""
        super().declare(capacity)
        self.rest = ti.Vector.field(3, ti.f64, shape=capacity.bodies)

    def upload(self, model: Model) -> None:
        """Find the loaded faces; InputError when the mesh has no such group."""
        super().upload(model)
        assign(self.rest, model.centre)

    @ti.func
    def wrench(self, i, motion):
        """Force [N] and torque about the centre [N m] on body i in a motion."""
        still = self.mean_pressure(motion.since, motion.until)
        force, torque = vec3(0.0), vec3(0.0)
        for k in range(self.first[i], self.first[i + 1]):
            arm, area = matvec(motion.rotation, self.arm[k]), matvec(motion.rotation, self.area[k])
            moved = motion.position - self.rest[i] + (arm - self.arm[k])
            opened = -dot(moved, area) / norm(area)
            push = -still * self._fall(opened) * area
            force += push
            torque += cross(arm, push)
        return force, torque

    @ti.func
    def _fall(self, opened):
        """Pressure over that of a wall that stands still, of one that has opened [m]."""
        side = 1.0 + ti.max(opened / self.law[4], _CLOSED)
        root, fall = fifth_root(1.0 / (side * side)), 1.0
        for _ in range(ti.cast(self.law[5] + 0.5, ti.i32)):
            fall *= root
        return fall
