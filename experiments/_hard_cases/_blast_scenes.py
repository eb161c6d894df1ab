"""Scenes of the blast's hard cases: islands of bodies that never meet, stepped in one run.

A run compiles for seconds and steps for less, so that one run of a method serves many cases: each
reads its own island. Runs are kept by world and method.
"""

import functools
from dataclasses import dataclass

import numpy as np

from _demo import set_moving
from taichi_dem import (
    CONCRETE,
    Every,
    ImplicitDashpots,
    Mesh,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
)
from taichi_dem.mesh.contact_spheres import spheres_of_faces
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.mesh.topology import body_properties
from taichi_dem.simulate import run_simulation

EPS = np.finfo(float).eps
#: Distance of islands [m].
APART = 1.0
SAMPLES = 40
SPIN = 1e4
FAST = 1000.0
OPENING = 5e-6
#: A bond's dashpots alone stop a pair of bodies of 35 g after 0.7 us: 30 um need 43 m/s at least.
TEARING = 100.0
FAR = 1000.0
#: Methods by name: loose(step), in contact.
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
    # Changes count against the fastest body of all islands, so that slow ones need more sweeps.
    "implicit": ImplicitDashpots(4e-7, sweeps=(2, 50), tolerance=1e-3),
}


@dataclass(frozen=True)
class Island:
    """Bodies that start with a displacement [m], a velocity [m/s] and a spin [rad/s], (n, 3)."""

    mesh: Mesh
    shift: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray

    @classmethod
    def of(cls, *parts, at=(0.0, 0.0, 0.0), shift=0.0, velocity=0.0, spin=0.0):
        """Parts side by side, each (mesh, offset [m]); the rest is broadcast to all bodies."""
        placed = ((mesh, np.add(offset, at)) for mesh, offset in parts)
        mesh = placed_together({str(k): part for k, part in enumerate(placed)})
        shape = mesh.body_count, 3
        return cls(mesh, *(np.broadcast_to(x, shape) for x in (shift, velocity, spin)))


@dataclass(frozen=True, eq=False)
class Track:
    """What the bodies of an island did: arrays over samples; see ``follow``.

    time_s (s,); position, velocity, momentum (s, n, 3), rotation (s, n, 3, 3); mass (n,), inertia
    (n, 3, 3) in body axes; broken: faces at the end. dt: largest step. compile_s: of the run.
    warnings: of the step, about the island's own bonds.
    """

    time_s: np.ndarray
    motion: dict
    mass: np.ndarray
    inertia: np.ndarray
    broken: int
    dt: float
    compile_s: float
    warnings: tuple

    @property
    def moved(self):
        """Displacements since the start [m], (s, n, 3)."""
        return self.motion["position"] - self.motion["position"][0]

    def kinetic(self):
        """Kinetic energy of the island [J], (s,)."""
        return self.translational() + self.rotational()

    def translational(self):
        """Part of the kinetic energy [J], (s,)."""
        return 0.5 * (self.mass * (self.motion["velocity"] ** 2).sum(axis=2)).sum(axis=1)

    def rotational(self):
        """Part of the kinetic energy [J], (s,)."""
        turn, spun = self.motion["rotation"], self.motion["angular_momentum"]
        local = np.einsum("snji,snj->sni", turn, spun)
        spin = np.einsum("nij,snj->sni", np.linalg.inv(self.inertia), local)
        return 0.5 * np.einsum("sni,sni->s", local, spin)

    def linear(self):
        """Momentum [N s], (s, 3)."""
        return np.einsum("n,sni->si", self.mass, self.motion["velocity"])

    def angular(self):
        """Angular momentum about where the island's first body began [N m s], (s, 3)."""
        arm = self.motion["position"] - self.motion["position"][0, 0]
        orbit = np.cross(arm, self.mass[:, None] * self.motion["velocity"])
        return (orbit + self.motion["angular_momentum"]).sum(axis=1)

    def momentum_error(self):
        """Largest change of momentum, linear and angular, as a share of what the bodies had.

        The scale is the sum over bodies of the largest momentum each of them ever had.
        """
        speed = np.linalg.norm(self.motion["velocity"], axis=2)
        scale = (self.mass * speed).max(axis=0).sum()
        size = np.linalg.norm(np.ptp(self.motion["position"][0], axis=0)) + 0.05
        turning = np.linalg.norm(self.motion["angular_momentum"], axis=2).max(axis=0).sum()
        linear = np.linalg.norm(self.linear() - self.linear()[0], axis=1).max()
        angular = np.linalg.norm(self.angular() - self.angular()[0], axis=1).max()
        return max(linear / max(scale, 1e-300), angular / max(scale * size + turning, 1e-300))


def loose_islands():
    """Single bodies that no force acts on."""
    uneven = checked_mesh(
        [[0, 0, 0], [0.06, 0, 0], [0.01, 0.05, 0], [0.01, 0.01, 0.04]], [[0, 1, 2, 3]], {}
    )
    islands = {
        f"spin_{axis}": Island.of((uneven, 0.0), spin=SPIN * np.eye(3)[k])
        for k, axis in enumerate("xyz")
    }
    islands["fast"] = Island.of((single(), 0.0), velocity=(FAST, -0.5 * FAST, 0.0))
    islands["still"] = Island.of((single(), 0.0))
    return islands


