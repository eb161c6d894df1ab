"""Spheres in a container that moves as told, and what the tests ask of them."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from tests.driven import Driven


class Rig(Driven):
    """Spheres in containers that are driven as x = amplitude sin(2 pi f t), or stand still."""

    def __init__(self, options, particles, dt, seed=1, frequency=0.0, amplitude=0.0):
        super().__init__(options, particles, seed, dt, amplitude, frequency)

    def energy(self, s=0):
        return self.engine.asked(s)[0]

    def momentum(self, s=0):
        return self.engine.asked(s)[1]

    def divergence_code(self, s=0):
        return int(self.engine.asked(s)[2])

    def state(self, s=0):
        """Position and velocity of the spheres of a scene, (particles, 2) each."""
        shot = self.device.snapshot(s)
        return shot["position"], shot["velocity"]

    def states(self):
        """Position and velocity of all spheres there is room for, (scenes, capacity, 2) each."""
        bodies = self.device.bodies
        position, velocity = map(self._of_all, (bodies.position, bodies.velocity))
        ahead = self.in_use(bodies.lead)[:, None, None]
        shift = np.zeros((self.count, 1, 2))
        shift[:, 0, 0] = 0.5 * bodies.body[None].width
        shift[:, 0, 1] = -self.in_use(bodies.floor)
        return position - ahead * velocity + shift, velocity

    def _of_all(self, field):
        shape = (-1, self.device.bodies.stride, 2)
        return values(field).reshape(shape)[: self.count, : self.filling.capacity]

    def throw(self, velocity, s=0):
        """Give the spheres of a scene velocities [m/s], (particles, 2)."""
        bodies = self.device.bodies
        for k, v in enumerate(np.atleast_2d(velocity)):
            bodies.velocity[s * bodies.stride + k] = v

    def shift(self, distance, s=0):
        """Move all spheres of a scene by a distance (horizontal, vertical) [m]."""
        bodies = self.device.bodies
        for k in range(self.table.particles[s]):
            i = s * bodies.stride + k
            bodies.position[i] = bodies.position[i] + ti.Vector(distance)

    def mirror(self, s, to):
        """Give scene ``to`` the places and velocities of scene s, left and right exchanged."""
        bodies = self.device.bodies
        for k in range(self.table.particles[s]):
            source, target = s * bodies.stride + k, to * bodies.stride + k
            for field in (bodies.position, bodies.velocity):
                field[target] = ti.Vector([-field[source][0], field[source][1]])
