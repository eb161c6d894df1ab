"""Dashpots between bodies and the ground, solved in the body's own update."""

import taichi as ti

from taichi_dem.kit.types import real, vec3
from taichi_dem.physics.ground import braked_twist, twist_of
from taichi_dem.physics.rotation import world_tensor
from taichi_dem.physics.wrench import plus, zero_block
from taichi_dem.state.state import State
from taichi_dem.state.tables import Tables


@ti.data_oriented
class GroundDashpots:
    """Impulses of the effects of the role ground.

    present: whether the scene lists one. above: rows of ``Advance.loaded`` above theirs.
    """

    def __init__(self, tables: Tables, state: State):
        self.tables, self.state = tables, state
        self.present, self.above = bool(tables.ground), len(tables.loads)

    @ti.func
    def added(self, rows, linear, angular, kick):
        """Impulse, moment and rows of ``Advance.loaded`` with those of the ground added."""
        pushed, turned = vec3(0.0), vec3(0.0)
        for e, k in ti.static(ti.ndrange(len(self.tables.ground), 3)):
            pushed[k] += rows[e, k]
            turned[k] += rows[e, 3 + k]
        for e, k in ti.static(ti.ndrange(len(self.tables.ground), 6)):
            kick[self.above + e, k] = rows[e, k]
        return linear + pushed, angular + turned, kick

    @ti.func
    def impulses(self, i, elapsed, linear, angular):
        """Impulse and moment of each ground on body i in a step of elapsed [s], a row each.

        linear [N s], angular [N m s]: what the body gathers in the step besides.
        """
        rows = ti.Matrix.zero(real, ti.static(len(self.tables.ground)), 6)
        total, joined = zero_block(), 0
        for effect in ti.static(self.tables.ground):
            if effect.acts_on(i):
                total, joined = plus(total, effect.resistance(i)), 1
        if joined == 1:
            rotation, mass = self.state.rotation[i], self.tables.mass[i]
            velocity, spin = braked_twist(
                mass,
                world_tensor(rotation, self.tables.inertia[i]),
                total,
                mass * self.state.velocity[i] + 0.5 * linear,
                self.state.angular_momentum[i] + 0.5 * angular,
                elapsed,
            )
            rows = self.shares(i, elapsed, velocity, spin)
        return rows

    @ti.func
    def shares(self, i, elapsed, velocity, spin):
        """Impulse and moment of each ground at a mean velocity and spin, a row each."""
        rows = ti.Matrix.zero(real, ti.static(len(self.tables.ground)), 6)
        for e in ti.static(range(len(self.tables.ground))):
            if self.tables.ground[e].acts_on(i):
                force, moment = twist_of(self.tables.ground[e].resistance(i), velocity, spin)
                for k in ti.static(range(3)):
                    rows[e, k], rows[e, 3 + k] = -elapsed * force[k], -elapsed * moment[k]
        return rows