def touching_islands():
    """Bonded pieces and fragments that meet."""
    two, apart = pair(), [[0.0, 0.0, 0.0], [OPENING, 0.0, 0.0]]
    # A unit of the sliver bears no more than this before it softens.
    thin, thin_apart = pair(0.05, 0.05 / 50), [[0.0, 0.0, 0.0], [1e-6, 0.0, 0.0]]
    turned = checked_mesh(two.points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})
    return {
        "hit": fragment_and_block(),
        "overlap": Island.of((single(), 0.0), (turned, (-1e-3, 0.0, 0.0))),
        "strained": Island.of((two, 0.0), shift=apart, velocity=(20.0, -10.0, 5.0)),
        "strained_far": Island.of(
            (two, 0.0), at=(FAR, FAR, FAR), shift=apart, velocity=(20.0, -10.0, 5.0)
        ),
        "sliver": Island.of((thin, 0.0), shift=thin_apart),
        "torn": Island.of((two, 0.0), velocity=[[-TEARING, 0.0, 0.0], [TEARING, 0.0, 0.0]]),
        "four_torn": _star(),
        "crushed": Island.of((two, 0.0), velocity=[[5.0, 0.0, 0.0], [-5.0, 0.0, 0.0]]),
        "still": Island.of((two, 0.0)),
    }


def fragment_and_block():
    """A fragment of 100 m/s, 10 µm before a cube of six bodies at rest."""
    velocity = np.zeros((7, 3))
    velocity[0] = (100.0, 0.0, 0.0)
    fragment = (single(), (-1e-5, 0.05, 0.05))
    return Island.of(fragment, (bar(0.1, 0.1, (1, 1, 1)), 0.0), velocity=velocity)


def _star():
    """A regular body with a neighbour on every face, all of them thrown outward."""
    middle = single()
    corners = middle.points[middle.tetrahedra[0]]
    points, bodies = [*corners], [[0, 1, 2, 3]]
    outward = []
    for k in range(4):
        face = [j for j in range(4) if j != k]
        apex = 2.0 * corners[face].mean(axis=0) - corners[k]
        bodies.append([*face, len(points)])
        points.append(apex)
        away = corners[face].mean(axis=0) - corners.mean(axis=0)
        outward.append(TEARING * away / np.linalg.norm(away))
    mesh = checked_mesh(points, bodies, {})
    return Island.of((mesh, 0.0), velocity=[[0.0, 0.0, 0.0], *outward])


def sphere_on_base(mesh):
    """Where the first contact sphere of a single body's face in x = 0 touches it [m], (3,)."""
    _, centre, _ = body_properties(mesh, 1.0)
    spheres = spheres_of_faces(mesh, centre, effects.SphereContact().divisions)
    corners = mesh.points[mesh.tetrahedra[0]]
    apex = int(abs(corners[:, 0]).argmax())
    place = centre[0] + spheres.centre[0, apex, 0]
    return np.array([0.0, place[1], place[2]])


def contact_effects():
    """All effects but loads, spheres on all outer faces."""
    bonds = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    return [*bonds, effects.SphereContact(outer_faces=True), effects.Friction()]


@functools.cache
def loose(name, until):
    """Tracks of all loose islands by name; name: of a method."""
    return follow(loose_islands(), [], FREE[name], until)


@functools.cache
def touching(name, until):
    """Tracks of all islands with bonds and contacts by name; name: of a method."""
    return follow(touching_islands(), contact_effects(), TOUCHING[name], until)


def follow(islands, acting, method, until, material=CONCRETE):
    """Run islands by a method to a time [s]; returns a Track by island."""
    places = np.outer(range(len(islands)), (0.0, 0.0, APART))
    meshes = {name: island.mesh for name, island in islands.items()}
    mesh = placed_together({name: (meshes[name], at) for name, at in zip(islands, places)})
    ends = np.cumsum([one.body_count for one in meshes.values()])
    slices = {name: slice(e - meshes[name].body_count, e) for name, e in zip(islands, ends)}
    simulation = Simulation(Scene(mesh, material, acting), method)
    motion = {
        name: np.vstack([getattr(island, name) for island in islands.values()])
        for name in ("velocity", "shift", "spin")
    }
    set_moving(simulation, *motion.values())
    samples = march(simulation, until)
    return {name: _track(simulation, samples, part) for name, part in slices.items()}


class _Motions:
    """Observer that keeps the motion at every sample."""

    when = Every(samples=1)

    def __init__(self):
        self.times, self.found = [], []

    def observe(self, view):
        """Keep it."""
        self.times.append(view.time_s)
        self.found.append(view.motion())


def march(simulation, until):
    """Step to a time [s]; motion at SAMPLES evenly spaced times, as arrays by name."""
    kept = _Motions()
    run_simulation(simulation, until=until, samples=SAMPLES, progress=None, observers=[kept])
    motion = {name: np.array([one[name] for one in kept.found]) for name in kept.found[0]}
    return {"motion": motion, "time_s": np.array(kept.times)}


def _track(simulation, samples, part):
    model = simulation.model
    top, broken = model.topology, simulation.state.broken_tick.to_numpy() >= 0
    bodies = np.zeros(model.body_count, dtype=bool)
    bodies[part] = True
    inside = bodies[top.master]
    return Track(
        time_s=samples["time_s"],
        motion={name: array[:, part] for name, array in samples["motion"].items()},
        mass=model.body_mass[part],
        inertia=model.body_inertia[part],
        broken=int((inside & broken[: len(inside)]).sum()),
        dt=simulation.method.dt0,
        compile_s=simulation.compile_seconds,
        warnings=simulation.step_resolution.findings(bodies),
    )
