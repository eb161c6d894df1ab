"""One step of the spheres: contacts, walls, motion; and readings between steps."""

import math
from typing import Any

import numpy as np
import taichi as ti

from ca_damper.filling import Action, Fillings
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import SphereBodies, vec2
from ca_damper.spheres.contact_law import SphereContactLaw
from ca_damper.spheres.contacts import PairContacts, WallContacts
from ca_damper.spheres.effect_activity import PAIRS, WALLS, EffectActivity
from ca_damper.spheres.expected_contacts import SEARCHES
from ca_damper.spheres.forces import SpherePairForces, WallForces
from ca_damper.spheres.friction_history import FrictionHistory
from ca_damper.spheres.rotation import Rotation
from taichi_dem.kit.allocation import values
from taichi_dem.kit.effect_table import EffectUse

# Codes of divergence; a speed is a runaway's when it crosses more than a radius in a step.
FINE, NOT_FINITE, RUNAWAY, OVERLAP, ENERGY_GAINED = range(5)
DIVERGENCES = {
    NOT_FINITE: "has a sphere whose velocity is not a finite number",
    RUNAWAY: "has a sphere that moves by more than its radius in a step",
    OVERLAP: "has spheres that overlap, or lie outside the container, by more than a radius",
    ENERGY_GAINED: "has contacts that return more energy than they took",
}

# Share of their energy, as the container sees it, that spheres may gain from contacts: all of them
# may land in one step, and the leapfrog's energy is off by (w dt)^2 / 4 in a contact, half a period
# of w, of six steps. Measured at 20 us, with 1 to 100 spheres: 0.04 with the usual restitution; at
# 40 us, three steps a contact, up to 0.3.
MOST_GAIN = (math.pi / 6.0) ** 2 / 4.0
# Share of a gain, and of the energy that it is compared to, that is forgotten at each check: errors
# of many impacts of either sign add up to a spurious gain, while a diverging run shows within some
# 100 checks.
FORGOTTEN = 1.0 / 256.0


