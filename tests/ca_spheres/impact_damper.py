"""The impact damper in closed form: one grain that meets floor and ceiling in turn.

Masri (1970), Bapat and Sankar (1985): no gravity, two symmetric blows a cycle of the base.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from ca_damper import Oscillator, Spheres
from ca_damper.spheres.contact_law import wall_numbers
from ca_damper.spheres.restitution import damping_number

DIAMETER = 6e-3
PAPER = Oscillator()


class ImpactDamper:
    """A grain of ratio x the container's mass, with a clearance [m], at a frequency [Hz].

    The motion turns over in half a cycle, x(t + T/2) = -x(t), and obeys the linear equation of the
    empty container but for the impulses +J at t = 0 (ceiling) and -J at T/2 (floor).

    Response to the impulses: x = J q(t), free motion with q'(0+) = q'(0-) + 1 / M, q(T/2) = -q(0)
    and q'(T/2) = -q'(0-): two linear equations for q(0) and q'(0+). The grain leaves the ceiling at
    -u and the floor at u, so J = 2 m u. It meets the ceiling at x0 = x(0) and the floor at -x0, D
    lower: u T / 2 = D + 2 x0, D the clearance. With v = x'(0-), restitution asks for
    (v + J / M) + u = e (u - v), so v = u (e - 1 - 2 m / M) / (1 + e).
    Forced motion X sin(w t + phase): X sin(phase) = x0 - J q(0), w X cos(phase) = v - J q'(0-);
    squares add up to X^2: a quadratic equation for u. speeds: its positive roots.
    """

    def __init__(self, ratio, restitution, clearance, frequency):
        self.ratio, self.e, self.clearance, self.frequency = (
            ratio,
            restitution,
            clearance,
            frequency,
        )
        self.omega, self.half = 2.0 * math.pi * frequency, 0.5 / frequency
        self.mass, self.transfer = ratio * PAPER.mass, PAPER.transfer(frequency)
        self.rest = np.linalg.solve(self.free(self.half) + np.eye(2), [0.0, 1.0 / PAPER.mass])
        self.by = (restitution - 1.0 - 2.0 * ratio) / (1.0 + restitution)
        before = self.rest - [0.0, 1.0 / PAPER.mass]
        a = 0.5 * self.half - 2.0 * self.mass * before[0]
        b = (self.by - 2.0 * self.mass * before[1]) / self.omega
        self.lines = np.array([[a, -0.5 * clearance], [b, 0.0]])
        size = PAPER.base_amplitude * abs(self.transfer)
        square = [a * a + b * b, -a * clearance, 0.25 * clearance * clearance - size * size]
        self.speeds = [r.real for r in np.roots(square) if abs(r.imag) < 1e-12 and r.real > 0.0]

    def free(self, t):
        """Matrix that takes (x, v) of the container a time t on, without forces."""
        decay, square = 0.5 * PAPER.damping / PAPER.mass, PAPER.stiffness / PAPER.mass
        own = math.sqrt(square - decay * decay)
        c, s = math.cos(own * t), math.sin(own * t) / own
        return math.exp(-decay * t) * np.array([[c + decay * s, s], [-square * s, c - decay * s]])

    def motion(self, u, t):
        """(x, v) of the container a time t after the blow of a grain of speed u on the ceiling."""
        sine, cosine = self.lines @ [u, 1.0]
        c, s = math.cos(self.omega * t), math.sin(self.omega * t)
        forced = np.array([sine * c + cosine * s, self.omega * (cosine * c - sine * s)])
        return forced + 2.0 * self.mass * u * self.free(t) @ self.rest

    def start(self, u):
        """(x, v) of the container and of the grain as the base passes zero upwards.

        The phase of the forced motion is then that of the transfer function. The middle of the box
        is at x, and the grain's place counts from where the middle is at x = 0.
        """
        sine, cosine = self.lines @ [u, 1.0]
        since = (np.angle(self.transfer) - math.atan2(sine, cosine)) / self.omega
        t = since % self.half
        sign = 1.0 if round((since - t) / self.half) % 2 == 0 else -1.0
        return sign * np.array([self.motion(u, t), [0.5 * u * self.half - u * t, -u]])

    def is_possible(self, u):
        """Whether the grain flies from wall to wall without another blow."""
        places = [
            0.5 * u * self.half - u * t - self.motion(u, t)[0]
            for t in np.linspace(0.0, self.half, 201)
        ]
        return bool(np.abs(places).max() < 0.5 * self.clearance + 1e-9)

    def is_stable(self, u):
        """Whether small changes die out: the map from blow to blow has eigenvalues below 0.9.

        Changed are x, v of the container after a blow, the speed of the grain, and the time of the
        blow; the map is taken by differences of the exact motion.
        """
        state = np.array([*self.motion(u, 0.0), -u, 0.0])
        assert np.abs(self.next_blow(u, state) - state).max() < 1e-9
        columns = [
            (self.next_blow(u, state + step) - self.next_blow(u, state - step)) / (2.0 * step.sum())
            for step in np.diag([1e-7, 1e-6, 1e-6, 1e-7])
        ]
        return bool(np.abs(np.linalg.eigvals(np.array(columns))).max() < 0.9)

    def next_blow(self, u, state):
        """State after the next blow, turned over; its time by Newton's method."""
        x, v, grain, begin = state
        gap, t = np.array([x, v]) - self.motion(u, begin), self.half
        for _ in range(8):
            place, speed = self.motion(u, t) + self.free(t - begin) @ gap
            t -= (x + grain * (t - begin) - place + self.clearance) / (grain - speed)
        change = (1.0 + self.e) * (grain - speed) / (1.0 + self.ratio)
        return np.array([-place, -speed - self.ratio * change, change - grain, t - self.half])

    def rms(self, u):
        """RMS of x over a cycle, by Simpson's rule."""
        squares = [self.motion(u, t)[0] ** 2 for t in np.linspace(0.0, self.half, 401)]
        return math.sqrt(
            (4.0 * sum(squares[1::2]) + 2.0 * sum(squares[2:-1:2]) + squares[0] + squares[-1])
            / 1200.0
        )

    def filling(self, **options):
        """The grain."""
        same = {"particle_mass": self.mass, "wall_restitution": self.e, "diameter": DIAMETER}
        return Spheres(gravity=0.0, height=self.clearance + DIAMETER, **same, **options)

    def lasting(self, u):
        """The case with blows that last as those of a sphere do, and the speed in it.

        A blow that lasts is like a sudden one at a wall that lies deeper: where the lines of the
        grain before and after it cross, as seen from the wall.
        """
        case, alone = self, u
        for _ in range(5):
            deeper = sudden_depth(self, alone * (1.0 - self.by))
            case = ImpactDamper(self.ratio, self.e, self.clearance + 2.0 * deeper, self.frequency)
            alone = min(case.speeds, key=lambda one: abs(one - u))
        return case, alone


def sudden_depth(case, speed):
    """Depth [m] at which a sudden blow at a speed [m/s] would turn the grain over as it is turned.

    The blow in units of D = (m v^2 / k)^(2/5) and of D / v (see ``restitution``): it ends where the
    force has fallen to zero, at the overlap d, after the time t, and the line back from there,
    d - e (t' - t) = t', meets the line of the approach at (d + e t) / (1 + e).
    """
    alpha = damping_number(case.e, 0.25)

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
    unit = (case.mass / (1.0 + case.ratio) * speed**2 / stiffness) ** 0.4
    return unit * (overlap + case.e * time) / (1.0 + case.e)


def drawn(count, seed):
    """Cases with a motion that is possible and stable, and the grain's speed in it."""
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        ratio, e = rng.uniform(0.02, 0.1), rng.uniform(0.3, 0.75)
        clearance, frequency = rng.uniform(6e-3, 40e-3), rng.uniform(0.97, 1.03) * 6.0288
        case = ImpactDamper(ratio, e, clearance, frequency)
        good = [u for u in case.speeds if case.is_possible(u) and case.is_stable(u)]
        found += [(case, u) for u in good[:1]]
    return found
