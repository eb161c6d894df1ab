"""One step of the spheres: contacts, walls, motion; and readings between steps.

Time integration is the leapfrog, with velocities at the times t_n of the given motion of the
container, and positions half a step ahead. In a step, forces are evaluated at the positions of its
middle, change the velocities over the whole step, and these move the positions on. It is of second
order, symplectic without dissipation, and needs one evaluation of the contacts. As the forces
belong to the middle of the step over which they act on the container, they do not lag.

Spheres move in the frame at rest, not in the container's: their gain of momentum is that from
contacts and gravity, to round-off, and the impacts on the container are its exact counterpart.
"""

import math
from typing import Any, Optional

import numpy as np
import taichi as ti

from ca_damper.filling import Action
from ca_damper.scenes.scene_fields import SceneFields
from ca_damper.spheres.bodies import Bodies, vec2
from ca_damper.spheres.contact_law import Contact, ContactLaw, pair_numbers, wall_numbers
from ca_damper.spheres.effect_activity import FRICTION, PAIRS, WALLS, EffectActivity
from ca_damper.spheres.expected_contacts import SEARCHES
from ca_damper.spheres.friction_onset import FrictionOnset
from ca_damper.spheres.pair_forces import PairForces
from ca_damper.spheres.rotation import NoRotation, Rotation
from ca_damper.spheres.wall_forces import WallForces
from taichi_dem.kit.allocation import values
from taichi_dem.kit.audit import Audit
from taichi_dem.kit.effect_usage import EffectUse

# Codes of divergence; a speed is a runaway's when it crosses more than a radius in a step.
FINE, NOT_FINITE, RUNAWAY, OVERLAP, ENERGY_GAINED = range(5)
DIVERGENCES = {
    NOT_FINITE: "has a sphere whose velocity is not a finite number",
    RUNAWAY: "has a sphere that moves by more than its radius in a step",
    OVERLAP: "has spheres that overlap, or lie outside the container, by more than a radius",
    ENERGY_GAINED: "has contacts that give back more energy than they took",
}

# Share of their energy that spheres may gain from contacts. Measured over 5 to 20 cycles: 2e-4 at
# 20 us, 6e-3 with restitution 1; at 40 us, three steps a contact, 0.06 to 0.6 where it goes wrong.
MOST_GAIN = 0.03
# Further gain allowed to a single sphere: the leapfrog's energy is off by (w dt)^2 / 4 in a
# contact, half a period of w, of six steps.
_WALL_IMPULSE_SHARE = (math.pi / 6.0) ** 2 / 4.0
# Share of a gain that is forgotten at each check: errors of many impacts of either sign add
# up to a spurious gain, while a diverging run shows within some 100 checks.
_FORGOTTEN = 1.0 / 256.0


