"""Numbers drawn at random for a scene: ordinary ones, and now and then what nobody can mean."""

import numpy as np

#: Given in place of a number to a scene that is drawn to be spoilt.
IMPOSSIBLE = (float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e-300, 1e300, "1", None, True)
#: Share of the scenes that are spoilt, and of their numbers that are.
SPOILT, IN_VAIN = 0.1, 0.1


class Draws:
    """Random numbers of one scene; the same seed draws the same.

    width: decades by which numbers leave their usual values, of this scene.
    """

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.spoilt = self.chance(SPOILT)
        self.width = self.one_of(0.0, 0.1, 0.3, 1.0, 3.0)

    def chance(self, share):
        """Whether something happens in a share of the cases."""
        return bool(self.rng.random() < share)

    def one_of(self, *things):
        """One of several things, all alike."""
        return things[self.rng.integers(len(things))]

    def power(self, low, high):
        """A number from 10^low to 10^high, even in its logarithm."""
        return float(10.0 ** self.rng.uniform(low, high))

    def given(self, value):
        """A value as the user gives it, in a spoilt scene now and then an impossible one."""
        if self.spoilt and self.chance(IN_VAIN):
            return self.one_of(*IMPOSSIBLE)
        return value

    def near(self, usual, may_vanish=False):
        """A number some decades about the usual one; may_vanish: or zero."""
        if may_vanish and self.chance(0.15):
            return self.given(0.0)
        return self.given(float(usual * 10.0 ** (self.width * self.rng.standard_normal())))

    def whole(self, low, high):
        """A whole number from low to high."""
        return self.given(int(self.rng.integers(low, high + 1)))

    def vector(self, size):
        """A vector in any direction of some length."""
        way = self.rng.standard_normal(3)
        return size * way / np.linalg.norm(way)
