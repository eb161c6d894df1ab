"""A step without effects beside one stripped by hand: an effect that is absent costs nothing.

The stripped step holds elastic bonds and free bodies and nothing that an effect could hook into, so
that the promise can be checked on any machine (``cost_of_effects.py``).
"""

import numpy as np
import taichi as ti

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.kit.study.timing import seconds_of
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.physics.bond import unit_arm, unit_opening
from taichi_dem.physics.rotation import mean_spin, rotation_matrix, spin_of, turned
from taichi_dem.step.advance import Advance
from taichi_dem.step.bond import motion_of
from taichi_dem.step.drivers import Resident
from taichi_dem.step.phases import Step

#: Step of the elastic block [s], far below its limit.
STEP = 1e-8


def elastic_step_seconds(mesh, substeps, repeats):
    """CPU seconds of some substeps of an elastic block in motion, in turns of random order.

    Returns "composed", of the step as the package composes it, and "by_hand", of ``ByHand``.
    """
    runs = {"composed": _elastic(mesh, None), "by_hand": _elastic(mesh, ByHand)}
    seconds = {name: [] for name in runs}
    order = np.random.default_rng(2)
    for _ in range(repeats):
        for name in order.permutation([*runs]):
            seconds[name].append(seconds_of(runs[name], substeps))
    return seconds


def _elastic(mesh, stripped):
    """A function that takes an elastic block, its bodies shaken, some substeps on."""
    simulation = Simulation(Scene(mesh, CONCRETE, []), Uniform(STEP), "resident")
    centre = simulation.model.centre
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1))
    velocity = np.random.default_rng(1).normal(size=centre.shape)
    simulation.state.set_motion(centre, turn, velocity)
    simulation.start()
    driver = simulation.driver
    if stripped is not None:
        engine = simulation.engine
        advance = stripped(engine.schedule)
        driver = Resident(Step(advance, None))
    driver.prepare()
    return lambda substeps: driver.few(1 << 60, substeps)


@ti.data_oriented
class ByHand(Advance):
    """Elastic bonds and free bodies, with nothing left in that an effect could hook into."""

    @ti.func
    def bond(self, b):
        """Elastic traction of three units, given to both bodies."""
        if self.state.broken_tick[b] < 0:
            slots = self.tables.bond_slots[b]
            motion = motion_of(self, b)
            k, force, torque = self.tables.bond_stiffness[b], vec3(0.0), vec3(0.0)
            m = self.tables.bond_pair[b]
            for q in range(3):
                u = 3 * b + q
                arm = unit_arm(motion, self.tables.vertex_slave[u])
                opening = unit_opening(motion, arm, self.tables.vertex_master[u])
                traction = vec3(k[0] * opening[0], k[1] * opening[1], k[1] * opening[2])
                # What would have acted is watched in every scene.
                shear = vec2(traction[1], traction[2])
                self.state.note_passed(m, b, traction[0], shear.norm_sqr())
                force += traction
                torque += arm.cross(traction)
            dt = self.schedule.pair_step(slots[0] >> 2, slots[1] >> 2)
            area = self.tables.unit_area[b]
            self._pull_together(slots, motion, force * (area * dt), torque * (area * dt))

    @ti.func
    def body(self, i):
        """Take the impulses, move and turn."""
        elapsed = self.schedule.elapsed(i)
        linear, angular = vec3(0.0), vec3(0.0)
        for f in range(4):
            taken = self.state.slot[4 * i + f]
            linear += taken[0:3]
            angular += taken[3:6]
            self.state.slot[4 * i + f] = 0.0 * taken
        velocity = self.state.velocity[i] + linear * self.tables.mass_inverse[i]
        momentum = self.state.angular_momentum[i] + angular
        spin = spin_of(self.state.rotation[i], self.tables.inertia_inverse[i], momentum)
        inverse = self.tables.inertia_inverse[i]
        turning = mean_spin(self.state.rotation[i], inverse, momentum, spin, elapsed)
        orientation = turned(self.state.orientation[i], turning, elapsed)
        self.state.orientation[i] = orientation
        self.state.rotation[i] = rotation_matrix(orientation)
        self.state.position[i] = self.state.position[i] + elapsed * velocity
        self.state.last_tick[i] = self.state.tick[None]
        speed2 = velocity.norm_sqr()
        if not (
            speed2 + spin.norm_sqr() * self.tables.radius[i] ** 2 < self.state.max_speed2[None]
        ):
            ti.atomic_min(self.state.bad_body[None], i)
        self.state.velocity[i], self.state.angular_momentum[i] = velocity, momentum
        self.state.spin[i] = spin
        self.schedule.choose_level(i, speed2)
