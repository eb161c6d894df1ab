"""The spheres of all scenes: their numbers, places and velocities, and how they start."""

from typing import Any

import numpy as np
import taichi as ti

from ca_damper.engine.random_numbers import uniform
from ca_damper.filling import Fillings
from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import values

# Purposes of the random numbers drawn here; the automaton has those before.
_CHOOSE, _SHIFT, _STIR, _SIZE = 4, 5, 6, 8

# Random spheres start this fast [m/s] at most in both directions: those that fill a row of the box
# would otherwise fall in columns that rest on top of each other for ever.
_STIR_SPEED = 0.01

vec2 = ti.types.vector(2, ti.f64)


@ti.dataclass
class Body:
    """Numbers of all spheres of a scene: radius of the largest [m], mean mass [kg], box [m]."""

    radius: ti.f64
    mass: ti.f64
    width: ti.f64
    height: ti.f64
    pull: vec2
    columns: ti.i32
    rows: ti.i32


def _body(options: Any) -> dict[str, Any]:
    across, down = options.fall
    columns, rows = options.lattice
    sphere = {"radius": options.radius, "mass": options.particle_mass, "pull": (0.0 - across, down)}
    box = {"width": options.width, "height": options.height, "columns": columns, "rows": rows}
    return {**sphere, **box}


