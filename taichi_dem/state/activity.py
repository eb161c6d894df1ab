"""Which bonds have reached a limit of their law: the others are linear, to the bit.

A unit whose bond never came near a limit has the traction stiffness times opening, so the law and
its memory are not touched. A law says by ``begins`` where a unit comes near.
"""

import numpy as np
import taichi as ti

from taichi_dem.kit.allocation import assign
from taichi_dem.physics.sphere_pair import CONTACT, RUBBED
from taichi_dem.state.model import Model
from taichi_dem.state.tables import Tables
from taichi_dem.state.timeline import NEVER

#: Parts of a bond's law, by the bits of ``begins``.
PARTS = 2
#: Tick after all others, for what has not begun.
LATER = 1 << 62


@ti.data_oriented
class Activity:
    """Where the law of a bond acts: since when, and how often it was evaluated.

    since: tick at which a unit of a bond first came near the limit of each part of its law, NEVER
    before. evaluated: evaluations of the law, units of a bond together. touched: tick from which
    contact and friction acted on each body, LATER before.
    """

    def __init__(self, tables: Tables):
        self.tables, bonds = tables, tables.capacity.bonds
        self.since = ti.Vector.field(PARTS, ti.i64, shape=bonds)
        self.evaluated = ti.field(ti.i64, shape=bonds)
        self.touched = ti.Vector.field(2, ti.i64, shape=tables.capacity.bodies)

    def load(self, model: Model) -> None:
        """Begin with no bond near a limit; all fields are zero before."""
        assign(self.since, np.full((model.bond_count, PARTS), NEVER))
        assign(self.touched, np.full((model.body_count, 2), LATER))

    @ti.func
    def is_active(self, b, near, tick):
        """Whether the law of bond b must be evaluated; near: bits of parts near a limit now."""
        since = self.since[b]
        active = since[0] >= 0 or since[1] >= 0
        for part in ti.static(range(PARTS)):
            if since[part] < 0 and near & (1 << part) != 0:
                self.since[b][part] = tick
                active = True
        if active:
            self.evaluated[b] = self.evaluated[b] + 1
        return active

    @ti.func
    def note_touch(self, i, bits, tick):
        """Note when contact and friction, given as bits, first act on body i."""
        if bits & ti.i64(CONTACT) != 0:
            ti.atomic_min(self.touched[i][0], tick)
        if bits & ti.i64(RUBBED) != 0:
            ti.atomic_min(self.touched[i][1], tick)
