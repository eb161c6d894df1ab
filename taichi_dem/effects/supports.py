"""Supports: bodies with a face in a group are fixed, held on a plane, or moved as prescribed."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import taichi as ti

from taichi_dem.effects.base import Effect, Travel, along
from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import sine_and_cosine
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.fixed_order import length
from taichi_dem.kit.types import vec3
from taichi_dem.kit.validation import direction, positive, shown, word
from taichi_dem.materials import Material
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.physics.rotation import zero3

if TYPE_CHECKING:
    from taichi_dem.engine.capacity import Capacity
    from taichi_dem.engine.model import Model


@ti.data_oriented
class _Support(Effect):
    """Marks the bodies that have a face in a group."""

    role = "support"

    def __init__(self, group: str):
        self.group = word("group", group)

    def travel(self) -> Travel:
        """No displacement: the bodies are held."""
        return (0.0,) * 3, (0.0,) * 3

    def declare(self, capacity: "Capacity") -> None:
        """Marks of the supported bodies."""
        self.marked = ti.field(ti.i32, shape=capacity.bodies)

    def load(self, model: "Model") -> None:
        """Mark the supported bodies; InputError when the mesh has no such group."""
        body, _ = faces_of_group(model.mesh, model.topology, self.group)
        marks = np.zeros(model.body_count, dtype=np.int32)
        marks[body] = 1
        assign(self.marked, marks)

    @ti.func
    def acts_on(self, i):
        """1 for a supported body, else 0."""
        return self.marked[i]


@ti.data_oriented
class Fixed(_Support):
    """Bodies with a face in the group neither move nor turn."""

    name = "fixed"

    @ti.func
    def held(self, i, t, rotation, velocity, angular_momentum):
        """Zero velocity and angular momentum."""
        return zero3(), zero3()


@ti.data_oriented
class Roller(_Support):
    """Bodies with a face in the group slide on its plane and turn about its normal only.

    normal: of the plane; its length does not matter.
    """

    name = "roller"

    def __init__(self, group: str, normal: Sequence[float]):
        super().__init__(group)
        numbers = np.array(direction("normal", normal))
        if not length(numbers) > 0.0:
            raise InputError(f"normal must be longer than zero, got {shown(normal)}")
        self._normal = numbers / length(numbers)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Unit normal, three components."""
        return tuple(self._normal)

    @ti.func
    def held(self, i, t, rotation, velocity, angular_momentum):
        """Velocity within the plane, spin about its normal."""
        normal = vec3(self.law[0], self.law[1], self.law[2])
        axis = rotation.transpose() @ normal
        # The plane's moment is normal to its normal, so the component along it is unchanged.
        spin = angular_momentum.dot(normal) / axis.dot(self.tables.inertia[i] @ axis)
        kept = rotation @ (self.tables.inertia[i] @ (spin * axis))
        return velocity - velocity.dot(normal) * normal, kept


@ti.data_oriented
class PrescribedMotion(_Support):
    """Bodies with a face in the group move with a given velocity and do not turn.

    velocity [m/s]: v cos(2 pi frequency t); frequency [Hz], zero for a constant velocity.
    """

    name = "prescribed_motion"

    def __init__(self, group: str, velocity: Sequence[float], frequency: float = 0.0):
        super().__init__(group)
        self._velocity = direction("velocity", velocity)
        self._frequency = positive("frequency", frequency, zero_allowed=True)

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Velocity [m/s], three components, and angular frequency [rad/s]."""
        return (*self._velocity, 2.0 * math.pi * self._frequency)

    def travel(self) -> Travel:
        """As far as it swings, or without end along a constant velocity."""
        if not self._frequency:
            return along(self._velocity)
        swing = [abs(x) / (2.0 * math.pi * self._frequency) for x in self._velocity]
        return tuple(-x for x in swing), tuple(swing)

    @ti.func
    def held(self, i, t, rotation, velocity, angular_momentum):
        """The prescribed velocity at time t [s] and no spin."""
        amplitude = vec3(self.law[0], self.law[1], self.law[2])
        _, swing = sine_and_cosine(self.law[3] * t)
        return amplitude * swing, zero3()
