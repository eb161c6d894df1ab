"""A random scene of the blast: a tiny mesh, a material, effects, a method and a first motion."""

from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.kit.validation import positive
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.stability.step_report import bond_steps
from tests.fuzz.draws import Draws
from tests.meshes import with_neighbours


class Kind(NamedTuple):
    """Structure that is compiled: a method by name, classes of effects or "auto", and of loads.

    both: whether some scenes also run in parallel loops, which are compiled for themselves.
    """

    method: str
    laws: object
    loads: tuple = ()
    both: bool = False


BONDS = (effects.BondDamping, effects.Softening, effects.ShearSlip)
SPHERES = (*BONDS, effects.SphereContact, effects.Friction)
FACES = (*BONDS, effects.BodyContact, effects.StickingFriction)
GAS, WEIGHT, MOVED = effects.GasPressure, effects.Gravity, effects.PrescribedMotion
#: Few structures, as each takes seconds to compile; every effect and method is in one of them.
KINDS = (
    Kind("uniform", BONDS, (WEIGHT,), both=True),
    Kind("uniform in reach", (effects.Softening, effects.SlipWeakening), (effects.Roller,)),
    Kind("held", SPHERES, (GAS,)),
    Kind("drifted", (*SPHERES[:-1], effects.StickingFriction), (WEIGHT, MOVED), both=True),
    Kind("drifted", FACES, (GAS,)),
    Kind("controlled", SPHERES, (GAS, WEIGHT)),
    Kind("limited", SPHERES, (WEIGHT,)),
    Kind("solved", SPHERES, (GAS, effects.Fixed), both=True),
    Kind("solved", "auto", (MOVED, WEIGHT)),
    Kind("solved", (effects.BondDamping, effects.SlipWeakening), (effects.Roller, GAS)),
)
#: Constants of a material that may be zero.
MAY_VANISH = ("normal_damping", "shear_damping", "cohesion", "friction", "contact_damping")


