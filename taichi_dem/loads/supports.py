"""Supports: bodies fixed, held on a plane, or moved as prescribed; quiet boundaries."""

import math
from collections.abc import Sequence

import numpy as np
import taichi as ti

from taichi_dem.elasticity.rates import wave_moduli
from taichi_dem.kit import fixed_order
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length, product, transposed
from taichi_dem.kit.products import dot, matvec, squared, transposed_matvec
from taichi_dem.kit.types import mat3, real, vec3
from taichi_dem.kit.validation import direction, flag, positive, shown, unit_vector, word
from taichi_dem.laws.contracts import Ground, Support, Travel
from taichi_dem.loads.hinge import along_plane, check_alone, checked_hinge, hinge_arms, with_point
from taichi_dem.loads.history import History, history_points, shortest_piece
from taichi_dem.materials import Material
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.physics.wrench import Block
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Capacity

#: Sine of the angle below which two normals count as parallel.
_PARALLEL = 1e-6


@ti.data_oriented
class _Support(Support):
    """Marks the bodies that have a face in a group."""

    def __init__(self, group: str):
        self.group = word("group", group)

    def stress(self, material: Material, size: float) -> float:
        return 0.0

    def travel(self) -> Travel:
        return (0.0,) * 3, (0.0,) * 3

    def declare(self, capacity: Capacity) -> None:
        self.marked = ti.field(ti.i32, shape=capacity.bodies)

    def upload(self, model: Model) -> None:
        body, _ = faces_of_group(model.mesh, model.topology, self.group)
        marks = np.zeros(model.body_count, dtype=np.int32)
        marks[body] = 1
        assign(self.marked, marks)

    @ti.func
    def acts_on(self, i):
        return self.marked[i]


@ti.data_oriented
class _TurningSupport(_Support):
    """A support that may hold its bodies at points alone, about which they turn."""

    def __init__(self, group: str, turns: bool, about: object):
        super().__init__(group)
        self.turns = flag("turns", turns)
        self.about = checked_hinge(turns, about)

    def declare(self, capacity: Capacity) -> None:
        """Marks of the bodies, and from each centre to where it is held [m], body frame."""
        super().declare(capacity)
        if self.turns:
            self.arm = ti.Vector.field(3, ti.f64, shape=capacity.bodies)

    def upload(self, model: Model) -> None:
        """Mark the bodies and find where they are held; refuse bodies of other supports."""
        super().upload(model)
        if self.turns:
            check_alone(self, self._given, model)
            assign(self.arm, hinge_arms(model, self.group, self.about))


@ti.data_oriented
class Fixed(_Support):
    """Bodies with a face in the group neither move nor turn.

    Parameters
    ----------
    group : str
        Face group.
    """

    @ti.func
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """Zero velocity and angular momentum."""
        return vec3(0.0), vec3(0.0)


