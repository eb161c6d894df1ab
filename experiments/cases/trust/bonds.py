"""Bonds that part: strengths of specimens by those of bonds, and a joint in mixed modes."""

from functools import partial

import numpy as np

from cases.strength_tests import BRAZILIAN, COMPRESSION, TENSION
from cases.trust import Number
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.materials import Material
from taichi_dem.mesh.mesh import checked_mesh, with_inner_group
from taichi_dem.mesh.shapes import bar

#: Edge of an element [m]; E [Pa], nu, rho [kg/m3], strength [Pa] and fracture energy [J/m2] of a
#: bond, friction [degrees], cohesion [Pa], share of critical damping.
EDGE, STRENGTH = 5e-3, 8e6
ROCK = {
    **{"young": 69e9, "poisson": 0.2, "density": 2630.0, "tensile_strength": STRENGTH},
    **{"fracture_energy": 30.0, "friction_angle": 30.0, "cohesion": 24e6, "damping_ratio": 0.1},
}
#: About what compression takes, over the strength of bonds.
PRESSED = 14.0


def strengths(effort):
    """Strengths of specimens over those of bonds, scattered and in rows."""
    tension, split = (strength(test, effort.seeds) for test in (TENSION, BRAZILIAN))
    pressed = strength(COMPRESSION, effort.seeds, PRESSED) / STRENGTH
    rows = strength(TENSION, [None]) / STRENGTH
    words = "direct tension over the strength of a bond"
    bonds = partial(Number, published=1.0, source="one bond", allowed=0.03)
    split_words = "Brazilian strength over direct tension, flat strips of 10 degrees"
    elastic = {"source": "an elastic disc, 2 P / (pi D t)", "allowed": 0.1}
    small = "the disc is twice as wide as E G / f_t^2"
    pressed_words, rock = "compression over the strength of a bond", "rock and concrete, 8 to 20"
    return [
        bonds("strength_tension", words, values=tension / STRENGTH),
        bonds("strength_in_rows", f"{words}, mesh in rows", values=rows),
        Number("strength_split", split_words, 1.0, split / tension, miss=small, **elastic),
        Number("strength_pressed", pressed_words, 14.0, pressed, 8.0, 20.0, source=rock),
    ], {}


def strength(test, seeds, expected=1.0):
    """Strengths of specimens [Pa]; expected: over that of a bond."""
    rock, much = Material.from_elastic(**ROCK), expected * STRENGTH
    return np.array([test.strength(rock, EDGE, much, seed) for seed in seeds])


MIXED = "Benzeggagh and Kenane, Compos. Sci. Technol. 56 (1996) 439"
#: Fracture energies of opening and sliding [J/m2], exponent of mixed modes.
OPENED, SLID, EXPONENT = CONCRETE.fracture_energy, 3.0 * CONCRETE.fracture_energy, 1.75
#: Length, width of the plate [m], its cells, and how far random inner points are moved, of a cell.
LENGTH, WIDTH, CELLS, JITTER = 0.1, 0.05, (4, 3, 3), 0.15
#: Share of the joint that is bonded: what lies beside it stays whole.
BONDED = 0.01
#: Speed at which the surface of a half is pulled from the other [m/s], and when it has parted [s].
SPEED, TIME, STEP = 0.5, 2.6e-4, 1e-6
#: Angles of the pull against the joint's normal [degrees].
ANGLES = 0, 30, 45, 60, 90


def joint(effort):
    """Energy that the joint took, by the law of mixed modes, at several angles."""
    spent = np.array([[taken(seed, angle) for angle in ANGLES] for seed in effort.seeds])
    shares = spent / np.array([energy_of(angle) for angle in ANGLES])
    row, words = (
        partial(Number, source=MIXED),
        "energy of a joint that {}, by the law of mixed modes",
    )
    ways = {0: "is opened", 45: "is moved at 45 degrees", 90: "is slid"}
    numbers = [
        row(f"joint_{angle}", words.format(way), 1.0, shares[:, ANGLES.index(angle)])
        for angle, way in ways.items()
    ]
    return numbers, {}


def energy_of(angle):
    """Fracture energy [J/m2] of a way at an angle [degrees]."""
    turn = np.radians(angle)
    opened = CONCRETE.normal_stiffness * np.cos(turn) ** 2
    slid = CONCRETE.shear_stiffness * np.sin(turn) ** 2
    return OPENED + (SLID - OPENED) * (slid / (opened + slid)) ** EXPONENT


def taken(seed, angle):
    """Energy [J/m2] that the bonds of the joint have taken once it has parted."""
    mesh, turn = jointed(seed), np.radians(angle)
    pull = SPEED * np.array([np.cos(turn), np.sin(turn), 0.0])
    held = [effects.Fixed("behind"), effects.PrescribedMotion("before", tuple(pull))]
    law = effects.MixedMode(SLID, EXPONENT)
    scene = Scene(mesh, CONCRETE, [law, effects.BondDamping(), *held], weaker={"joint": BONDED})
    simulation = Simulation(scene, ImplicitDashpots(STEP))
    simulation.advance_to(round(TIME / STEP))
    centre = mesh.points[simulation.model.topology.vertices].mean(axis=1)
    of_joint = np.abs(centre[:, 0] - 0.5 * LENGTH) < 1e-9
    table, area = simulation.readings.bonds(), 3.0 * simulation.model.bonds["area"]
    if table[~of_joint, 4].any():
        raise RuntimeError("the plate was damaged beside its joint")
    return float(table[of_joint, 3:5].sum() / area[of_joint].sum())


def jointed(seed):
    """A plate whose inner points are moved at random, but for those of the joint in its middle."""
    mesh = bar(LENGTH, WIDTH, CELLS)
    points = mesh.points.copy()
    low, high = points.min(axis=0), points.max(axis=0)
    free = (points > low + 1e-9) & (points < high - 1e-9)
    free[np.abs(points[:, 0] - 0.5 * LENGTH) < 1e-9, 0] = False
    cell = (high - low) / np.array(CELLS)
    points += free * JITTER * cell * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)
    moved = checked_mesh(points, mesh.tetrahedra, mesh.groups)
    halves = moved.group("behind", lambda x: x[:, 0] < 0.5 * LENGTH)
    halves = halves.group("before", lambda x: x[:, 0] > 0.5 * LENGTH)
    return with_inner_group(halves, "joint", lambda x: np.abs(x[:, 0] - 0.5 * LENGTH) < 1e-9)
