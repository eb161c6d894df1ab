"""A run of a hard case of the blast: methods by name, bodies, and the limits that many share."""

import numpy as np

from taichi_dem import CONCRETE, Scene, Simulation, StepControl, effects
from taichi_dem.methods import ImplicitDashpots, Multirate, Uniform
from taichi_dem.simulate import run_simulation
from tests.closed_forms import damped_opening
from tests.motion_record import MotionRecord

EPS = np.finfo(float).eps
SAMPLES = 40
#: By how much a method that claims a case may miss what it has to converge to, as a share.
ACCURACY = 0.01
#: Edge of most bodies [m], the area of their faces [m^2], and their mass [kg].
EDGE = 0.05
AREA = 0.25 * 3.0**0.5 * EDGE**2
MASS = CONCRETE.density * EDGE**3 / (6.0 * 2.0**0.5)
X = np.array([1.0, 0.0, 0.0])
#: Methods of bodies that nothing touches.
FREE = {
    "uniform": Uniform(1e-7),
    "multirate_held": Multirate(1e-7, 1e-5),
    "multirate_drifted": Multirate(1e-7, 1e-5, "drifted"),
    "controlled": Multirate(1e-7, 1e-5, control=StepControl()),
    "limited": Uniform(1e-7, dashpot="limited"),
    "implicit": ImplicitDashpots(4e-7),
}
#: Steps that bear contact of bodies of 35 g; those of the paper's rule do by their largest step.
TOUCHING = {
    "uniform": Uniform(4e-10),
    "multirate_held": Multirate(4e-10, 1e-8),
    "multirate_drifted": Multirate(4e-10, 1e-8, "drifted"),
    "controlled": Multirate(
        8e-8, 1e-6, control=StepControl(dashpot_floor=1e-8, level_jump=None), dashpot="limited"
    ),
    "limited": Uniform(2e-8, dashpot="limited"),
    "implicit": ImplicitDashpots(4e-7, sweeps=(2, 50), tolerance=1e-3),
}


class Run(MotionRecord):
    """The bodies of a mesh by the method of a trial, and limits on what they did.

    velocity [m/s], shift [m] and spin [rad/s] at the start are broadcast to all bodies. bodies:
    which are judged. until: [s], by default that of cases with contact. scene: options of
    ``Scene``, by default concrete with all effects but loads, whose bodies touch at all free faces.
    dt: largest step [s]; steps: how many of them. result: of the run.
    """

    def __init__(
        self, trial, mesh, until=None, *, methods=TOUCHING, bodies=slice(None), velocity=0.0,
        shift=0.0, spin=0.0, **scene,
    ):  # fmt: skip
        super().__init__(bodies)
        method = methods[trial.method]
        bonds = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
        usual = [*bonds, effects.BodyContact(), effects.StickingFriction()]
        scene = Scene(mesh, **{"material": CONCRETE, "effects": usual, **scene})
        simulation = Simulation(scene, method)
        place = simulation.model.centre + shift
        simulation.state.set_motion(place, velocity=velocity, spin=spin)
        looks = {"samples": SAMPLES, "progress": None, "observers": [self]}
        soon = 2e-5 if trial.quick else 1e-4
        self.result = run_simulation(simulation, until=until or soon, **looks)
        trial.compile_s += simulation.compile_seconds
        trial.warnings += simulation.step_resolution.findings()
        self.trial, self.dt, self.steps = trial, method.dt0, self.time_s[-1] / method.dt0

    def draw(self, ylabel, y):
        """Draw a quantity over time."""
        self.trial.draw("time [µs]", 1e6 * self.time_s, ylabel, y)

    def energy(self):
        """Kinetic energy over that at the start, which is drawn."""
        share = self.kinetic_energy / self.kinetic_energy[0]
        self.draw("kinetic energy / given [1]", share)
        return share

    def nothing_made(self):
        """Momentum is kept, and kinetic energy never exceeds what there was at the start."""
        self.momentum_kept()
        rise, formula = self.energy().max() - 1.0, "kinetic <= kinetic at the start"
        self.trial.limit("kinetic energy above what was there", rise, 1e-3, formula)

    def momentum_kept(self):
        """Pair impulses cancel bit for bit; sums of them round, and so does every body's place."""
        place = abs(self["position"]).max() / EDGE
        bound = EPS * (100.0 * self.steps**0.5 + self.steps * place)
        formula = "100 eps sqrt(n) + n eps place / size"
        self.trial.limit("momentum error", self.momentum_error(EDGE), bound, formula)

    def flies_straight(self, share=0.5, formula="n steps x eps / 2 x place"):
        """Every addition rounds a place by a share of its last digit at most."""
        off = abs(self.moved - self["velocity"][0] * self.time_s[:, None, None])
        steps = self.steps * 2.0 ** self["level"].max()
        bound = share * steps * EPS * abs(self["position"]).max()
        self.trial.limit("off its path [m]", off, bound, formula)

    def stays(self):
        """Nothing moves, to the bit."""
        moved = abs(self.moved).max(axis=(1, 2))
        self.trial.limit("displacement [m]", moved, 0.0, "nothing acts")
        self.draw("displacement [m]", moved)

    def converged(
        self, name, found, true, scale, bound=ACCURACY, formula="1 % of the exact solution"
    ):
        """Largest distance of what was found from what it has to converge to, over a scale."""
        self.trial.limit(name, abs(np.asarray(found) - true) / scale, bound, formula)

    def gap(self, opening=0.0):
        """Distance of body 1 from body 0 along x beyond that of the mesh [m], drawn."""
        gap = opening + self.moved[:, 1, 0] - self.moved[:, 0, 0]
        self.draw("opening [µm]", 1e6 * gap)
        return gap

    def exact_gap(self, opening, speed=0.0, area=AREA):
        """Opening [m] of a bonded pair over time; opening [m], speed [m/s]: at the start."""
        laws = area * CONCRETE.normal_stiffness, area * CONCRETE.normal_damping
        return damped_opening(0.5 * self.mass[0], *laws, opening, speed, self.time_s)

    def eases(self, opening, area=AREA):
        """A pair pulled by an opening [m] eases as the damped oscillator that it is."""
        true = self.exact_gap(opening, area=area)
        self.converged("error of the opening / first", self.gap(opening), true, opening)


def apart(opening, others=0):
    """Displacements of a pair that is opened [m], and of others behind it."""
    return [[0.0, 0.0, 0.0], [opening, 0.0, 0.0], *[[0.0, 0.0, 0.0]] * others]
