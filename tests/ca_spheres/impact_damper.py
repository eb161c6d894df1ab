"""Cases of the impact damper with a stable motion, and with blows that last."""

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from ca_damper import ImpactDamper, Oscillator, Spheres
from ca_damper.spheres.contact_law import damping_number, wall_numbers

DIAMETER = 6e-3
PAPER = Oscillator()


class Case(ImpactDamper):
    """An impact damper in the container of the paper, and what a run by spheres needs of it."""

    def filling(self, **options):
        """The grain."""
        same = {"particle_mass": self.particle_mass, "wall_restitution": self.restitution}
        box = {"diameter": DIAMETER, "height": self.clearance + DIAMETER}
        return Spheres(gravity=0.0, **same, **box, **options)

    def lasting(self, u):
        """The case with blows that last as those of a sphere do, and the speed in it.

        A blow that lasts is like a sudden one at a wall that lies deeper: where the lines of the
        grain before and after it cross, as seen from the wall.
        """
        case, alone = self, u
        for _ in range(5):
            deeper = sudden_depth(self, alone * (1.0 - self.approach))
            case = replace(self, clearance=self.clearance + 2.0 * deeper)
            alone = min(case.speeds, key=lambda one: abs(one - u))
        return case, alone


def sudden_depth(case, speed):
    """Depth [m] at which a sudden blow at a speed [m/s] would turn the grain over as it is turned.

    The blow in units of D = (m v^2 / k)^(2/5) and of D / v (see ``restitution``): it ends where the
    force has fallen to zero, at the overlap d, after the time t, and the line back from there,
    d - e (t' - t) = t', meets the line of the approach at (d + e t) / (1 + e).
    """
    alpha = damping_number(case.restitution, 0.25)

    def force(overlap, rate):
        depth = max(overlap, 0.0)
        return depth**1.5 + alpha * depth**0.25 * rate

    def parting(t, y):
        return force(*y) if t > 0.1 else 1.0

    parting.terminal = True
    rates = (lambda t, y: [y[1], -max(0.0, force(*y))], (0.0, 20.0), [0.0, 1.0])
    blow = solve_ivp(*rates, events=parting, rtol=1e-9, atol=1e-12)
    (time,), (overlap, _) = blow.t_events[0], blow.y_events[0][0]
    stiffness = wall_numbers(case.filling())["stiffness"]
    unit = (case.particle_mass / (1.0 + case.mass_ratio) * speed**2 / stiffness) ** 0.4
    return unit * (overlap + case.restitution * time) / (1.0 + case.restitution)


def drawn(count, seed):
    """Cases with a motion that is possible and stable, and the grain's speed in it."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        ratio, e = rng.uniform(0.02, 0.1), rng.uniform(0.3, 0.75)
        clearance, frequency = rng.uniform(6e-3, 40e-3), rng.uniform(0.97, 1.03) * 6.0288
        case = Case(PAPER, ratio * PAPER.mass, e, clearance, frequency)
        good = [u for u in case.speeds if case.is_possible(u) and abs(case.multipliers(u)[0]) < 0.9]
        found += [(case, u) for u in good[:1]]
    return found
