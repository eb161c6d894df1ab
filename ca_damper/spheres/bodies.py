"""The spheres of all scenes: their numbers, places and velocities, and how they start."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.random_numbers import uniform
from ca_damper.scenes.scene_fields import SceneFields

# Purposes of the random numbers drawn here; the automaton has those before.
_CHOOSE, _SHIFT, _STIR = 4, 5, 6

# Random spheres start this fast [m/s] at most in both directions: those that fill a row of the box
# would otherwise fall in columns that rest on top of each other for ever.
_STIR_SPEED = 0.01

vec2 = ti.types.vector(2, ti.f64)


@ti.dataclass
class Body:
    """Numbers that all spheres share: radius [m], mass [kg], box [m] and gravity [m/s^2].

    pull: acceleration by gravity, downwards [m/s^2], as a vector that the compiler does not take
    apart: both components are then divided and subtracted by one instruction.
    columns, rows: of the spheres that fit into the box.
    """

    radius: ti.f64
    mass: ti.f64
    width: ti.f64
    height: ti.f64
    gravity: ti.f64
    pull: vec2
    columns: ti.i32
    rows: ti.i32


@ti.data_oriented
class Bodies:
    """State of the spheres; sphere k of scene s has the index i = s * stride + k.

    position [m] and velocity [m/s], (horizontal, vertical), in the frame at rest. Horizontal
    positions count from the middle of the box, so that a mirrored run has the same bits; vertical
    ones from where the floor is at x = 0. Positions run ``lead`` [s] ahead of the velocities, half
    a step in a run. force [N]: of the contacts of this step. floor: where the container's floor is
    at the time of the velocities [m], as foreseen by the last step.
    """

    def __init__(self, table: SceneFields, given: bool):
        self.table, self.given = table, given
        self.stride = table.length("spheres")
        self.body = Body.field(shape=())
        self.position = table.vector(2, ti.f64, "spheres", flat=True)
        self.velocity = table.vector(2, ti.f64, "spheres", flat=True)
        self.force = table.vector(2, ti.f64, "spheres", flat=True)
        self.lead = table.field(ti.f64)
        self.floor = table.field(ti.f64)
        if given:
            self.start = ti.Vector.field(2, ti.f64, shape=self.stride)

    def load(self, options: Any) -> None:
        """Write the numbers of the options to the device."""
        self._load(options.radius, options.particle_mass, options.gravity)
        self._load_box(options.width, options.height, *options.lattice)
        if self.given:
            self._load_start(np.array(options.start).reshape(-1, 2))

    @ti.kernel
    def _load(self, radius: ti.f64, mass: ti.f64, gravity: ti.f64):
        self.body[None].radius, self.body[None].mass = radius, mass
        self.body[None].gravity, self.body[None].pull = gravity, vec2(0.0, gravity)

    @ti.kernel
    def _load_box(self, width: ti.f64, height: ti.f64, columns: ti.i32, rows: ti.i32):
        self.body[None].width, self.body[None].height = width, height
        self.body[None].columns, self.body[None].rows = columns, rows

    @ti.kernel
    def _load_start(self, places: ti.types.ndarray(dtype=ti.f64, ndim=2)):
        for k in range(places.shape[0]):
            self.start[k] = vec2(places[k, 0], places[k, 1])

    @ti.func
    def first(self, s):
        """Index of the first sphere of scene s."""
        return s * self.stride

    @ti.func
    def last(self, s):
        """One past the index of the last sphere of scene s."""
        return s * self.stride + self.table.particles[s]

    @ti.func
    def position_in_box(self, s, i):
        """Centre of a sphere [m] from the container's lower left inner corner."""
        position = self.position[i] - self.lead[s] * self.velocity[i]
        return position + vec2(0.5 * self.body[None].width, -self.floor[s])

    @ti.func
    def reach_of_walls(self, floor):
        """Lowest and highest place of a sphere that touches no wall; floor: where it is [m]."""
        body = self.body[None]
        high = vec2(0.5 * body.width, floor + body.height) - body.radius
        return vec2(-0.5 * body.width, floor) + body.radius, high

    @ti.func
    def push(self, i, force):
        """Add a contact's force [N] on sphere i."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.force[i] = self.force[i] + force

    @ti.func
    def kick(self, i, body, dt):
        """Take sphere i over a step under its contacts and gravity; returns its new velocity."""
        rate = self.force[i] / body.mass - body.pull
        velocity = self.velocity[i] + dt * rate
        self.force[i] = vec2(0.0)
        self.velocity[i] = velocity
        self.position[i] = self.position[i] + dt * velocity
        return velocity

    @ti.func
    def board(self, s, motion):
        """Take spheres that stand where they should in a container at rest to a moving one."""
        for i in range(self.first(s), self.last(s)):
            self.position[i] = self.position[i] + vec2(0.0, motion.x)
            self.velocity[i] = self.velocity[i] + vec2(0.0, motion.v)
        self.floor[s] = motion.x

    @ti.func
    def advance_lead(self, s, time):
        """Shift positions a time [s] ahead of the velocities, as a change of step requires."""
        for i in range(self.first(s), self.last(s)):
            self.position[i] = self.position[i] + (time - self.lead[s]) * self.velocity[i]
        self.lead[s] = time

    @ti.func
    def reset_positions(self, s):
        """Place the spheres: given places at rest, or random ones with small velocities."""
        if ti.static(self.given):
            for i in range(self.first(s), self.last(s)):
                self._put(i, self.start[i - self.first(s)], vec2(0.0))
        else:
            self._scatter(s)
        self.lead[s], self.floor[s] = 0.0, 0.0

    @ti.func
    def _put(self, i, place, velocity):
        """Put a sphere at a place [m] counted from the lower left corner."""
        self.position[i] = place - vec2(0.5 * self.body[None].width, 0.0)
        self.velocity[i], self.force[i] = velocity, vec2(0.0)

    @ti.func
    def _scatter(self, s):
        """Put the spheres on random sites of a grid as wide as they leave room for.

        A site is taken with the chance "still wanted over still to come", which makes every
        choice of sites equally likely (selection sampling). Where sites are wider than spheres,
        each sphere is moved at random within its own; none can then overlap.
        """
        body, count, seed = self.body[None], self.table.particles[s], self.table.seed[s]
        columns, rows = self._sites(count)
        pitch = vec2(body.width / columns, body.height / rows)
        taken = 0
        for site in range(columns * rows):
            chance = uniform(seed, 0, site, _CHOOSE) * (columns * rows - site)
            if chance < count - taken:
                shift = self._random_pair(seed, site, _SHIFT)
                stir = 2.0 * self._random_pair(seed, site, _STIR) - 1.0
                corner = vec2(site % columns, site // columns) * pitch
                place = corner + body.radius + shift * (pitch - 2.0 * body.radius)
                self._put(self.first(s) + taken, place, _STIR_SPEED * stir)
                taken += 1

    @ti.func
    def _random_pair(self, seed, site, purpose: ti.template()):
        """Two random numbers in [0, 1) for a site."""
        return vec2(uniform(seed, 0, site, purpose), uniform(seed, 1, site, purpose))

    @ti.func
    def _sites(self, count):
        """Columns and rows of a grid with about twice as many sites as spheres, if so many fit."""
        body = self.body[None]
        most_columns, most_rows = body.columns, body.rows
        wanted = ti.min(2 * count, most_columns * most_rows)
        across = ti.cast(ti.ceil(ti.sqrt(wanted * body.width / body.height)), ti.i32)
        columns = ti.min(ti.max(across, (wanted + most_rows - 1) // most_rows, 1), most_columns)
        return columns, ti.max((wanted + columns - 1) // columns, 1)
