"""A plate parts along a plane joint: its energy by Benzeggagh and Kenane."""

from functools import partial

import numpy as np

from _trust.number import Number
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.kit.plot_style import BLACK, BLUE
from taichi_dem.mesh.mesh import checked_mesh, with_inner_group
from taichi_dem.mesh.shapes import bar

SOURCE = "Benzeggagh and Kenane, Compos. Sci. Technol. 56 (1996) 439"
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
    law = np.array([energy_of(angle) for angle in ANGLES])
    words = {0: "is opened", 45: "is moved at 45 degrees", 90: "is slid"}
    numbers = tuple(
        Number(
            f"joint_{angle}",
            f"energy of a joint that {word}, by the law of mixed modes",
            *("1", SOURCE, 1.0),
            (spent / law)[:, ANGLES.index(angle)],
        )
        for angle, word in words.items()
    )
    return numbers, partial(draw, spent=spent)


def energy_of(angle):
    """Fracture energy [J/m2] of a way at an angle [degrees]."""
    turn = np.radians(angle)
    parts = (
        CONCRETE.normal_stiffness * np.cos(turn) ** 2,
        CONCRETE.shear_stiffness * np.sin(turn) ** 2,
    )
    return OPENED + (SLID - OPENED) * (parts[1] / sum(parts)) ** EXPONENT


def taken(seed, angle):
    """Energy [J/m2] that the bonds of the joint have taken once it has parted."""
    mesh, turn = plate(seed), np.radians(angle)
    pull = SPEED * np.array([np.cos(turn), np.sin(turn), 0.0])
    held = [effects.Fixed("behind"), effects.PrescribedMotion("before", tuple(pull))]
    law = effects.MixedMode(SLID, EXPONENT)
    scene = Scene(mesh, CONCRETE, [law, effects.BondDamping(), *held], weaker={"joint": BONDED})
    simulation = Simulation(scene, ImplicitDashpots(STEP))
    simulation.advance_to(round(TIME / STEP))
    top = simulation.model.topology
    centre = mesh.points[top.vertices].mean(axis=1)
    of_joint = np.abs(centre[:, 0] - 0.5 * LENGTH) < 1e-9
    table, area = simulation.readings.bonds(), 3.0 * simulation.model.bonds["area"]
    if table[~of_joint, 4].any():
        raise RuntimeError("the plate was damaged beside its joint")
    return float(table[of_joint, 3:5].sum() / area[of_joint].sum())


def plate(seed):
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


def draw(axes, spent):
    """Energies over the angle beside the law."""
    angles = np.linspace(0.0, 90.0, 91)
    axes.plot(angles, [energy_of(angle) for angle in angles], color=BLACK, lw=0.8, label="law")
    axes.plot(ANGLES, spent.T, "o", color=BLUE, ms=4)
    axes.plot([], [], "o", color=BLUE, label="plates")
    axes.set(xlabel="pull against the joint's normal [degrees]", ylabel="energy [J/m2]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
