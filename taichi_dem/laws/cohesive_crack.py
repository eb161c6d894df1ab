"""Cohesive law of bonds whose cracks cost the energy of their plane, whatever faces they follow.

Tractions of a unit without damage, t = (k_n x, k_s s): opening x, sliding s, pressure p on it;
r = t_n / |t| is the inclination of its face to the crack. docs/decisions/034 derives the law.
"""

import taichi as ti

from taichi_dem.kit.products import dot, norm, squared
from taichi_dem.kit.types import vec2, vec3
from taichi_dem.laws.base import NEAR
from taichi_dem.laws.damage import DamageLaw
from taichi_dem.materials import Material
from taichi_dem.state.tables import Capacity

#: Softening in two lines (Petersson): where they meet and end, as shares of the way to the end of
#: one line of the same area, and the traction where they meet, as a share of the strength.
_KINK, _END, _AT_KINK = 0.4, 1.8, 1.0 / 3.0
_FIRST, _SECOND = (1.0 - _AT_KINK) / _KINK, _AT_KINK / (_END - _KINK)
#: Least of what failure spends over what a unit holds at its onset.
_LEAST_SPENT = 1.0 + 2.0**-20


@ti.data_oriented
class CohesiveCrack(DamageLaw):
    """Bonds of rock and concrete: a crack spends G_f per area of its plane, not of its faces.

    Replaces ``Softening`` and ``ShearSlip``.

    Notes
    -----
    Under tension a face begins to open where the stress along the traction reaches the tensile
    strength, whatever way it is turned, and spends the fracture energy per area across the
    traction. Opening and sliding soften with one damage, along two lines. Pressed faces slide
    beyond the cohesion and friction of the material, soften likewise, and rub once they are
    damaged. In pure sliding a unit spends G_f (k_n / k_s) (c / f_t)^2, which makes it as brittle as
    in tension. Unloading goes to the origin. A face goes with two of its units, one not pressed.

    References
    ----------
    Petersson, Report TVBM-1006, Lund (1981); Alfano and Sacco, IJNME 68 (2006) 542.
    """

    may_be_silent = True

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Squares of strength and cohesion, the least of any mode [Pa^2]; friction; 2 G [J/m^2]."""
        strength, cohesion = material.tensile_strength**2, material.cohesion**2
        # Least of (1 - w) strength + w^8 cohesion for w from 0 to 1.
        w = min(1.0, (strength / max(8.0 * cohesion, strength)) ** (1.0 / 7.0))
        least = (1.0 - w) * strength + w**8 * cohesion
        return strength, cohesion, NEAR * least, material.friction, 2.0 * material.fracture_energy

    def declare(self, capacity: Capacity) -> None:
        """Damage [-], energy spent [J/m^2], direction or reach [-], residual slip [m] of units."""
        self.unit = ti.Vector.field(3, ti.f64, shape=capacity.units)
        # By itself: every unit is asked for it at every step.
        self.slip = ti.Vector.field(2, ti.f64, shape=capacity.units)

    @ti.func
    def _driving(self, m, stiffness, jump):
        """Squares of the tractions that open, and that slide beyond friction [Pa^2]."""
        opening = stiffness[0] * ti.max(0.0, jump[0])
        across = stiffness[1] * norm(vec2(jump[1], jump[2]))
        rubbing = self.law[m, 3] * (stiffness[0] * ti.max(0.0, -jump[0]))
        sliding = ti.max(0.0, across - rubbing)
        return opening * opening, sliding * sliding

    @ti.func
    def _limits(self, m, stiffness, direction):
        """Twice the elastic energy at which damage begins, and twice what failure spends."""
        w = 1.0 - direction * direction
        w2 = w * w
        w4 = w2 * w2
        ratio = stiffness[0] / stiffness[1]
        strength = self.law[m, 0] * (1.0 - w) + self.law[m, 1] * (w4 * w4)
        begin = strength * ((1.0 - w) / stiffness[0] + w / stiffness[1])
        shear = ratio * self.law[m, 1] / self.law[m, 0]
        end = self.law[m, 4] * (direction + (w4 * w4 * w4) * shear)
        return begin, ti.max(end, _LEAST_SPENT * begin)

    @ti.func
    def _may_begin(self, m, stiffness, jump):
        """Whether a traction is beyond the least limit of any direction: almost none is."""
        opening, push = stiffness[0] * ti.max(0.0, jump[0]), stiffness[1]
        size = opening * opening + push * push * squared(vec2(jump[1], jump[2]))
        return size > self.law[m, 2]

    @ti.func
    def begins(self, m, stiffness, jump):
        """1 where an intact unit comes near its limit at a jump [m], else 0."""
        near = 0
        if self._may_begin(m, stiffness, jump):
            opening, sliding = self._driving(m, stiffness, jump)
            begin, _ = self._limits(m, stiffness, _direction(opening, sliding))
            energy = opening / stiffness[0] + sliding / stiffness[1]
            near = ti.cast(energy > NEAR * begin, ti.i32)
        return near

    @ti.func
    def traction(self, m, u, stiffness, jump):
        """Traction [Pa] at a jump [m], and energy per area slipped away now [J/m^2]."""
        traction, slipped = vec3(stiffness[0], stiffness[1], stiffness[1]) * jump, 0.0
        if self.unit[u][0] > 0.0 or self._may_begin(m, stiffness, jump):
            traction, slipped = self._softened(m, u, stiffness, jump)
        return traction, slipped

    @ti.func
    def _softened(self, m, u, stiffness, jump):
        """The same of a unit that is damaged, or may be from now on."""
        before = self.unit[u]
        first = _slip(before, self.slip[u])
        unit = self._damaged(m, before, stiffness, jump)
        normal, sliding, slipped = stiffness[0] * jump[0], vec2(jump[1], jump[2]), 0.0
        shear = stiffness[1] * sliding
        if unit[0] > 0.0:
            pressure = ti.max(0.0, -normal)
            slip = _rubbed(stiffness[1], self.law[m, 3] * pressure, sliding, first)
            if normal > 0.0:
                normal *= 1.0 - unit[0]
            else:
                slipped = _slipped(stiffness[1], sliding, before, unit, first, slip)
            shear = stiffness[1] * (sliding - unit[0] * slip)
            self.unit[u], self.slip[u] = unit, unit[0] * slip
        return vec3(normal, shear[0], shear[1]), slipped

    @ti.func
    def _damaged(self, m, unit, stiffness, jump):
        """Damage, energy spent and direction of a unit at a jump, with its slip as before."""
        opening, sliding = self._driving(m, stiffness, jump)
        direction = _direction(opening, sliding)
        if direction > 0.0 and unit[2] > 0.0:
            # The jump turns into the normal while a crack opens; the plane of the crack does not.
            direction = ti.min(direction, unit[2])
        begin, end = self._limits(m, stiffness, direction)
        energy = opening / stiffness[0] + sliding / stiffness[1]
        if energy > begin:
            steep = end / begin - 1.0
            size = ti.sqrt(energy / begin)
            damage = 1.0 - _traction((size - 1.0) / steep) / size
            if damage > unit[0]:
                spent = begin * (_spent(damage, steep) - _spent(unit[0], steep))
                unit[0], unit[1] = damage, unit[1] + spent
                if damage >= 1.0:
                    unit[2] = size / (1.0 + _END * steep)
                elif direction > 0.0:
                    unit[2] = direction
        return unit

    @ti.func
    def failed(self, m, u, traction):
        """1 once a unit without damage left to take is not pressed, and another one is as far."""
        whole = ti.cast(0, ti.i32)
        if self.unit[u][0] >= 1.0 and traction[0] >= 0.0:
            for q in range(3):
                whole += ti.cast(self.unit[u - u % 3 + q][0] >= 1.0, ti.i32)
        return ti.cast(whole > 1, ti.i32)

    @ti.func
    def stored(self, m, u, stiffness, jump):
        """Elastic energy per area of opening and of sliding [J/m^2]."""
        unit, sliding = self.unit[u], vec2(jump[1], jump[2])
        left = 1.0 - unit[0]
        normal = 0.5 * stiffness[0] * jump[0] * jump[0]
        rubbing = unit[0] * squared(sliding - _slip(unit, self.slip[u]))
        if jump[0] > 0.0:
            normal *= left
            rubbing *= 0.0
        return normal, 0.5 * stiffness[1] * (left * squared(sliding) + rubbing)

    @ti.func
    def residual_slip(self, m, u):
        """Sliding that stays when the traction is gone, in the face frame [m]."""
        return self.slip[u]


@ti.func
def _slip(unit, residual):
    """Slip of the damaged part of a unit [m], whose share is its residual slip."""
    return residual / ti.max(unit[0], 1e-300)


@ti.func
def _direction(opening, sliding):
    """Normal share of a driving traction, from the squares of its parts."""
    return ti.sqrt(opening / ti.max(opening + sliding, 1e-300))


@ti.func
def _traction(past):
    """Traction over the strength; past: jump beyond the onset, 1 where one line would end."""
    return ti.max(0.0, 1.0 - _FIRST * past, _SECOND * (_END - past))


@ti.func
def _spent(damage, steep):
    """Energy spent at a damage, over twice that held at onset; steep: end / begin - 1."""
    left = 1.0 - damage
    first = damage / (_FIRST + left * steep)
    way = ti.max(first, (_SECOND * _END - left) / (_SECOND + left * steep))
    below = way - 0.5 * _FIRST * way * way
    if way > _KINK:
        rest = _END - way
        below = 0.5 - 0.5 * _SECOND * rest * rest
    size = 1.0 + way * steep
    return 0.5 + steep * below - 0.5 * left * size * size


@ti.func
def _rubbed(stiffness, limit, sliding, slip):
    """Slip [m] after which the damaged part of a unit carries at most a limit [Pa]."""
    elastic = sliding - slip
    reach = stiffness * norm(elastic)
    if reach > limit:
        slip += elastic * ((reach - limit) / reach)
    return slip


@ti.func
def _slipped(stiffness, sliding, before, unit, first, last):
    """Energy per area [J/m^2] of a pressed unit that slip takes, beside what damage spends.

    first, last: slip of its damaged part [m]. The traction is stiffness (sliding - r), r = damage
    slip: the work of r at the mean traction, less what elastic parts hold against each other.
    """
    way = unit[0] * last - before[0] * first
    work = stiffness * dot(sliding - before[0] * first - 0.5 * way, way)
    held = 0.5 * stiffness * (_apart(unit[0], last) - _apart(before[0], first))
    return work - held - (unit[1] - before[1])


@ti.func
def _apart(damage, slip):
    """Square of the slip by which the parts of a unit pull against each other [m^2]."""
    return damage * (1.0 - damage) * squared(slip)
