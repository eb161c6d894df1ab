"""Balance of the momentum along x that no counted impulse carries.

Six directions cannot hold every momentum: gravity acts on oblique flights by its projection only,
a random deflection turns momentum out of its line, and an accounting leaves some blows out.
Sums are integers, so that no order of execution reaches their bits.
"""

import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields

#: Unit of sums of velocities [m/s]; 2^-40 leaves room for 8 million m/s in an i64.
QUANTUM = 2.0**-40
ITEMS = ("gravity", "pairs", "ejections", "rest")
GRAVITY, PAIRS, EJECTIONS, REST = range(4)
_COUNT = len(ITEMS)


@ti.func
def quanta(velocity):
    """A velocity [m/s] as a whole number of quanta."""
    return ti.cast(ti.floor(velocity / QUANTUM + 0.5), ti.i64)


@ti.data_oriented
class ImpulseBalance:
    """Velocity along x that particles gained uncounted since the reset, by item [quanta]."""

    active = True

    def __init__(self, table: SceneFields):
        self.velocity_gain = table.field(ti.i64, _COUNT)

    @ti.func
    def clear(self, s):
        """Reset."""
        for item in range(_COUNT):
            self.velocity_gain[s, item] = ti.cast(0, ti.i64)

    @ti.func
    def add(self, s, item: ti.template(), velocity):
        """Enter a gain in velocity along x [m/s]."""
        self.velocity_gain[s, item] = self.velocity_gain[s, item] + quanta(velocity)


@ti.data_oriented
class NoImpulseBalance:
    """Nothing is written down."""

    active = False

    @ti.func
    def clear(self, s):
        """Nothing to clear."""

    @ti.func
    def add(self, s, item: ti.template(), velocity):
        """Nothing is entered."""
