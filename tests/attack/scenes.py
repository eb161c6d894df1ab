"""Random scenes: valid arguments of the table of public calls, some decades off."""

import functools

import numpy as np

import ca_damper as ca
import taichi_dem as td
from taichi_dem import ImplicitDashpots, Multirate, Uniform, effects
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.stability.step_report import bond_steps
from tests.bad_input.calls import calls
from tests.bad_input.kinds import kind_of
from tests.scenes import beside

SHARES = 0.0, 0.05, 0.5, 0.75, 0.99, 1.0
#: Parts of a scene, from one body to twelve, of edges of 1 m.
SOLIDS = single(1.0), pair(1.0), bar(1.0, 1.0, (1, 1, 1)), bar(1.0, 0.5, (2, 1, 1))
BONDS = "BondDamping Softening ShearSlip"
SPHERES, FACES = f"{BONDS} SphereContact Friction", f"{BONDS} BodyContact StickingFriction"
#: Structures of a blast: method, laws or "auto", and loads. Few, as each takes seconds to compile;
#: every effect and method is in one of them.
BLASTS = (
    ("uniform", BONDS, "Gravity"),
    ("uniform in reach", "Softening SlipWeakening", "Roller"),
    ("held", SPHERES, "GasPressure"),
    ("drifted", f"{BONDS} SphereContact StickingFriction", "Gravity PrescribedMotion"),
    ("drifted", FACES, "GasPressure"),
    ("controlled", SPHERES, "GasPressure Gravity"),
    ("limited", SPHERES, "Gravity"),
    ("solved", SPHERES, "GasPressure Fixed"),
    ("solved", "auto", "PrescribedMotion Gravity"),
    ("solved", "BondDamping SlipWeakening", "Roller GasPressure"),
)
#: Structures of a damper: filling, its words, and the mount.
DAMPERS = (
    ("Automaton", {"rules": ca.Paper()}, "spring"),
    ("Automaton", {"rules": ca.Paper("landing"), "traversal": "scan"}, "base"),
    ("Automaton", {}, "spring"),
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
    found = next((one.valid for one in calls(package) if one.name == name), {})
    return {**found, **USUAL.get(name, {})}


class Draws:
    """Random numbers of one scene; the same seed draws the same.

    width: decades by which numbers leave their usual values, of this scene.
    """

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
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

    def near(self, value):
        """A number some decades about a usual one."""
        return float(value * 10.0 ** (self.width * self.rng.standard_normal()))

    def whole(self, low, high):
        """A whole number from low to high."""
        return int(self.rng.integers(low, high + 1))

    def varied(self, package, name, **own):
        """Valid arguments of a call, and own ones, with other numbers of their kinds."""
        arguments = {**usual(package, name), **own}
        return {key: self.other(kind_of(name, key), one) for key, one in arguments.items()}

    def other(self, kind, value):
        """Another value of a kind; what is no number stays, and now and then a number too."""
        if isinstance(value, tuple) and value and not isinstance(value[0], tuple):
            return [float(x) for x in self.vector(self.power(-2.0, 1.0))]
        if isinstance(value, bool) or not isinstance(value, int | float) or self.chance(0.2):
            return value
        if kind == "zero or positive" and self.chance(0.15):
            return 0.0
        if kind == "share":
            return self.one_of(*SHARES)
        if kind == "limited":
            return self.rng.uniform(-0.5, 0.5)
        is_whole = isinstance(value, int)
        return self.whole((value + 1) // 2, 2 * value) if is_whole else self.near(value)


def blast(draws, kind):
    """Scene and method of a kind; refused where its numbers do not go together."""
    method, laws, loads = kind
    mesh, material = drawn_mesh(draws), draws.varied(td, "Material")
    # Else every second one would be refused: failure has to come after the onset.
    least = material["tensile_strength"] ** 2 / (2.0 * material["normal_stiffness"])
    material["fracture_energy"] = max(material["fracture_energy"], 1.1 * least)
    material, options = td.Material(**material), motion(draws, mesh.body_count)
    acting = [effect(draws, name, mesh) for name in loads.split()]
    if laws == "auto":
        options["loads"] = acting
    else:
        laws = [*(effect(draws, name, mesh) for name in laws.split()), *acting]
    scene = td.Scene(mesh, material, laws, **options)
    return scene, drawn_method(draws, method, mesh, material)


def effect(draws, name, mesh):
    """A law of bonds or contacts, or a load, on a group if it takes one."""
    given = usual(td, f"effects.{name}")
    own = {"group": draws.one_of(*mesh.groups)} if "group" in given else {}
    return getattr(effects, name)(**draws.varied(td, f"effects.{name}", **own))


def motion(draws, count):
    """Velocities [m/s] and spins [rad/s] of so many bodies at the start, or of none."""
    sizes = {"velocity": draws.power(-4.0, 2.5), "spin": draws.power(-2.0, 4.0)}
    drawn = {name: size * draws.rng.standard_normal((count, 3)) for name, size in sizes.items()}
    return {name: each for name, each in drawn.items() if draws.chance(0.3)}


def drawn_mesh(draws):
    """One to 24 bodies, some of them in parts that may meet, or begin inside each other."""
    made, other = draws.one_of(*SOLIDS), draws.one_of(*SOLIDS)
    if draws.chance(0.5):
        gap = draws.power(-6.0, 0.0) * draws.one_of(1.0, 1.0, 1.0, -1.0)
        along = made.points[:, 0].max() - other.points[:, 0].min() + gap
        made = beside(made, other, [along, *draws.rng.normal(0.0, 0.3, 2)])
    size = draws.power(-2.0, -0.5) if draws.chance(0.8) else draws.power(-6.0, 4.0)
    points = size * made.points * [draws.power(-1.0, 1.0) for _ in range(3)]
    if draws.chance(0.2):
        points += 0.03 * draws.width * points.std(axis=0) * draws.rng.normal(size=points.shape)
    if draws.chance(0.1):
        points += draws.vector(draws.power(-1.0, 7.0))
    return td.checked_mesh(points, made.tetrahedra, made.groups)


def drawn_method(draws, name, mesh, material):
    """A method at a step about the longest stable one."""
    limits = bond_steps(mesh, material)
    stable = limits["bond_stiffness"].min()
    if name not in ("solved", "limited"):
        stable = min(stable, limits["bond_dashpot"].min())
    stable = float(stable) if np.isfinite(stable) else 1e-6
    dt, way = stable * draws.power(-2.0, 0.7), np.ptp(mesh.points) * draws.power(-8.0, -2.0)
    floor = {"dashpot_floor": stable * draws.power(-3.0, 0.0)}
    limited = {"control": td.StepControl(**draws.varied(td, "StepControl", **floor))}
    sweeps, theta = (draws.whole(1, 3), draws.whole(3, 60)), draws.one_of(0.5, 0.6, 1.0)
    return {
        "uniform": lambda: Uniform(dt),
        "uniform in reach": lambda: Uniform(dt, way),
        "limited": lambda: Uniform(dt, dashpot="limited"),
        "held": lambda: Multirate(dt, way),
        "drifted": lambda: Multirate(dt, way, "drifted"),
        "controlled": lambda: Multirate(dt, way, dashpot="limited", **limited),
        "solved": lambda: ImplicitDashpots(dt, sweeps, draws.near(0.05), theta),
    }[name]()


def damper(draws, kind):
    """Batch of a filling of a kind, with few scenes."""
    name, words, mount = kind
    numbers = {**draws.varied(ca, name), **words}
    if name == "Spheres":
        size = numbers["diameter"]
        numbers |= {side: size * draws.rng.uniform(1.0, 15.0) for side in ("width", "height")}
    filling = getattr(ca, name)(**numbers)
    most = min(filling.capacity, 300)
    own = {
        "particles": [draws.whole(0, most) for _ in range(draws.one_of(1, 3))],
        "seed": draws.whole(0, 2**31 - 1),
        "frequency": draws.power(0.0, 2.0),
        "base_amplitude": draws.power(-6.0, -1.5),
        "dt": draws.near(filling.default_dt),
    }
    return ca.Batch(
        filling, ca.SceneTable(**{**draws.varied(ca, "Oscillator"), **own}), mount=mount
    )