@ti.data_oriented
class Roller(_TurningSupport):
    """Bodies with a face in the group slide on its plane and turn about its normal only.

    A body on several planes slides along common directions, and turns only if all are parallel.

    Parameters
    ----------
    group : str
        Face group.
    normal : sequence of float
        Normal of the plane [-]; its length does not matter.
    turns : bool, default False
        Whether bodies turn freely, as on a knife edge: only a point of each keeps to the plane.
    about : sequence, optional
        With turns: a point, or two points of a line [m], where the bodies are held, each at the
        nearest point of the line. None: the middle line of the group, of a short one the middle.
    """

    def __init__(
        self, group: str, normal: Sequence[float], turns: bool = False, about: object = None
    ):
        super().__init__(group, turns, about)
        self._normal = unit_vector("normal", normal)

    def declare(self, capacity: Capacity) -> None:
        """Direction that each body may not move in, and whether it may turn about the normal."""
        super().declare(capacity)
        self.across = ti.Vector.field(3, ti.f64, shape=capacity.bodies)
        self.swivels = ti.field(ti.i32, shape=capacity.bodies)

    def upload(self, model: Model) -> None:
        """Share the directions that a body may not move in among the rollers that hold it."""
        super().upload(model)
        rollers = [effect for effect in model.supports if isinstance(effect, Roller)]
        shares: dict[tuple, np.ndarray] = {}
        # In an order of the planes, so that it does not depend on that of the scene.
        for plane in sorted({_upward(roller._normal) for roller in rollers}):
            rest = np.zeros((model.body_count, 3))
            for roller in rollers:
                if _upward(roller._normal) == plane:
                    rest[faces_of_group(model.mesh, model.topology, roller.group)[0]] = plane
            for other in shares.values():
                rest = rest - fixed_order.dot(rest, other)[:, None] * other
            size = fixed_order.length(rest)[:, None]
            # None is left where a plane is among those before it.
            shares[plane] = np.divide(rest, size, out=0.0 * rest, where=size > _PARALLEL)
        planes = sum(share.any(axis=1).astype(np.int32) for share in shares.values())
        assign(self.across, shares[_upward(self._normal)])
        assign(self.swivels, (planes == 1).astype(np.int32))

    @ti.func
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """Velocity within the plane, spin about its normal; turning, a point within the plane."""
        normal = self.across[i]
        kept = vec3(0.0)
        if ti.static(self.turns):
            arm = matvec(rotation, self.arm[i])
            velocity, kept = along_plane(
                self.tables, i, rotation, arm, normal, velocity, angular_momentum
            )
        else:
            if self.swivels[i] == 1:
                kept = angular_momentum
                if squared(normal) > 0.0:
                    axis = transposed_matvec(rotation, normal)
                    # The moment of the plane is normal to its normal: the component along it stays.
                    spin = dot(angular_momentum, normal) / dot(
                        axis, matvec(self.tables.inertia[i], axis)
                    )
                    kept = matvec(rotation, matvec(self.tables.inertia[i], spin * axis))
            velocity -= dot(velocity, normal) * normal
        return velocity, kept


def _upward(normal):
    """The later one of a normal and its opposite, in the order of their components."""
    return max(tuple(normal.tolist()), tuple((0.0 - normal).tolist()))


