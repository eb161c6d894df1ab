"""Random scenes: valid arguments of the table of public calls, some decades off."""

import functools
from typing import Any, NamedTuple

import numpy as np

import ca_damper as ca
import taichi_dem as td
from taichi_dem import (
    ImplicitDashpots,
    Material,
    Multirate,
    Scene,
    StepControl,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.stability.step_report import bond_steps
from tests.bad_input.calls import calls
from tests.bad_input.kinds import kind_of

#: Given in place of a number to a scene that is drawn to be spoilt.
IMPOSSIBLE = (float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e-300, 1e300, "1", None, True)
#: Share of the scenes that are spoilt, and of their numbers that are.
SPOILT, IN_VAIN = 0.1, 0.1
SHARES = 0.0, 0.05, 0.5, 0.75, 0.99, 1.0


class Kind(NamedTuple):
    """Structure of a blast that is compiled: a method, laws or "auto", and loads.

    both: whether some scenes also run in parallel loops, which are compiled for themselves.
    """

    method: str
    laws: str
    loads: str = ""
    both: bool = False


BONDS = "BondDamping Softening ShearSlip"
SPHERES, FACES = f"{BONDS} SphereContact Friction", f"{BONDS} BodyContact StickingFriction"
#: Few structures, as each takes seconds to compile; every effect and method is in one of them.
BLASTS = (
    Kind("uniform", BONDS, "Gravity", both=True),
    Kind("uniform in reach", "Softening SlipWeakening", "Roller"),
    Kind("held", SPHERES, "GasPressure"),
    Kind("drifted", f"{BONDS} SphereContact StickingFriction", "Gravity PrescribedMotion", True),
    Kind("drifted", FACES, "GasPressure"),
    Kind("controlled", SPHERES, "GasPressure Gravity"),
    Kind("limited", SPHERES, "Gravity"),
    Kind("solved", SPHERES, "GasPressure Fixed", both=True),
    Kind("solved", "auto", "PrescribedMotion Gravity"),
    Kind("solved", "BondDamping SlipWeakening", "Roller GasPressure"),
)
#: Structures of a damper: filling, its words, and the mount.
DAMPERS = (
    ("Automaton", {"rules": "paper"}, "spring"),
    ("Automaton", {"rules": "paper", "accounting": "landing", "traversal": "scan"}, "base"),
    ("Automaton", {"rules": "place"}, "spring"),
    ("Spheres", {}, "spring"),
    ("Spheres", {"friction_law": "history", "rotation": True}, "base"),
    ("Spheres", {"damping": "printed", "search": "all_pairs"}, "floor"),
    ("RigidMass", {}, "base"),
)
#: Usual numbers of tiny scenes, where those of the table are for large ones.
USUAL = {
    "effects.GasPressure": {"peak": 1e7, "rise": 1e-5, "start": 1e-6},
    "effects.PrescribedMotion": {"frequency": 1e3},
    "effects.Gravity": {"acceleration": (0.0, 0.0, 1e3)},
    "effects.SlipWeakening": {"fracture_energy": 1e3},
}


@functools.cache
def usual(package, name):
    """Valid arguments of a call."""
    found = next(one.valid for one in calls(package) if one.name == name)
    return {**found, **USUAL.get(name, {})}


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

    def vector(self, size):
        """A vector in any direction of some length."""
        way = self.rng.standard_normal(3)
        return size * way / np.linalg.norm(way)

    def given(self, value):
        """A value as the user gives it, in a spoilt scene now and then an impossible one."""
        return self.one_of(*IMPOSSIBLE) if self.spoilt and self.chance(IN_VAIN) else value

    def near(self, value):
        """A number some decades about a usual one."""
        return self.given(float(value * 10.0 ** (self.width * self.rng.standard_normal())))

    def whole(self, low, high):
        """A whole number from low to high."""
        return self.given(int(self.rng.integers(low, high + 1)))

    def varied(self, package, name, **own):
        """Valid arguments of a call, and own ones, with other numbers of their kinds."""
        arguments = {**usual(package, name), **own}
        return {key: self.other(kind_of(name, key), one) for key, one in arguments.items()}

    def other(self, kind, value):
        """Another value of a kind; what is no number stays, and now and then a number too."""
        if isinstance(value, tuple) and value and not isinstance(value[0], tuple):
            return [self.given(float(x)) for x in self.vector(self.power(-2.0, 1.0))]
        if isinstance(value, bool) or not isinstance(value, int | float) or self.chance(0.2):
            return self.given(value)
        if kind == "zero or positive" and self.chance(0.15):
            return self.given(0.0)
        if kind == "share":
            return self.given(self.one_of(*SHARES))
        if kind == "limited":
            return self.given(self.rng.uniform(-0.5, 0.5))
        return (
            self.whole((value + 1) // 2, 2 * value) if isinstance(value, int) else self.near(value)
        )


class Blast:
    """Everything of a blast by its seed."""

    def __init__(self, seed, kind):
        self.draws, self.kind = Draws(seed), kind
        self.steps = int(self.draws.power(1.0, 2.7))

    def build(self):
        """Draw scene, method and first motion; raises what refuses an impossible number."""
        draws, kind = self.draws, self.kind
        mesh, material = self.mesh(), draws.varied(td, "Material")
        if not draws.spoilt:
            # Else every second one would be refused: failure has to come after the onset.
            least = material["tensile_strength"] ** 2 / (2.0 * material["normal_stiffness"])
            material["fracture_energy"] = max(material["fracture_energy"], 1.1 * least)
        material = Material(**material)
        groups = [*mesh.groups, "nowhere"] if draws.spoilt or not mesh.groups else [*mesh.groups]
        loads = [self.effect(name, draws.one_of(*groups)) for name in kind.loads.split()]
        options = {"max_speed": draws.near(1e4)} if draws.chance(0.2) else {}
        if kind.laws == "auto":
            self.scene = Scene(mesh, material, "auto", loads=loads, **options)
        else:
            laws = [self.effect(name) for name in kind.laws.split()]
            self.scene = Scene(mesh, material, [*laws, *loads], **options)
        self.method = self.drawn_method(mesh, material)
        self.motion = self.first_motion(mesh)

    def effect(self, name, group=None):
        """A law of bonds or contacts, or a load on a group."""
        own = {} if group is None or name == "Gravity" else {"group": group}
        of = getattr(effects, name)
        if name in ("Softening", "BondDamping", "ShearSlip", "Friction"):
            return of()
        return of(**self.draws.varied(td, f"effects.{name}", **own))

    def mesh(self):
        """One to 24 bodies, some of them in parts that may meet, or begin inside each other."""
        draws = self.draws
        shape = draws.one_of(self.part, self.two)
        made = shape(draws.power(-2.0, -0.5) if draws.chance(0.8) else draws.power(-6.0, 4.0))
        moved = 0.0
        if draws.chance(0.2):
            moved = 0.1 * draws.width * made.points.std() * draws.rng.normal(size=made.points.shape)
        if draws.chance(0.1):
            moved = moved + draws.vector(draws.power(-1.0, 7.0))
        return checked_mesh(made.points + moved, made.tetrahedra, made.groups)

    def part(self, size):
        """One body, a pair, or a bar of some boxes."""
        draws = self.draws
        if draws.chance(0.25):
            return single(draws.given(size))
        if draws.chance(0.33):
            return pair(draws.given(size), draws.near(size))
        return bar(draws.given(size), draws.near(size), [draws.whole(1, 2) for _ in range(3)])

    def two(self, size):
        """Two solids with a gap, or an overlap, between them."""
        draws = self.draws
        first, second = self.part(size), self.part(size)
        gap = size * draws.power(-6.0, 0.0) * draws.one_of(1.0, 1.0, 1.0, -1.0)
        along = first.points[:, 0].max() - second.points[:, 0].min() + gap
        shift = np.array([along, *(0.3 * size * draws.rng.standard_normal(2))])
        return placed_together({"first": (first, np.zeros(3)), "second": (second, shift)})

    def drawn_method(self, mesh, material):
        """The method of the kind at a step about the longest stable one."""
        draws, name = self.draws, self.kind.method
        limits = bond_steps(mesh, material)
        longest = limits["bond_stiffness"].min()
        if name not in ("solved", "limited"):
            longest = min(longest, limits["bond_dashpot"].min())
        usual_step = float(longest) if np.isfinite(longest) else 1e-6
        dt = draws.given(usual_step * draws.power(-2.0, 0.7))
        way = draws.given(float(np.ptp(mesh.points)) * draws.power(-8.0, -2.0))
        if name == "solved":
            theta = draws.given(draws.one_of(0.5, 0.6, 1.0))
            sweeps = draws.whole(1, 3), draws.whole(3, 60)
            more = {"theta": theta, "sweeps": sweeps, "tolerance": draws.near(0.05)}
            return ImplicitDashpots(dt, **(more if draws.chance(0.5) else {}))
        if name.startswith("uniform"):
            return Uniform(dt, way if name == "uniform in reach" else None)
        if name == "limited":
            return Uniform(dt, dashpot="limited")
        if name == "controlled":
            floor = {"dashpot_floor": usual_step * draws.power(-3.0, 0.0)}
            control = draws.varied(td, "StepControl", **floor)
            return Multirate(dt, way, control=StepControl(**control), dashpot="limited")
        return Multirate(dt, way, name)

    def first_motion(self, mesh):
        """Velocities [m/s], spins [rad/s] and displacements [m] at the start, by name."""
        draws, rows = self.draws, (mesh.body_count, 3)
        sizes = {
            "velocity": draws.power(-4.0, 2.5),
            "spin": draws.power(-2.0, 4.0),
            "shift": float(np.ptp(mesh.points)) * draws.power(-9.0, -2.0),
        }
        return {
            name: size * draws.rng.standard_normal(rows) * draws.chance(0.3)
            for name, size in sizes.items()
        }


class Damper:
    """Everything of a damper by its seed: a filling, and a table of few scenes."""

    def __init__(self, seed, kind):
        self.draws, (self.name, self.words, self.mount) = Draws(seed), kind

    def build(self):
        """Draw both; raises what refuses an impossible number."""
        draws = self.draws
        numbers = {**draws.varied(ca, self.name), **self.words}
        if self.name == "Spheres":
            width = numbers["diameter"]
            size = width if isinstance(width, float) and 0.0 < abs(width) < 1.0 else 6e-3
            for side in ("width", "height"):
                numbers[side] = draws.given(abs(size) * draws.rng.uniform(1.0, 15.0))
        self.filling: Any = getattr(ca, self.name)(**numbers)
        most = min(self.filling.capacity, 300)
        few = [draws.whole(0, most + draws.one_of(0, 0, 0, 1)) for _ in range(draws.one_of(1, 3))]
        own = {"particles": few, "seed": draws.whole(0, 2**31 - 1)}
        own["frequency"] = draws.given(draws.power(0.0, 2.0))
        own["base_amplitude"] = draws.given(draws.power(-6.0, -1.5))
        own["dt"] = draws.near(self.filling.default_dt)
        structure = draws.varied(ca, "Oscillator")
        self.table = ca.SceneTable(**{**structure, **own})
