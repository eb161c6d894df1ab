"""Rotation of the spheres, an effect that the paper leaves out."""

import numpy as np
import taichi as ti

from ca_damper.spheres.bodies import SphereBodies
from taichi_dem.kit.allocation import values


@ti.data_oriented
class Rotation:
    """Turning of solid spheres in the plane, of moment of inertia 2/5 m r^2; or no trace of it."""

    def __init__(self, bodies: SphereBodies, turns: bool):
        self.bodies, self.turns = bodies, turns
        # An impulse on a solid sphere's surface moves it like 1 / (1 + 5/2) of its mass.
        self.tangential_share = 2.0 / 7.0 if turns else 1.0
        if turns:
            self.spin = bodies.table.field(ti.f64, "spheres", flat=True)
            self.torque = bodies.table.field(ti.f64, "spheres", flat=True)

    @ti.func
    def reset(self, i):
        """At rest."""
        if ti.static(self.turns):
            self.spin[i], self.torque[i] = 0.0, 0.0

    @ti.func
    def share(self, s, i, j):
        """Share of the distance of two spheres that lies on the side of the first."""
        share = 0.5
        if ti.static(self.bodies.kinds > 1):
            own = self.bodies.radius(s, i)
            share = own / (own + self.bodies.radius(s, j))
        return share

    @ti.func
    def turning(self, s, i, j):
        """Slip of two spheres by their spins over their distance [1/s]."""
        share = self.share(s, i, j)
        return share * self.spin[i] + (1.0 - share) * self.spin[j]

    @ti.func
    def slip_of_pair(self, s, i, j, distance, slip):
        """Slip [m/s] of two spheres whose centres are a distance [m] apart."""
        if ti.static(self.turns):
            return slip + distance * self.turning(s, i, j)
        return slip

    @ti.func
    def slip_at_wall(self, i, lever, slip):
        """Slip [m/s] of a sphere at a wall that is a lever [m] from its centre."""
        if ti.static(self.turns):
            return slip + lever * self.spin[i]
        return slip

    @ti.func
    def twist(self, i, torque):
        """Add a torque [N m] on sphere i."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        if ti.static(self.turns):
            self.torque[i] = self.torque[i] + torque

    @ti.func
    def kick(self, s, i, dt):
        """Change the spin of sphere i by its torques over a step [s]."""
        if ti.static(self.turns):
            self.spin[i] = self.spin[i] + dt * self.torque[i] / self._inertia(s, i)
            self.torque[i] = 0.0

    @ti.func
    def energy(self, s, i):
        """Energy [J] of the turning."""
        if ti.static(self.turns):
            return 0.5 * self._inertia(s, i) * self.spin[i] * self.spin[i]
        return 0.0

    @ti.func
    def _inertia(self, s, i):
        radius = self.bodies.radius(s, i)
        return 0.4 * self.bodies.mass(s, i) * radius * radius

    def snapshot(self, rows: slice) -> dict[str, np.ndarray]:
        """Spins [rad/s] of some spheres, where they turn."""
        return {"spin": values(self.spin)[rows]} if self.turns else {}