@ti.data_oriented
class DeviceSpheres:
    """The spheres of all scenes of a table, on the device; see ``ca_damper.filling``.

    crushed: whether spheres of a scene lay in each other by a radius when ``divergence_code``
    looked last. given: work of the walls on the spheres [J]. lost: most energy that contacts have
    taken up to a look of late [J], but for a constant. held: energy of the pairs that touch [J], as
    of a look.
    """

    def __init__(self, options: Any, table: SceneFields):
        self.table = table
        self.bodies = Bodies(table, options.start is not None)
        self.law, self.rubs = ContactLaw(options.damping), options.rubs
        self.rotation = Rotation() if options.rotation else NoRotation()
        self.search = SEARCHES[options.search](table, self.bodies)
        parts = self.bodies, self.search, self.law, self.rotation
        self.pair_forces = PairForces(table, *parts, self.rubs)
        self.wall_forces = WallForces(*parts, self.rubs)
        self.friction_onset = FrictionOnset(*parts)
        self.crushed = table.field(ti.i32)
        self.effect_activity = EffectActivity(table)
        self.given, self.lost = table.field(ti.f64), table.field(ti.f64)
        self.held = table.field(ti.f64)
        self.rotation.bind(self.bodies)
        self.contact_of_pair = Contact.field(shape=())
        self.contact_of_wall = Contact.field(shape=())

    def load(self, options: Any) -> None:
        """Take over the numbers of spheres of the same structure."""
        share = self.rotation.tangential_share
        self.bodies.load(options)
        self.search.load(options)
        self.law.load(self.contact_of_pair, pair_numbers(options), share)
        self.law.load(self.contact_of_wall, wall_numbers(options), share)

    @ti.func
    def reset(self, s):
        """Place the spheres of scene s, at rest; the first step takes them to the container."""
        self.bodies.reset_positions(s)
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            self.rotation.reset(i)
        self.effect_activity.clear(s)
        self.search.forget(s)
        self.search.clear(s)
        self.given[s], self.lost[s] = 0.0, -ti.math.inf

    @ti.func
    def advance(self, s, step, motion):
        """Advance the spheres by a step; returns the impulse of their impacts on the container."""
        dt = self.table.dt[s]
        if step == 0:
            self.bodies.board(s, motion)
            self.lost[s] = -ti.math.inf
        if self.bodies.lead[s] != 0.5 * dt:
            self.bodies.advance_lead(s, 0.5 * dt)
            self.search.forget(s)
        floor = motion.x + 0.5 * dt * (motion.v + 0.25 * dt * motion.a)
        low, high = self.bodies.reach_of_walls(floor)
        # Seen from spheres that fall freely, as all that is foreseen of them is their fall.
        speed = motion.v + 0.5 * dt * (motion.a + self.bodies.body[None].gravity)
        self.search.refresh(s, low, high)
        force = self._push(s, step, low, high, speed)
        self._move(s, dt)
        self.given[s] = self.given[s] + dt * force * (motion.v + 0.5 * dt * motion.a)
        self.bodies.floor[s] = motion.x + dt * (motion.v + 0.5 * dt * motion.a)
        return Action(-dt * force, 0.0)

    @ti.func
    def _push(self, s, step, low, high, speed):
        """Add the forces of all contacts; returns the container's force on the spheres [N].

        low, high: where spheres begin to touch walls [m]; speed: of the container as they see it.
        """
        dt = self.table.dt[s]
        contact = self.law.over_step(self.contact_of_pair[None], dt)
        which, count = self.search.find(s, contact.reach)
        self.effect_activity.note(s, PAIRS, step, count)
        self.pair_forces.add(s, contact, which, count)
        self.search.audit(s, step, low, high, contact.reach)
        of_wall = self.law.over_step(self.contact_of_wall[None], dt)
        if ti.static(self.rubs):
            if self.effect_activity.is_new(s, FRICTION):
                rubbing = self.friction_onset.pairs(s, contact, which, count)
                rubbing += self.friction_onset.walls(s, of_wall, low, high, speed)
                self.effect_activity.note(s, FRICTION, step, rubbing)
        force, touching = self.wall_forces.add(s, of_wall, low, high, speed)
        self.effect_activity.note(s, WALLS, step, touching)
        return force

    @ti.func
    def _rub(self, i, j, contact, push, normal, relative, lever):
        """Tangent of two spheres that touch, slip [m/s] and friction [N] of the first along it."""
        tangent = vec2(-normal[1], normal[0])
        slip = self.rotation.slip_of_pair(i, j, lever, relative.dot(tangent))
        return tangent, slip, self.law.friction(contact, push, slip)

    @ti.func
    def _move(self, s, dt):
        """Take the spheres over the step."""
        body = self.bodies.body[None]
        least, most = vec2(ti.math.inf), vec2(-ti.math.inf)
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            velocity = self.bodies.kick(i, body, dt)
            self.rotation.kick(i, dt)
            # Not by ti.min and ti.max: what they do about NaN takes five instructions more.
            least = ti.select(velocity < least, velocity, least)
            most = ti.select(velocity > most, velocity, most)
        self.search.note_motion(s, dt * least, dt * most)

    @ti.func
    def energy(self, s):
        """Kinetic and potential energy and that of the contacts [J]; heights from the floor."""
        total = 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            total += self._own_energy(s, i)
            for j in range(i + 1, self.bodies.last(s)):
                total += self._pair_energy(s, i, j)
        return total

    @ti.func
    def _own_energy(self, s, i):
        """Kinetic and potential energy of a sphere and that of its contacts with walls [J]."""
        body = self.bodies.body[None]
        velocity, place = self.bodies.velocity[i], self.bodies.position_in_box(s, i)
        total = body.mass * (0.5 * velocity.norm_sqr() + body.gravity * place[1])
        total += self.rotation.energy(i)
        room = ti.min(place, vec2(body.width, body.height) - place)
        for axis in ti.static(range(2)):
            total += self.law.stored(self.contact_of_wall[None], body.radius - room[axis])
        return total

    @ti.func
    def _pair_energy(self, s, i, j):
        """Energy of the contact of two spheres [J], none where they do not touch."""
        contact = self.contact_of_pair[None]
        distance = (self.bodies.position_in_box(s, j) - self.bodies.position_in_box(s, i)).norm()
        return self.law.stored(contact, contact.reach - distance)

    @ti.func
    def momentum(self, s):
        """Momentum along x [kg m/s]."""
        total = 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            total += self.bodies.body[None].mass * self.bodies.velocity[i][1]
        return total

    @ti.func
    def divergence_code(self, s):
        """Code of DIVERGENCES, or 0; "not" makes NaN fail a test."""
        body, dt = self.bodies.body[None], self.table.dt[s]
        self.crushed[s], self.held[s] = self.search.crowded(s), 0.0
        contact = self.law.over_step(self.contact_of_pair[None], dt)
        seen = 0
        self.search.each_listed_pair(s, contact, self._note_pair, seen)
        code = ENERGY_GAINED if self._gains(s) else FINE
        if self.crushed[s] > 0:
            code = OVERLAP
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            place, speed = self.bodies.position_in_box(s, i), self.bodies.velocity[i].norm()
            if (place < 0.0).any() or (place > vec2(body.width, body.height)).any():
                code = OVERLAP
            if not (speed * dt < body.radius):
                code = RUNAWAY
            if not (speed < ti.math.inf):
                code = NOT_FINITE
            room = ti.min(place, vec2(body.width, body.height) - place)
            at_wall = ti.cast((room < body.radius).any(), ti.i32)
            going = 0.5 * body.mass * speed * speed
            self.effect_activity.note_sphere(s, at_wall, going, self.rotation.energy(i))
        return code

    @ti.func
    def _gains(self, s):
        """Whether contacts have created a good part of the energy present, which is impossible."""
        body = self.bodies.body[None]
        weight = self.table.particles[s] * body.mass * body.gravity
        energy, highest = self.held[s], 0.0
        for i in range(self.bodies.first(s), self.bodies.last(s)):
            own = self._own_energy(s, i)
            energy += own
            highest = ti.max(highest, own)
        lost = self.given[s] - energy - weight * self.bodies.floor[s]
        gain = ti.max(0.0, self.lost[s] - lost) * (1.0 - _FORGOTTEN)
        self.lost[s] = lost + gain
        return gain > MOST_GAIN * energy + _WALL_IMPULSE_SHARE * highest

    @ti.func
    def _note_pair(self, s, i, j, contact, seen: ti.template()):
        """Note the energy of a pair, and whether it touches or overlaps by half its reach."""
        self.held[s] = self.held[s] + self._pair_energy(s, i, j)
        branch = self.bodies.position[j] - self.bodies.position[i]
        distance = branch.norm()
        if distance < 0.5 * contact.reach:
            self.crushed[s] = 1
        if distance < contact.reach:
            normal = branch * (1.0 / distance)
            relative = self.bodies.velocity[i] - self.bodies.velocity[j]
            approach, overlap, rubbed = relative.dot(normal), contact.reach - distance, 0.0
            push = self.law.normal(contact, overlap, approach)
            if ti.static(self.rubs):
                _, slip, drag = self._rub(i, j, contact, push, normal, relative, 0.5 * distance)
                rubbed = -drag * slip
            dragged = (push - self.law.elastic(contact, overlap)) * approach
            self.effect_activity.note_contact(s, dragged, rubbed)

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """Activity of each of the named effects."""
        return self.effect_activity.uses(effects)

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each of the named effects first acted, infinite if never, (scenes,)."""
        return self.effect_activity.first_steps(effects)

    def audit(self) -> Optional[Audit]:
        """Audit of the contact tests that were skipped; None where all are made."""
        return self.search.found()

    def snapshot(self, s: int) -> dict[str, np.ndarray]:
        """Places and velocities of the spheres of scene s, and their spins [rad/s] if they turn."""
        count = self.table.particles[s]
        rows = slice(s * self.bodies.stride, s * self.bodies.stride + count)
        velocity = values(self.bodies.velocity)[rows]
        position = values(self.bodies.position)[rows] - self.bodies.lead[s] * velocity
        shift = np.array([0.5 * self.bodies.body[None].width, -self.bodies.floor[s]])
        return {"position": position + shift, "velocity": velocity, **self.rotation.snapshot(rows)}
