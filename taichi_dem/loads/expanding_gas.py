"""Gas of a blast whose pressure falls as it opens its hole."""

from typing import Any

import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.kit.elementary import fifth_root
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.likely_units import EDGE, in_unit
from taichi_dem.kit.products import cross, dot, matvec, norm
from taichi_dem.kit.types import vec3
from taichi_dem.kit.validation import positive, shown
from taichi_dem.loads.pressure import GasPressure
from taichi_dem.materials import Material
from taichi_dem.state.capacity import Capacity
from taichi_dem.state.model import Model

#: Largest exponent, and how far a wall may close, in radii, before it closes no further.
_MOST_EXPONENT, _CLOSED = 5.0, -0.5


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
        Peak, rise, decay_ratio and start of a ``GasPressure``: the pressure over time if the walls
        stood still.

    Notes
    -----
    The volume is local: a face whose wall has moved by u along its normal, away from the gas, has a
    hole (1 + u / radius)^2 times as large. Gas does not flow along a hole, nor into cracks.
    """

    name = "expanding_gas"

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

    def load(self, model: Model) -> None:
        """Find the loaded faces; InputError when the mesh has no such group."""
        super().load(model)
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
