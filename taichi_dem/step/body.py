"""How a body takes the impulses that wait for it, and how it moves."""

import taichi as ti

from taichi_dem.kit.products import squared
from taichi_dem.kit.types import vec3
from taichi_dem.physics.rotation import mean_spin, turned
from taichi_dem.step.multirate.schedule import Schedule


@ti.data_oriented
class BodyMotion:
    """Impulses in the slots of a body, and its drift."""

    def __init__(self, schedule: Schedule):
        self.schedule, self.tables, self.state = schedule, schedule.tables, schedule.state
        self.contacts, self.has_contact = schedule.contacts, schedule.has_contact
        self.sleeps, self.sleeping = schedule.sleeps, schedule.sleeping

    @ti.func
    def gathered(self, i):
        """Collect the impulse and moment in the slots of a body, always summed in one order."""
        linear, angular = vec3(0.0), vec3(0.0)
        for f in range(4):
            taken = self.state.slot[4 * i + f]
            linear += taken[0:3]
            angular += taken[3:6]
            if ti.static(not self.schedule.every_bond_acts):
                self.state.slot[4 * i + f] = 0.0 * taken
        if ti.static(self.has_contact):
            pushed, twisted = self.contacts.gather(i)
            linear += pushed
            angular += twisted
        return linear, angular

    @ti.func
    def drift(self, i, elapsed, velocity, momentum, spin):
        """Move and turn body i from a spin; note its displacement, and a runaway; wake others."""
        turning = self._turning(i, elapsed, momentum, spin)
        self.state.orientation[i] = turned(self.state.orientation[i], turning, elapsed)
        self.state.position[i] = self.state.position[i] + elapsed * velocity
        self.state.last_tick[i] = self.state.tick[None]
        if ti.static(self.sleeps):
            self.sleeping.stir(i, elapsed, velocity, momentum)
        if ti.static(self.has_contact):
            self.contacts.moved(i, velocity, spin, elapsed)
        speed2 = squared(velocity)
        # One comparison finds runaway, infinity and NaN; "v != v" would be folded away.
        if not (speed2 + squared(spin) * self.tables.radius[i] ** 2 < self.state.max_speed2[None]):
            ti.atomic_min(self.state.bad_body[None], i)

    @ti.func
    def _turning(self, i, elapsed, momentum, spin):
        """World spin in the middle of the step [rad/s], as supports allow."""
        inverse = self.tables.inertia_inverse[i]
        turning = mean_spin(self.state.rotation(i), inverse, momentum, spin, elapsed)
        for effect in ti.static(self.tables.supports):
            if effect.acts_on(i):
                turning = spin
        return turning