class BlastScene:
    """Everything of a scene by its seed; what it draws depends on nothing else."""

    def __init__(self, seed, kind):
        self.draws, self.kind = Draws(seed), kind
        self.scene = self.method = None
        self.steps = int(self.draws.power(1.0, 2.7))

    def build(self):
        """Draw all of it; raises what the package raises for what cannot be used."""
        mesh, material = self.mesh(), self.material()
        laws = self.kind.laws
        loads = [self.load(of, mesh) for of in self.kind.loads]
        options = {"max_speed": self.draws.near(1e4)} if self.draws.chance(0.2) else {}
        if laws == "auto":
            self.scene = Scene(mesh, material, laws, loads=loads, **options)
        else:
            acting = [self.law(of) for of in laws]
            self.scene = Scene(mesh, material, [*acting, *loads], **options)
        self.method = self.drawn_method(mesh, material)
        self.motion = self.first_motion(mesh)

    def mesh(self):
        """One to 24 bodies, some of them in parts that may meet, or begin inside each other."""
        draws = self.draws
        shape = draws.one_of(self.alone, self.brick, self.brick, self.two, self.two)
        made = shape(draws.power(-2.0, -0.5) if draws.chance(0.8) else draws.power(-6.0, 4.0))
        if draws.chance(0.2):
            moved = 0.1 * draws.width * made.points.std()
            moved = moved * draws.rng.standard_normal(made.points.shape)
            made = checked_mesh(made.points + moved, made.tetrahedra, made.groups)
        if draws.chance(0.1):
            away = draws.vector(draws.power(-1.0, 7.0))
            made = checked_mesh(made.points + away, made.tetrahedra, made.groups)
        return made

    def alone(self, size):
        """One body, a pair, or one with neighbours."""
        draws = self.draws
        if draws.chance(0.2):
            count = draws.one_of(1, 2, 3, 4)
            heights = {k: positive("height", draws.near(1.0)) for k in range(count)}
            return with_neighbours(size, heights)[0]
        if draws.chance(0.5):
            return single(draws.given(size))
        return pair(draws.given(size), draws.near(size))

    def brick(self, size):
        """A bar of some boxes."""
        cells = [self.draws.whole(1, 2) for _ in range(3)]
        return bar(self.draws.given(size), self.draws.near(size), cells)

    def two(self, size):
        """Two solids with a gap, or an overlap, between them."""
        draws = self.draws
        parts = [draws.one_of(self.alone, self.brick)(size) for _ in range(2)]
        ends = [part.points[:, 0] for part in parts]
        gap = size * draws.power(-6.0, 0.0) * draws.one_of(1.0, 1.0, 1.0, -1.0)
        aside = 0.3 * size * draws.rng.standard_normal(2)
        shift = ends[0].max() - ends[1].min() + gap, *aside
        return placed_together({"first": (parts[0], np.zeros(3)), "second": (parts[1], shift)})

    def material(self):
        """Concrete, with every constant off by some decades."""
        draws = self.draws
        names = [field.name for field in fields(CONCRETE)]
        drawn = {n: draws.near(getattr(CONCRETE, n), n in MAY_VANISH) for n in names}
        if not draws.spoilt:
            # Else every second one would be refused: failure has to come after the onset.
            least = drawn["tensile_strength"] ** 2 / (2.0 * drawn["normal_stiffness"])
            drawn["fracture_energy"] = max(drawn["fracture_energy"], 1.1 * least)
        return replace(CONCRETE, **drawn)

    def law(self, of):
        """A law of bonds or contacts with options of its own."""
        draws = self.draws
        if of is effects.SphereContact and draws.chance(0.3):
            return of(outer_faces=draws.one_of(True, False, "once_broken"), skin=draws.near(0.015))
        if of is effects.BodyContact and draws.chance(0.5):
            stiffness = draws.near(CONCRETE.normal_stiffness)
            return of(restitution=draws.one_of(1.0, 0.5, 0.01), stiffness=stiffness)
        if of is effects.SlipWeakening:
            return of(draws.near(1000.0))
        return of()

    def load(self, of, mesh):
        """A load or support, with a group of the mesh."""
        draws = self.draws
        groups = [*mesh.groups, "nowhere"] if draws.spoilt or not mesh.groups else [*mesh.groups]
        group = draws.one_of(*groups)
        if of is effects.Fixed:
            return of(group)
        if of is GAS:
            pulse = draws.near(1e7), draws.near(1e-5), draws.near(2.75)
            return of(group, *pulse, draws.near(1e-6) if draws.chance(0.3) else 0.0)
        vector = [draws.given(float(x)) for x in draws.vector(draws.power(-3.0, 2.0))]
        if of is effects.Roller:
            return of(group, vector)
        if of is MOVED:
            return of(group, vector, draws.near(1e3, may_vanish=True))
        weight = draws.power(0.0, 4.0)
        return of([x * weight if isinstance(x, float) else x for x in vector])

    def drawn_method(self, mesh, material):
        """The method of the kind at a step about the longest stable one."""
        draws, name = self.draws, self.kind.method
        limits = bond_steps(mesh, material)
        damped = limits["bond_stiffness"]
        if name not in ("solved", "limited"):
            damped = np.minimum(damped, limits["bond_dashpot"])
        longest = float(damped.min()) if np.isfinite(damped.min()) else 1e-6
        dt = draws.given(longest * draws.power(-2.0, 0.7))
        way = draws.given(float(np.ptp(mesh.points)) * draws.power(-8.0, -2.0))
        if name == "solved":
            return ImplicitDashpots(dt, **self.sweeps())
        if name.startswith("uniform"):
            return Uniform(dt, way if name == "uniform in reach" else None)
        if name == "limited":
            return Uniform(dt, dashpot="limited")
        if name == "controlled":
            return Multirate(dt, way, control=self.control(dt), dashpot="limited")
        return Multirate(dt, way, name)

    def sweeps(self):
        """Options of the solved dashpots."""
        draws = self.draws
        if draws.chance(0.5):
            return {}
        sweeps = draws.whole(1, 3), draws.whole(3, 60)
        theta = draws.given(draws.one_of(0.5, 0.6, 1.0))
        return {"sweeps": sweeps, "theta": theta, "tolerance": draws.near(0.05)}

    def control(self, dt):
        """Options of the step control."""
        draws = self.draws
        floor = dt * draws.power(-3.0, 0.0) if isinstance(dt, float) and abs(dt) < 1.0 else 0.0
        return StepControl(
            safety=draws.given(draws.rng.uniform(0.05, 1.0)),
            level_jump=draws.one_of(0, 2, 4),
            ahead=draws.given(draws.rng.uniform(1.0, 4.0)),
            dashpot_floor=draws.given(draws.one_of(0.0, floor)),
        )

    def first_motion(self, mesh):
        """Velocities [m/s], spins [rad/s] and displacements [m] at the start, by name."""
        draws = self.draws
        rows, size = (mesh.body_count, 3), float(np.ptp(mesh.points))
        motion = {"shift": np.zeros(3), "velocity": np.zeros(3), "spin": np.zeros(3)}
        if draws.chance(0.5):
            motion["velocity"] = draws.power(-4.0, 2.5) * draws.rng.standard_normal(rows)
        if draws.chance(0.3):
            motion["velocity"] = motion["velocity"] + draws.vector(draws.power(-2.0, 3.0))
        if draws.chance(0.2):
            motion["spin"] = draws.power(-2.0, 4.0) * draws.rng.standard_normal(rows)
        if draws.chance(0.2):
            motion["shift"] = size * draws.power(-9.0, -2.0) * draws.rng.standard_normal(rows)
        return motion