@ti.data_oriented
class PrescribedMotion(_TurningSupport):
    """Bodies with a face in the group move with a given velocity and do not turn.

    Parameters
    ----------
    group : str
        Face group.
    velocity : sequence of float
        Velocity v along x, y and z [m/s]; the bodies move with v cos(2 pi frequency t).
    frequency : float, default 0.0
        Frequency [Hz]; zero for a constant velocity.
    ramp : float, default 0.0
        Time in which the velocity rises linearly from zero [s].
    history : tuple of (sequence, sequence), optional
        (times [s], shares), in place of a ramp: the velocity is multiplied by the shares, linear
        between the times and constant before the first and after the last.
    turns : bool, default False
        Whether bodies turn freely: only a point of each has the velocity.
    about : sequence, optional
        With turns: where, as of a ``Roller``.
    """

    def __init__(
        self,
        group: str,
        velocity: Sequence[float],
        frequency: float = 0.0,
        ramp: float = 0.0,
        history: object = None,
        turns: bool = False,
        about: object = None,
    ):
        super().__init__(group, turns, about)
        self._velocity = direction("velocity", velocity)
        self._frequency = positive("frequency", frequency, zero_allowed=True)
        self._ramp = positive("ramp", ramp, zero_allowed=True)
        if history is not None and self._ramp:
            raise InputError(f"ramp must be 0 where there is a history, got {self._ramp:g}")
        self._points = _shares(self._ramp, history)
        self._history = self._points if history is not None else None

    def declare(self, capacity: Capacity) -> None:
        """Marks of the bodies, and the shares of the velocity."""
        super().declare(capacity)
        self.shares = History()

    def upload(self, model: Model) -> None:
        """Mark the bodies; InputError where another support asks for another motion."""
        super().upload(model)
        self.shares.upload(*self._points)
        mine = set(faces_of_group(model.mesh, model.topology, self.group)[0].tolist())
        for effect in model.supports:
            if _allows(effect, self):
                continue
            both = mine & set(faces_of_group(model.mesh, model.topology, effect.group)[0].tolist())
            if both:
                raise InputError(
                    f"group {self.group} of prescribed_motion must not share bodies with group "
                    f"{effect.group} of {effect.name}, which holds them differently, got body "
                    f"{min(both)} in both"
                )

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Velocity [m/s], three components, and angular frequency [rad/s]."""
        return (*self._velocity, 2.0 * math.pi * self._frequency)

    def change_time(self) -> float:
        """Shortest time between two points of the history, or half a period."""
        half = 0.5 / self._frequency if self._frequency else math.inf
        return min(half, shortest_piece(*self._points)) if any(self._velocity) else math.inf

    def travel(self) -> Travel:
        """As far as it swings, or without end along a constant velocity."""
        times, shares = (np.array(points) for points in self._points)
        if not self._frequency:
            back, on = _reach(times, shares)
            paths = [sorted((x * back, x * on)) if x else (0.0, 0.0) for x in self._velocity]
            return tuple(path[0] for path in paths), tuple(path[1] for path in paths)
        # By parts: |integral of s cos| is at most (|s| + the variation of s) / (angular frequency).
        most = np.abs(shares).max() + np.abs(np.diff(shares)).sum()
        swing = [most * abs(x) / (2.0 * math.pi * self._frequency) for x in self._velocity]
        return tuple(-x for x in swing), tuple(swing)

    @ti.func
    def held(self, i, t, step, rotation, velocity, angular_momentum):
        """The prescribed velocity, its shares as a mean over the step; no spin unless it turns."""
        amplitude = vec3(self.law[0], self.law[1], self.law[2])
        _, swing = sine_and_cosine(self.law[3] * t)
        wanted = amplitude * swing * self.shares.mean(t - 0.5 * step, t + 0.5 * step)
        momentum = vec3(0.0)
        if ti.static(self.turns):
            arm = matvec(rotation, self.arm[i])
            wanted, momentum = with_point(
                self.tables, i, rotation, arm, wanted, velocity, angular_momentum
            )
        return wanted, momentum


def _shares(ramp, history):
    """Points of the history of a velocity: times [s] and shares of it."""
    if history is None:
        return history_points(*(((0.0, ramp), (0.0, 1.0)) if ramp else ((0.0,), (1.0,))))
    try:
        times, shares = history
        return history_points(times, shares)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"history must be a pair of times and shares, got {shown(history)}: {error}"
        ) from None


def _reach(times, shares):
    """Lowest and highest integral of shares over time [s], from zero to any time."""
    parts = 0.5 * (shares[1:] + shares[:-1]) * np.diff(times)
    ends = np.array([0.0, *np.cumsum([shares[0] * times[0], *parts])])
    # Where the share changes sign within a part, the integral turns between its ends.
    turning = shares[1:] * shares[:-1] < 0.0
    turns = (np.abs(shares).max() * np.diff(times))[turning].sum()
    low, high = ends.min() - turns, ends.max() + turns
    return low if shares[-1] >= 0.0 else -np.inf, high if shares[-1] <= 0.0 else np.inf


def _allows(effect, motion):
    """Whether a support of the package allows a prescribed motion."""
    velocity = motion._velocity
    if isinstance(effect, Fixed):
        return not any(velocity)
    if isinstance(effect, Roller):
        return sum(a * b for a, b in zip(effect._normal.tolist(), velocity)) == 0.0
    if isinstance(effect, PrescribedMotion):
        mine, theirs = (
            (tuple(support._velocity), support._frequency, support._points)
            for support in (motion, effect)
        )
        return mine == theirs or not any((*velocity, *effect._velocity))
    return True


@ti.data_oriented
class QuietBoundary(Ground):
    """Dashpots between the faces of a group and the ground, which reflect little of a wave.

    Parameters
    ----------
    group : str
        Group of outer faces.
    p_speed : float, optional
        Speed of compression waves [m/s]; None: that of nearby bonds (``wave_moduli``).
    s_speed : float, optional
        Speed of shear waves [m/s]; None likewise.

    Notes
    -----
    Tractions of rho c_p v along the normal of a face and rho c_s v across it, v the velocity of the
    face, are those of a wave that goes on: a wave that meets the face at right angles is absorbed,
    an oblique one partly reflected. Displacements must be small: normals and arms are the mesh's.

    References
    ----------
    Lysmer and Kuhlemeyer, J. Eng. Mech. Div. ASCE 95(EM4), 1969, 859-877, eq. 1 and 2.
    """

    def __init__(self, group: str, p_speed: float | None = None, s_speed: float | None = None):
        self.group = word("group", group)
        self.p_speed = None if p_speed is None else positive("p_speed", p_speed)
        self.s_speed = None if s_speed is None else positive("s_speed", s_speed)

    def declare(self, capacity: Capacity) -> None:
        """Faces of every body in the group, and what resists it: the parts of a ``Block``."""
        # One field of 27 numbers, as Taichi has room for about a thousand components.
        self.faces = ti.field(ti.i32, shape=capacity.bodies)
        self.parts = ti.field(real, shape=(capacity.bodies, 27))

    def upload(self, model: Model) -> None:
        """Find the faces and their impedance; InputError when the mesh has no such group."""
        body, face = faces_of_group(model.mesh, model.topology, self.group)
        corners = face_vertices(model.mesh, body, face)
        vector = area_vectors(model.mesh.points, corners)
        area = length(vector)
        normal = vector / area[:, None]
        density = np.broadcast_to(model.materials.density, model.body_count)[body]
        out = normal[:, :, None] * normal[:, None, :]
        along, across = (
            (area / 3.0 * density * speed)[:, None, None]
            for speed in self._speeds(model, corners, density)
        )
        laws = along * out + across * (np.eye(3) - out)
        assign(self.faces, np.bincount(body, minlength=model.body_count))
        # The dashpots at the three points of every face, [[a, b], [b^T, c]] as of ``point_block``.
        arms = model.mesh.points[corners] - model.centre[body][:, None]
        law = np.repeat(laws[:, None], 3, axis=1)
        lever_arm = np.swapaxes(np.cross(arms[:, :, None], np.eye(3)), -1, -2)
        lever = product(law, lever_arm)
        blocks = law, -lever, product(transposed(lever_arm), lever)
        total = np.zeros((model.body_count, 3, 3, 3))
        for k, block in enumerate(blocks):
            np.add.at(total[:, k], np.repeat(body, 3), block.reshape(-1, 3, 3))
        assign(self.parts, total.reshape(-1, 27))

    def _speeds(self, model, corners, density):
        """Speeds of both waves at each face [m/s]."""
        speeds = []
        for name, modulus in zip(("p_speed", "s_speed"), wave_moduli(model, corners)):
            speed = np.sqrt(modulus / density)
            given = getattr(self, name)
            if given is None and not np.isfinite(speed).all():
                raise InputError(
                    f"{name} of quiet_boundary must be given where no bond is near a face of "
                    f"group {self.group}, got None"
                )
            speeds.append(speed if given is None else np.full(len(speed), given))
        return speeds

    @ti.func
    def acts_on(self, i):
        """Nonzero for a body with a face in the group."""
        return self.faces[i]

    @ti.func
    def resistance(self, i):
        """Dashpots at the three points of each face of body i, as a ``Block``."""
        return Block(a=self._part(i, 0), b=self._part(i, 9), c=self._part(i, 18))

    @ti.func
    def _part(self, i, first):
        """A matrix of body i, by rows from an entry on."""
        part = mat3(0.0)
        for r, c in ti.static(ti.ndrange(3, 3)):
            part[r, c] = self.parts[i, first + 3 * r + c]
        return part
