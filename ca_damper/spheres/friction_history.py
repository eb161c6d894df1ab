"""Friction with tangential history: springs that live as long as their contacts touch.

Cundall and Strack (1979), limited by Coulomb's law; stiffness of Mindlin (1949). As in Thornton,
Cummins and Cleary (2013) a contact that grows keeps its force, one that shrinks loses its share.
"""

import taichi as ti

from ca_damper.spheres.bodies import vec2
from ca_damper.spheres.contacts import PairContacts

#: Walls of a box: two axes, two sides.
_WALLS = 4
_LONG_AGO = -2


@ti.data_oriented
class FrictionHistory:
    """Springs of the contacts of the last step: force [N] and root of the overlap [m^(1/2)].

    recalled: those of present pairs, zero for new ones. wall_spring: at each wall, 2 axis + side.
    """

    def __init__(self, pair_contacts: PairContacts, remembers: bool):
        self.pair_contacts, self.law = pair_contacts, pair_contacts.law
        self.bodies, self.rotation = pair_contacts.bodies, pair_contacts.rotation
        self.remembers, table = remembers, self.bodies.table
        if remembers:
            self.pair, self.pair_count = table.vector(2, ti.i32, "pairs"), table.field(ti.i32)
            self.pair_spring = table.vector(2, ti.f64, "pairs")
            self.recalled = table.vector(2, ti.f64, "pairs")
            self.wall_spring = table.vector(2, ti.f64, "spheres", _WALLS, flat=True)
            self.wall_step = table.field(ti.i32, "spheres", flat=True)
            self.step, self.speed = table.field(ti.i32), table.field(ti.f64)

    @ti.func
    def reset(self, s):
        """Forget all springs of scene s."""
        if ti.static(self.remembers):
            self.pair_count[s], self.step[s], self.speed[s] = 0, _LONG_AGO, 0.0
            for i in range(self.bodies.first(s), self.bodies.last(s)):
                self.wall_step[i] = _LONG_AGO - 1

    @ti.func
    def recall(self, s, listed: ti.template(), which, count):
        """Find the springs of so many pairs of a list, and begin to keep those of this step."""
        k, kept = 0, self.pair_count[s]
        for n in range(count):
            pair, spring = listed[s, which, n], vec2(0.0)
            # Both sides of "and" are evaluated: the place must exist in any case.
            while k < kept and _comes_before(self.pair[s, ti.max(0, ti.min(k, kept - 1))], pair):
                k += 1
            if k < kept:
                if (self.pair[s, k] == pair).all():
                    spring = self.pair_spring[s, k]
            self.recalled[s, n] = spring
        self.pair_count[s] = 0

    @ti.func
    def store_pair(self, s, pair, spring):
        """Keep the spring of a pair that touches."""
        if spring[1] > 0.0:
            k = self.pair_count[s]
            self.pair[s, k], self.pair_spring[s, k] = pair, spring
            self.pair_count[s] = k + 1

    @ti.func
    def at_walls(self, s, i):
        """Prepare the springs of a sphere that touches a wall in this step."""
        if self.wall_step[i] != self.step[s] - 1:
            for wall in ti.static(range(_WALLS)):
                self.wall_spring[i, wall] = vec2(0.0)
        self.wall_step[i] = self.step[s]

    @ti.func
    def leave(self, i, wall):
        """Forget the spring of a sphere at a wall that it does not touch."""
        self.wall_spring[i, wall] = vec2(0.0)

    @ti.func
    def at_wall(self, s, i, wall, contact, overlap, push, slip, tangent):
        """Friction of a sphere at a wall [N]; keeps its spring."""
        # Positions move on by the velocities as they are; slip belongs to the middle of the step.
        kept, lever = self.wall_spring[i, wall], contact.reach - overlap
        relative = self.bodies.velocity[i] - vec2(0.0, self.speed[s])
        way = contact.since * self.rotation.slip_at_wall(i, lever, relative.dot(tangent))
        drag, spring, root = self.force(contact, overlap, push, slip, way, kept[0], kept[1])
        self.wall_spring[i, wall] = vec2(spring, root)
        return drag

    @ti.func
    def force(self, contact, overlap, push, slip, way, spring, last_root):
        """Friction [N] against a slip [m/s], and the spring's force and root from now on."""
        root = ti.sqrt(overlap)
        most = contact.friction * push
        stretched = self._stretched(contact, root, way, spring, last_root)
        dashpot = contact.shear_damping * self.law.dashpot(contact, root)
        damped = (stretched + dashpot * slip) / (1.0 + dashpot * contact.shear_yielding)
        return -_clipped(damped, most), _clipped(stretched, most), root

    @ti.func
    def _stretched(self, contact, root, way, spring, last_root):
        """Force [N] of a spring after a way [m], at the root of the present overlap."""
        held = spring * ti.select(root < last_root, root / last_root, 1.0)
        return held + contact.shear * root * way

    @ti.func
    def _stored(self, contact, overlap, way, spring):
        """Energy [J] and force [N] of a spring after a further way [m], at an overlap [m]."""
        energy, force = 0.0, 0.0
        if overlap > 0.0:
            root, most = ti.sqrt(overlap), contact.friction * self.law.elastic(contact, overlap)
            stretched = self._stretched(contact, root, way, spring[0], spring[1])
            force = _clipped(stretched, most)
            energy = 0.5 * force * force / (contact.shear * root)
        return energy, force

    @ti.func
    def of_pairs(self, s):
        """Energy of the springs of all pairs [J], and the power that they take [W]."""
        # At the time of the velocities, half a step after the force.
        total, power = 0.0, 0.0
        for k in range(self.pair_count[s]):
            i, j = self.pair[s, k][0], self.pair[s, k][1]
            contact = self.pair_contacts.at_rest(s, i, j)
            branch = self.bodies.position_in_box(s, j) - self.bodies.position_in_box(s, i)
            distance, relative = branch.norm(), self.bodies.velocity[i] - self.bodies.velocity[j]
            across = (relative[1] * branch[0] - relative[0] * branch[1]) / distance
            slip = self.rotation.slip_of_pair(s, i, j, distance, across)
            overlap, way = contact.reach - distance, self.bodies.lead[s] * slip
            energy, force = self._stored(contact, overlap, way, self.pair_spring[s, k])
            total, power = total + energy, power + ti.max(0.0, force * slip)
        return total, power

    @ti.func
    def of_walls(self, s, i, contact, above, below):
        """Energy of the springs of a sphere at walls [J]; way left to each wall [m]."""
        total, relative = 0.0, self.bodies.velocity[i] - vec2(0.0, self.speed[s])
        if self.wall_step[i] == self.step[s]:
            for axis in ti.static(range(2)):
                for side in ti.static(range(2)):
                    room = above[axis] if ti.static(side == 0) else below[axis]
                    # As along the tangent of ``WallForces``: of (normal x, y), (-y, x).
                    sign = 1.0 if ti.static((axis == 0) == (side == 1)) else -1.0
                    slip = self.rotation.slip_at_wall(i, room, sign * relative[1 - axis])
                    way = self.bodies.lead[s] * slip
                    spring = self.wall_spring[i, 2 * axis + side]
                    energy, _ = self._stored(contact, contact.reach - room, way, spring)
                    total += energy
        return total


@ti.func
def _comes_before(pair, other):
    """Whether a pair comes before another in the order of the search."""
    return pair[0] < other[0] or (pair[0] == other[0] and pair[1] < other[1])


@ti.func
def _clipped(force, most):
    """A force within -most and most."""
    low = ti.select(force < most, force, most)
    return ti.select(low > -most, low, -most)
