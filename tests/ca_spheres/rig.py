"""A container that moves as told, around spheres; what the tests need of a time loop."""

import math

import numpy as np
import taichi as ti

from ca_damper.filling import Motion
from ca_damper.table import SceneTable

# A CPU loop gives every thread at least this many iterations.
_PAD = 512


@ti.data_oriented
class Rig:
    """Spheres in containers that are driven as x = amplitude sin(2 pi f t), or stand still.

    done: steps taken, of all scenes. impulse [N s]: on each container since the reset.
    """

    def __init__(self, options, particles, dt, seed=1, frequency=0.0, amplitude=0.0):
        self.table = SceneTable(particles, seed, dt, frequency, amplitude)
        self.count = self.table.count
        self.done = 0
        self.impulse = ti.field(ti.f64, shape=self.count)
        self.device = options.bind(self.table)
        self._reset()

    @ti.kernel
    def _reset(self):
        for s in range(self.count):
            self.device.reset(s)
            self.impulse[s] = 0.0

    @ti.func
    def motion(self, s, step):
        omega = 2.0 * math.pi * self.table.frequency[s]
        phase, amplitude = omega * step * self.table.dt[s], self.table.base_amplitude[s]
        rate, bend = omega * ti.cos(phase), -omega * omega * ti.sin(phase)
        return Motion(amplitude * ti.sin(phase), amplitude * rate, amplitude * bend)

    @ti.kernel
    def _run(self, start: ti.i32, end: ti.i32):
        for t in range(_PAD * self.count):
            if t % _PAD == 0:
                s = t // _PAD
                for step in range(start, end):
                    action = self.device.advance(s, step, self.motion(s, step))
                    self.impulse[s] = self.impulse[s] + action.impulse

    @ti.kernel
    def _asked(self, s: ti.i32) -> ti.types.vector(3, ti.f64):
        return ti.Vector(
            [
                self.device.energy(s),
                self.device.momentum(s),
                ti.cast(self.device.divergence_code(s), ti.f64),
            ]
        )

    def run(self, steps):
        """Take all scenes on by a number of steps."""
        self._run(self.done, self.done + steps)
        self.done += steps
        return self

    def energy(self, s=0):
        return self._asked(s)[0]

    def momentum(self, s=0):
        return self._asked(s)[1]

    def divergence_code(self, s=0):
        return int(self._asked(s)[2])

    def state(self, s=0):
        """Position and velocity of the spheres of a scene, (particles, 2) each."""
        shot = self.device.snapshot(s)
        return shot["position"], shot["velocity"]

    def states(self):
        """Position and velocity of all spheres there is room for, (scenes, capacity, 2) each."""
        bodies, shape = self.device.bodies, (self.count, -1, 2)
        velocity = bodies.velocity.to_numpy().reshape(shape)
        ahead = bodies.lead.to_numpy()[:, None, None]
        shift = np.zeros((self.count, 1, 2))
        shift[:, 0, 0] = 0.5 * bodies.body[None].width
        shift[:, 0, 1] = -bodies.floor.to_numpy()
        return bodies.position.to_numpy().reshape(shape) - ahead * velocity + shift, velocity

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
