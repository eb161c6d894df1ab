"""Counts of events by rule of the automaton."""

import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_usage import EffectUse

PAIRS, WALLS, PUSHES, HOLDS = range(4)
#: Counted events by the effect that they belong to.
_COUNTED = {
    "pairs": (PAIRS, "pairs met"),
    "landing": (WALLS, "blows to walls"),
    "ejection": (PUSHES, "particles pushed along"),
    "static contact": (HOLDS, "particles came to rest"),
}


@ti.data_oriented
class EventCounts:
    """Events since the reset, shape (scenes, kinds of event)."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.events = table.field(ti.i64, HOLDS + 1)

    @ti.func
    def clear(self, s):
        """Nothing has happened yet."""
        for kind in range(HOLDS + 1):
            self.events[s, kind] = ti.cast(0, ti.i64)

    @ti.func
    def note(self, s, kind):
        """Count one event."""
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.events[s, kind] = self.events[s, kind] + 1

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """An EffectUse for each named effect that is an event, over all scenes.

        The automaton keeps no account of energy: what it does steers.
        """
        total = self.table.in_use(self.events).sum(axis=0)
        found = [(name, *_COUNTED[name]) for name in effects if name in _COUNTED]
        return tuple(EffectUse(name, what, int(total[k]), steers=True) for name, k, what in found)
