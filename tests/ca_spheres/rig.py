"""Spheres in a container that moves as told, and what the tests ask of them."""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import values
from tests.driven import Driven


def put(device, places, velocities, s=0):
    """Give the spheres of a scene that has not begun places [m] and velocities [m/s]."""
    bodies = device.bodies
    corner = np.array([0.5 * bodies.body[s].width, 0.0])
    for k, (place, velocity) in enumerate(zip(np.atleast_2d(places), np.atleast_2d(velocities))):
        bodies.position[s * bodies.stride + k] = place - corner
        bodies.velocity[s * bodies.stride + k] = velocity


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
        shift[:, 0, 0] = 0.5 * self.in_use(bodies.body.get_member_field("width"))
        shift[:, 0, 1] = -self.in_use(bodies.floor)
        return position - ahead * velocity + shift, velocity

    def _of_all(self, field):
        shape = (-1, self.device.bodies.stride, 2)
        return values(field).reshape(shape)[: self.count, : self.filling.capacity]

    def put(self, places, velocities, s=0):
        """Give the spheres of a scene that has not begun places and velocities."""
        put(self.device, places, velocities, s)
        return self

    def spin(self, s=0):
        """Spins of the spheres of a scene [rad/s]."""
        return self.device.snapshot(s)["spin"]

    def mirror(self, s, to):
        """Give scene ``to`` the places and velocities of scene s, left and right exchanged."""
        bodies = self.device.bodies
        for k in range(self.table.particles[s]):
            source, target = s * bodies.stride + k, to * bodies.stride + k
            for field in (bodies.position, bodies.velocity):
                field[target] = ti.Vector([-field[source][0], field[source][1]])
