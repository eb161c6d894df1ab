"""Which bonds have reached the limits of their laws: the others are linear, to the bit.

A unit whose bond never came near a limit has the traction stiffness times opening, so its law and
the law's memory are not touched. A law declares by ``begins`` where a unit comes near.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import NEVER

#: Columns of the two laws of a bond.
SOFTENING, SLIP = range(2)
#: Tick after all others, for what has not begun.
LATER = 1 << 62


@ti.data_oriented
class Activity:
    """Laws that act on each bond: since when, and how often they were evaluated.

    since: tick at which a unit of a bond first came near the limit of its normal and of its shear
    law, NEVER before. evaluated: evaluations of these laws, units of a bond together. touched:
    tick from which contact and friction acted on each body, LATER before.
    """

    def __init__(self, tables: Tables):
        self.tables, bonds = tables, tables.capacity.bonds
        self.laws = (not tables.tension.is_null, not tables.shear.is_null)
        self.since = ti.Vector.field(2, ti.i64, shape=bonds)
        self.evaluated = ti.Vector.field(2, ti.i64, shape=bonds)
        self.touched = ti.Vector.field(2, ti.i64, shape=tables.capacity.bodies)

    def load(self, model: Model) -> None:
        """Begin with no bond near a limit; all fields are zero before."""
        assign(self.since, np.full((model.bond_count, 2), NEVER))
        assign(self.touched, np.full((model.body_count, 2), LATER))

    @ti.func
    def is_active(self, b, law: ti.template(), begins, tick):
        """Whether a law of bond b must be evaluated; begins: nonzero near its limit, at a tick."""
        active = self.since[b][law] >= 0
        if not active and begins != 0:
            self.since[b][law] = tick
            active = True
        if active:
            self.evaluated[b][law] = self.evaluated[b][law] + 1
        return active

    @ti.func
    def note_touch(self, i, bits, tick):
        """Note when contact and friction, given as bits, first act on body i."""
        if bits & ti.i64(CONTACT) != 0:
            ti.atomic_min(self.touched[i][0], tick)
        if bits & ti.i64(RUBBED) != 0:
            ti.atomic_min(self.touched[i][1], tick)

    @ti.func
    def has_begun(self, b, law: ti.template()):
        """Whether a law has ever been evaluated for bond b."""
        return self.since[b][law] >= 0