@ti.data_oriented
class DeviceSpheres:
    """The spheres of all scenes of a table, on the device; see ``ca_damper.filling``."""

    def __init__(self, options: Any, table: SceneFields):
        self.table, self.rubs = table, options.rubs
        given = options.start is not None, options.start_velocity is not None
        self.bodies = SphereBodies(table, *given, len(options.radii))
        self.law, self.effect_activity = SphereContactLaw(options.damping), EffectActivity(table)
        self.rotation = Rotation(self.bodies, options.rotation)
        self.search = SEARCHES[options.search](table, self.bodies)
        self.pair_contacts = PairContacts(self.law, self.rotation)
        self.wall_contacts = WallContacts(self.law, self.rotation)
        self.history = FrictionHistory(self.pair_contacts, options.remembers)
        shared = self.search, self.history, self.effect_activity, self.rubs
        self.pair_forces = SpherePairForces(self.pair_contacts, *shared)
        self.wall_forces = WallForces(self.wall_contacts, *shared)
        self.crushed, self.speed = table.field(ti.i32), table.field(ti.f64)
        self.given, self.lost = table.field(ti.f64), table.field(ti.f64)
        self.held, self.allowed = table.field(ti.f64), table.field(ti.f64)

    def upload(self, fillings: Fillings) -> None:
        """Take over the numbers of the spheres of each scene."""
        for part in (self.bodies, self.search, self.pair_contacts, self.wall_contacts):
            part.upload(fillings)

    @ti.func
    def reset(self, s):
        """Place the spheres of scene s, at rest; the first step takes them to the container."""
        self.place(s)

    @ti.func
    def place(self, s):
        """Place the spheres; nothing has happened."""
        self.bodies.reset_positions(s)
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            self.rotation.reset(i)
        self.wall_contacts.reset(s)
        self.history.reset(s)
        self.effect_activity.reset(s)
        self.search.forget(s)
        self.search.clear(s)
        self.given[s], self.lost[s] = 0.0, -ti.math.inf
        self.allowed[s], self.speed[s] = 0.0, 0.0

    @ti.func
    def advance(self, s, step, motion):
        """Advance the spheres by a step; returns the impulse of their impacts on the container."""
        dt = self.table.dt[s]
        if step == 0:
            self.board(s, motion)
        since = self.bodies.lead[s] + 0.5 * dt
        if self.bodies.lead[s] != 0.5 * dt:
            self.bodies.advance_lead(s, 0.5 * dt)
            self.search.forget(s)
        return Action(self.step(s, step, dt, since, motion), 0.0)

    @ti.func
    def board(self, s, motion):
        """Take the spheres from where they were placed to the container, which moves."""
        self.bodies.board(s, motion)
        self.lost[s] = -ti.math.inf

    @ti.func
    def step(self, s, step, dt, since, motion):
        """Advance spheres whose positions run half a step ahead; returns their impulse [N s]."""
        floor = motion.x + 0.5 * dt * (motion.v + 0.25 * dt * motion.a)
        low, high = self.bodies.reach_of_walls(s, floor)
        # Seen from spheres that fall freely, as all that is foreseen of them is their fall.
        pull = self.bodies.body[s].pull
        speed = vec2(0.5 * dt * pull[0], motion.v + 0.5 * dt * (motion.a + pull[1]))
        self.search.refresh(s, low, high)
        if ti.static(self.history.remembers):
            self.history.step[s], self.history.speed[s] = step, motion.v
        self.effect_activity.step[s] = step
        force = self._push(s, dt, since, low, high, speed)
        self.move(s, dt)
        # The container recoils by dt force / M over the step; half of it on the way.
        recoil = dt * force * self.table.recoil[s]
        self.given[s] = self.given[s] + dt * force * (motion.v + 0.5 * (dt * motion.a - recoil))
        self.speed[s] = motion.v + dt * motion.a - recoil
        if ti.static(self.history.remembers):
            self.history.speed[s] = self.speed[s]
        self.bodies.floor[s] = motion.x + dt * (motion.v + 0.5 * dt * motion.a)
        return -dt * force

    @ti.func
    def _push(self, s, dt, since, low, high, speed):
        """Add the forces of all contacts; returns the container's force on the spheres [N]."""
        contact = self.pair_contacts.over_step(s, dt, since)
        which, count = self.search.find(s, contact.reach)
        if count > 0:
            self.effect_activity.note(s, PAIRS)
        self.pair_forces.add(s, contact, which, count)
        self.search.count_skipped(s)
        of_walls = self.wall_contacts.over_step(s, 0, dt, since)
        force, touching = self.wall_forces.add(s, of_walls, low, high, speed)
        if touching > 0:
            self.effect_activity.note(s, WALLS)
        return force

    @ti.func
    def move(self, s, dt):
        """Take the spheres over the step."""
        body = self.bodies.body[s]
        least, most = vec2(ti.math.inf), vec2(-ti.math.inf)
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            velocity = self.bodies.kick(s, i, body, dt)
            self.rotation.kick(s, i, dt)
            # Not by ti.min and ti.max: what they do about NaN takes five instructions more.
            least = ti.select(velocity < least, velocity, least)
            most = ti.select(velocity > most, velocity, most)
        self.search.note_motion(s, dt * least, dt * most)

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy and that of the contacts [J]."""
        total = 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            total += self._own_energy(s, i)
            for j in range(i + 1, self.bodies.last(s)):
                total += self._pair_energy(s, i, j)
        if ti.static(self.history.remembers):
            energy, _ = self.history.of_pairs(s)
            total += energy
        return total

    @ti.func
    def _own_energy(self, s, i):
        body = self.bodies.body[s]
        velocity, place = self.bodies.velocity[i], self.bodies.position_in_box(s, i)
        mass, contact = self.bodies.mass(s, i), self.wall_contacts.at_rest(s, i)
        total = mass * (0.5 * velocity.norm_sqr() + self.bodies.height(s, place))
        total += self.rotation.energy(s, i)
        room = ti.min(place, vec2(body.width, body.height) - place)
        for axis in ti.static(range(2)):
            total += self.law.stored(contact, contact.reach - room[axis])
        if ti.static(self.history.remembers):
            below = vec2(body.width, body.height) - place
            total += self.history.of_walls(s, i, contact, place, below)
        return total

    @ti.func
    def _pair_energy(self, s, i, j):
        """Energy of the contact of two spheres [J], none where they do not touch."""
        contact = self.pair_contacts.at_rest(s, i, j)
        distance = (self.bodies.position_in_box(s, j) - self.bodies.position_in_box(s, i)).norm()
        return self.law.stored(contact, contact.reach - distance)

    @ti.func
    def momentum(self, s):
        """Momentum along x [kg m/s]."""
        total = 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            total += self.bodies.mass(s, i) * self.bodies.velocity[i][1]
        return total

    @ti.func
    def divergence_code(self, s):
        """Code of DIVERGENCES, or 0; "not" makes NaN fail a test."""
        body, dt = self.bodies.body[s], self.table.dt[s]
        self.crushed[s], self.held[s] = self.search.full[s], 0.0
        # Positions run half a step of the contacts ahead, and not at all before the first one.
        last = ti.select(self.bodies.lead[s] > 0.0, 2.0 * self.bodies.lead[s], dt)
        contact = self.pair_contacts.over_step(s, last, last)
        seen = 0
        self.search.each_listed_pair(s, contact, self._note_pair, seen)
        if ti.static(self.history.remembers):
            energy, power = self.history.of_pairs(s)
            self.held[s] = self.held[s] + energy
            self.effect_activity.power[s] = self.effect_activity.power[s] + vec2(0.0, power)
        code = ENERGY_GAINED if self._gains(s) else FINE
        if self.crushed[s] > 0:
            code = OVERLAP
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            place, speed = self.bodies.position_in_box(s, i), self.bodies.velocity[i].norm()
            if (place < 0.0).any() or (place > vec2(body.width, body.height)).any():
                code = OVERLAP
            radius = self.bodies.radius(s, i)
            if not (speed * dt < radius):
                code = RUNAWAY
            if not (speed < ti.math.inf):
                code = NOT_FINITE
            room = ti.min(place, vec2(body.width, body.height) - place)
            at_wall = ti.cast((room < radius).any(), ti.i32)
            going = 0.5 * self.bodies.mass(s, i) * speed * speed
            self.effect_activity.note_sphere(s, at_wall, going, self.rotation.energy(s, i))
        return code

    @ti.func
    def _gains(self, s):
        """Whether contacts have created a good part of the energy of late, which is impossible."""
        # Seen from the container, as spheres at rest in the room meet a wall that comes to them.
        body, speed = self.bodies.body[s], self.speed[s]
        weight = self.table.particles[s] * body.mass * body.pull[1]
        energy, shift = self.held[s], 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            energy += self._own_energy(s, i)
            mass, velocity = self.bodies.mass(s, i), self.bodies.velocity[i]
            shift += mass * speed * (0.5 * speed - velocity[1])
        lost = self.given[s] - energy - weight * self.bodies.floor[s]
        kept = 1.0 - FORGOTTEN
        gain = ti.max(0.0, self.lost[s] - lost) * kept
        self.lost[s] = lost + gain
        self.allowed[s] = ti.max(MOST_GAIN * (energy + shift), self.allowed[s] * kept)
        return gain > self.allowed[s]

    @ti.func
    def _note_pair(self, s, i, j, for_step, seen: ti.template()):
        """Note the energy of a pair, and whether it touches or overlaps by half its reach."""
        self.held[s] = self.held[s] + self._pair_energy(s, i, j)
        branch = self.bodies.position[j] - self.bodies.position[i]
        distance, contact = branch.norm(), self.pair_contacts.between(s, i, j, for_step)
        if distance < 0.5 * contact.reach:
            self.crushed[s] = 1
        if distance < contact.reach:
            normal = branch * (1.0 / distance)
            relative = self.bodies.velocity[i] - self.bodies.velocity[j]
            approach, overlap, rubbed = relative.dot(normal), contact.reach - distance, 0.0
            push = self.law.normal(contact, overlap, approach)
            if ti.static(self.rubs and not self.history.remembers):
                across = relative.dot(vec2(-normal[1], normal[0]))
                slip = self.rotation.slip_of_pair(s, i, j, distance, across)
                rubbed = -self.law.friction(contact, push, slip) * slip
            dragged = (push - self.law.elastic(contact, overlap)) * approach
            self.effect_activity.note_contact(s, dragged, rubbed)

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """Activity of each of the named effects."""
        return self.effect_activity.uses(effects, self.search.all_skipped())

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each of the named effects first acted, infinite if never, (scenes,)."""
        return self.effect_activity.first_steps(effects)

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Places and velocities of the spheres of scene s."""
        count = self.table.particles[s]
        rows = slice(s * self.bodies.stride, s * self.bodies.stride + count)
        velocity = values(self.bodies.velocity)[rows]
        position = values(self.bodies.position)[rows] - self.bodies.lead[s] * velocity
        shift = np.array([0.5 * self.bodies.body[s].width, -self.bodies.floor[s]])
        more = {**self.rotation.snapshot(rows), **self.bodies.sizes_of(s, rows)}
        return {"position": position + shift, "velocity": velocity, **more}
