"""The motion of chosen bodies at every sample of a run, with their energy and momentum."""

import numpy as np

from taichi_dem.observers import Every, RunView
from taichi_dem.output.fracture import body_spins


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
