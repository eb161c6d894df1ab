"""A run of a hard case of the blast: methods by name, bodies, and the limits that many share."""

import numpy as np

from cases.closed_forms import damped_opening
from taichi_dem import CONCRETE, Scene, Simulation, StepControl, effects
from taichi_dem.methods import ImplicitDashpots, Multirate, Uniform
from taichi_dem.observers import Every, RunView
from taichi_dem.output.fracture import body_spins
from taichi_dem.simulate import run_simulation

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


class MotionRecord:
    """Observer that keeps the motion of bodies at every sample.

    bodies: which, an index of arrays, all by default. mass (n,), inertia (n, 3, 3) in body axes;
    broken: bonds of the whole scene that have been released.
    """

    when = Every(samples=1)

    def __init__(self, bodies: slice = slice(None)):
        self.bodies, self.broken = bodies, 0
        self._times: list[float] = []
        self._samples: list[dict] = []

    def observe(self, view: RunView) -> None:
        """Keep one sample."""
        self.mass = view.model.body_mass[self.bodies]
        self.inertia = view.model.body_inertia[self.bodies]
        self.broken = int(view.broken.sum())
        self._times.append(view.time_s)
        self._samples.append({name: one[self.bodies] for name, one in view.motion().items()})

    def __getitem__(self, name: str) -> np.ndarray:
        """Samples of one of the arrays of ``RunView.motion``, (samples, n, ...)."""
        return np.array([sample[name] for sample in self._samples])

    @property
    def time_s(self) -> np.ndarray:
        """Times of the samples [s], (samples,)."""
        return np.array(self._times)

    @property
    def moved(self) -> np.ndarray:
        """Displacements since the first sample [m], (samples, n, 3)."""
        return self["position"] - self["position"][0]

    @property
    def rotational_energy(self) -> np.ndarray:
        """Energy of the spins [J], (samples,)."""
        local, spin = body_spins(self.inertia, self["rotation"], self["angular_momentum"])
        return 0.5 * np.einsum("sni,sni->s", local, spin)

    @property
    def kinetic_energy(self) -> np.ndarray:
        """Energy of the motion and the spins [J], (samples,)."""
        square = (self["velocity"] ** 2).sum(axis=2)
        return 0.5 * (self.mass * square).sum(axis=1) + self.rotational_energy

    @property
    def momentum(self) -> np.ndarray:
        """Sum over the bodies [N s], (samples, 3)."""
        return np.einsum("n,sni->si", self.mass, self["velocity"])

    @property
    def angular_momentum(self) -> np.ndarray:
        """Sum about the place where the first body began [N m s], (samples, 3)."""
        arm = self["position"] - self["position"][0, 0]
        orbit = np.cross(arm, self.mass[:, None] * self["velocity"])
        return (orbit + self["angular_momentum"]).sum(axis=1)

    def momentum_error(self, size: float) -> float:
        """Largest change of momentum, linear and angular, as a share of what the bodies had.

        Had: the sum over bodies of the largest momentum each of them ever had. size: of a body [m],
        which with the distances of the bodies is the arm of the linear momentum.
        """
        speed, spun = (np.linalg.norm(self[n], axis=2) for n in ("velocity", "angular_momentum"))
        scale = (self.mass * speed).max(axis=0).sum()
        arm = np.linalg.norm(np.ptp(self["position"][0], axis=0)) + size
        scales = scale, scale * arm + spun.max(axis=0).sum()
        totals = self.momentum, self.angular_momentum
        changes = (np.linalg.norm(total - total[0], axis=1).max() for total in totals)
        return max(change / max(had, 1e-300) for change, had in zip(changes, scales))


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
        trial.warnings += simulation.followed.step_resolution.findings()
        self.trial, self.dt, self.steps = trial, method.dt0, self.time_s[-1] / method.dt0

    def energy(self):
        """Kinetic energy over that at the start."""
        return self.kinetic_energy / self.kinetic_energy[0]

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

    def converged(
        self, name, found, true, scale, bound=ACCURACY, formula="1 % of the exact solution"
    ):
        """Largest distance of what was found from what it has to converge to, over a scale."""
        self.trial.limit(name, abs(np.asarray(found) - true) / scale, bound, formula)

    def gap(self, opening=0.0):
        """Distance of body 1 from body 0 along x beyond that of the mesh [m]."""
        return opening + self.moved[:, 1, 0] - self.moved[:, 0, 0]

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