@ti.data_oriented
class SphereBodies:
    """State of the spheres; sphere k of scene s has the index i = s * stride + k.

    (horizontal, vertical), in the frame at rest. Horizontal positions count from the middle of the
    box, so that a mirrored run has the same bits. Positions run ``lead`` [s] ahead of the
    velocities, half a step in a run. floor: place at the velocities' time [m], as foreseen.
    """

    constant_fields = ("body",)

    def __init__(self, table: SceneFields, given: bool, thrown: bool, kinds: int):
        self.table, self.given, self.thrown, self.kinds = table, given, thrown, kinds
        self.stride = table.length("spheres")
        self.body = table.structs(Body)
        self.position = table.vector(2, ti.f64, "spheres", flat=True)
        self.velocity = table.vector(2, ti.f64, "spheres", flat=True)
        self.force = table.vector(2, ti.f64, "spheres", flat=True)
        self.lead = table.field(ti.f64)
        self.floor = table.field(ti.f64)
        self.radii, self.masses = (table.field(ti.f64, kinds) for _ in range(2))
        if kinds > 1:
            self.kind = table.field(ti.i32, "spheres", flat=True)
            self.counts = table.field(ti.i32, kinds)
        if given:
            self.start = table.vector(2, ti.f64, "spheres")
        if thrown:
            self.start_velocity = table.vector(2, ti.f64, "spheres")

    def upload(self, fillings: Fillings) -> None:
        """Write the numbers of each scene to the device."""
        fillings.write(self.body, _body)
        fillings.write(self.radii, lambda one: one.radii)
        fillings.write(self.masses, lambda one: one.masses)
        if self.kinds > 1:
            fillings.write(self.counts, lambda one: [count for count, _ in one.sizes])
        if self.given:
            fillings.write(self.start, lambda one: np.reshape(one.start, (-1, 2)))
        if self.thrown:
            fillings.write(self.start_velocity, lambda one: np.reshape(one.start_velocity, (-1, 2)))

    @ti.func
    def first(self, s):
        """Index of the first sphere of scene s."""
        return s * self.stride

    @ti.func
    def last(self, s):
        """One past the index of the last sphere of scene s."""
        return s * self.stride + self.table.particles[s]

    @ti.func
    def kind_of(self, i):
        """Size of sphere i, 0 where there is only one."""
        kind = 0
        if ti.static(self.kinds > 1):
            kind = self.kind[i]
        return kind

    @ti.func
    def mass(self, s, i):
        """Mass of sphere i [kg]."""
        return self.masses[s, self.kind_of(i)]

    @ti.func
    def radius(self, s, i):
        """Radius of sphere i [m]."""
        return self.radii[s, self.kind_of(i)]

    @ti.func
    def short_of_reach(self, s, i, j):
        """Length by which spheres i and j touch at less than twice the largest radius [m]."""
        short = 0.0
        if ti.static(self.kinds > 1):
            short = self.short_of_radius(s, i) + self.short_of_radius(s, j)
        return short

    @ti.func
    def short_of_radius(self, s, i):
        """Length by which the radius of sphere i is below the largest [m]."""
        return self.body[s].radius - self.radius(s, i)

    @ti.func
    def position_in_box(self, s, i):
        """Centre of a sphere [m] from the container's lower left inner corner."""
        position = self.position[i] - self.lead[s] * self.velocity[i]
        return position + vec2(0.5 * self.body[s].width, -self.floor[s])

    @ti.func
    def reach_of_walls(self, s, floor):
        """Lowest and highest place of a sphere that touches no wall; floor: where it is [m]."""
        body = self.body[s]
        high = vec2(0.5 * body.width, floor + body.height) - body.radius
        return vec2(-0.5 * body.width, floor) + body.radius, high

    @ti.func
    def height(self, s, place):
        """Drop times pull [m^2/s^2] of a place in the box: to the walls that gravity pulls to."""
        body = self.body[s]
        size = vec2(body.width, body.height)
        drop = ti.select(body.pull < 0.0, place - size, place)
        return body.pull[0] * drop[0] + body.pull[1] * drop[1]

    @ti.func
    def push(self, i, force):
        """Add a contact's force [N] on sphere i."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.force[i] = self.force[i] + force

    @ti.func
    def kick(self, s, i, body, dt):
        """Take sphere i over a step under its contacts and gravity; returns its new velocity."""
        mass = body.mass if ti.static(self.kinds == 1) else self.mass(s, i)
        rate = self.force[i] / mass - body.pull
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
        if ti.static(self.kinds > 1):
            self._choose_kinds(s)
        if ti.static(self.given):
            for i in range(self.first(s), self.last(s)):
                self._put(s, i, self.start[s, i - self.first(s)], vec2(0.0))
        else:
            self._scatter(s)
        if ti.static(self.thrown):
            for i in range(self.first(s), self.last(s)):
                self.velocity[i] = self.start_velocity[s, i - self.first(s)]
        self.lead[s], self.floor[s] = 0.0, 0.0

    @ti.func
    def _put(self, s, i, place, velocity):
        self.position[i] = place - vec2(0.5 * self.body[s].width, 0.0)
        self.velocity[i], self.force[i] = velocity, vec2(0.0)

    @ti.func
    def _scatter(self, s):
        """Put the spheres on random sites of a grid as wide as they leave room for."""
        # Selection sampling: taking a site with the chance "still wanted / still to come" makes
        # every choice equally likely. Spheres move at random within wider sites and cannot overlap.
        body, count, seed = self.body[s], self.table.particles[s], self.table.seed[s]
        columns, rows = self._sites(s, count)
        pitch = vec2(body.width / columns, body.height / rows)
        taken = 0
        for site in range(columns * rows):
            chance = uniform(seed, 0, site, _CHOOSE) * (columns * rows - site)
            if chance < count - taken:
                shift = self._random_pair(seed, site, _SHIFT)
                stir = 2.0 * self._random_pair(seed, site, _STIR) - 1.0
                corner = vec2(site % columns, site // columns) * pitch
                place = corner + body.radius + shift * (pitch - 2.0 * body.radius)
                self._put(s, self.first(s) + taken, place, _STIR_SPEED * stir)
                taken += 1

    @ti.func
    def _choose_kinds(self, s):
        """Choose the size of each sphere: in their order for given places, else at random."""
        # With the chance "left of this size / left of all": ``_scatter`` fills sites from the floor
        # up.
        count = self.table.particles[s]
        for k in range(count):
            drawn = ti.cast(k, ti.f64)
            if ti.static(not self.given):
                drawn = uniform(self.table.seed[s], 0, k, _SIZE) * (count - k)
            self._choose_kind(s, k, drawn)

    @ti.func
    def _choose_kind(self, s, k, drawn):
        """Give sphere k the size in whose part of what is left a number lies."""
        below, chosen = 0, -1
        for kind in range(self.kinds):
            left = self.counts[s, kind]
            if ti.static(not self.given):
                for before in range(k):
                    left -= ti.cast(self.kind[self.first(s) + before] == kind, ti.i32)
            below += left
            if chosen < 0 and drawn < below:
                chosen = kind
        self.kind[self.first(s) + k] = ti.max(chosen, 0)

    def sizes_of(self, s: int, rows: slice) -> dict[str, np.ndarray]:
        """Diameters of some spheres of scene s [m], where there are several sizes."""
        if self.kinds == 1:
            return {}
        return {"diameter": 2.0 * values(self.radii, s)[values(self.kind, rows)]}

    @ti.func
    def _random_pair(self, seed, site, purpose: ti.template()):
        """Two random numbers in [0, 1) for a site."""
        return vec2(uniform(seed, 0, site, purpose), uniform(seed, 1, site, purpose))

    @ti.func
    def _sites(self, s, count):
        """Columns and rows of a grid with about twice as many sites as spheres, if so many fit."""
        body = self.body[s]
        most_columns, most_rows = body.columns, body.rows
        wanted = ti.min(2 * count, most_columns * most_rows)
        across = ti.cast(ti.ceil(ti.sqrt(wanted * body.width / body.height)), ti.i32)
        columns = ti.min(ti.max(across, (wanted + most_rows - 1) // most_rows, 1), most_columns)
        return columns, ti.max((wanted + columns - 1) // columns, 1)
