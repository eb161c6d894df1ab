"""A crack that divides a notched plate: its energy, and how rough the faces are that it takes."""

from functools import partial

import numpy as np

from _trust.meshes import material_of, plate, springs_step
from _trust.number import Number
from taichi_dem import ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.plot_style import BLACK, RED
from taichi_dem.mesh.mesh import with_cut
from taichi_dem.output.cracks import crack_areas

#: Plate and depth of its notch [m], edges of elements [m].
LENGTH, HEIGHT, NOTCH, EDGES = 0.1, 0.05, 0.015, (10e-3, 7e-3, 5e-3)
#: E [Pa] and nu of the plate; speed of its ends [m/s], and the time in which they take it up [s].
YOUNG, POISSON, SPEED, RAMP = 32e9, 0.2, 0.05, 1e-4
#: Strength [Pa] and fracture energy [J/m2] of its bonds, and what else they have.
STRENGTH, ENERGY = 3e6, 20.0
MORE = {"density": 2450.0, "friction_angle": 30.0, "cohesion": 1e8, "damping_ratio": 0.1}
#: Largest opening of the ends over that at which a bond has failed, and looks on the way there.
OPEN, LOOKS = 12.0, 48


def crack(effort):
    """What the account leaves open; energy in broken faces and beside them; area of the faces."""
    edges = EDGES[: effort.sizes]
    found = np.array([[divided(edge, seed) for edge in edges] for seed in effort.seeds])
    left_open, energy, beside, area = found.transpose(2, 0, 1)
    numbers = [
        Number(
            *("crack_account", "energy that the account of a crack leaves open", "1"),
            *("energy is kept", 0.0, np.abs(left_open), 0.0, 0.001),
        ),
        Number(
            *("crack_energy", "energy spent in broken faces, by their area and fracture energy"),
            *("1", "a crack in one plane", 1.0, energy, 0.999, 1.001),
            note="a face goes with the first of its three units that fails",
        ),
        Number(
            *("crack_beside", "share of the energy that is spent in faces beside the crack", "1"),
            *("a crack in one plane", 0.0, beside, 0.0, 0.001),
            note="faces around a crack soften and hold again when it has passed",
        ),
    ]
    rough = "a crack follows faces, whatever their size"
    numbers += [
        Number(
            f"crack_area_{1e3 * edge:g}_mm",
            f"broken area over that of the plane, elements of {1e3 * edge:g} mm",
            *("1", "a crack in one plane", 1.0, area[:, k]),
            note=rough,
        )
        for k, edge in enumerate(edges)
    ]
    return numbers, partial(draw, edges=edges, area=area)


def divided(edge, seed):
    """What ``measured`` tells of a plate on a random mesh."""
    mesh = plate(LENGTH, HEIGHT, edge, seed)
    mesh = with_cut(mesh, "notch", (0.5 * LENGTH, 0, 0), (1, 0, 0), lambda x: x[:, 1] < NOTCH)
    strengths = {"tensile_strength": STRENGTH, "fracture_energy": ENERGY}
    material, _ = material_of(mesh, YOUNG, POISSON, **strengths, **MORE)
    pull = [
        effects.PrescribedMotion(group, (way * SPEED, 0, 0), ramp=RAMP)
        for group, way in (("left", -1), ("right", 1))
    ]
    laws = [effects.BondDamping(), effects.Softening()]
    scene = Scene(mesh, material, [*laws, *pull], unbonded=["notch"])
    simulation = Simulation(scene, ImplicitDashpots(springs_step(scene)))
    time_s = 0.5 * OPEN * material.failure_opening / SPEED + RAMP
    every = round(time_s / simulation.method.dt0 / LOOKS)
    for look in range(1, LOOKS + 1):
        simulation.advance_to(look * every)
        if parted(simulation):
            return measured(simulation, edge)
    raise InputError(f"the plate of seed {seed} did not come apart at {OPEN:g} times its opening")


def broken_bonds(simulation):
    """Whether each bond has been released."""
    return simulation.state.broken()


def parted(simulation):
    """Whether no bonds lead from the left end to the right one any more."""
    model = simulation.model
    piece, x = model.pieces(broken_bonds(simulation)), model.centre[:, 0]
    return piece[x.argmin()] != piece[x.argmax()]


def measured(simulation, edge):
    """Of a plate that came apart: the three shares of energy, and area over the plane's."""
    model, broken = simulation.model, broken_bonds(simulation)
    bond = simulation.energy_balance.tables()[1]
    spent = bond[:, 3] + bond[:, 4]
    area = crack_areas(model)[broken].sum()
    left_open = simulation.energy_balance.account()["residual"] / spent.sum()
    beside = spent[~broken].sum() / spent.sum()
    faces = spent[broken].sum() / (ENERGY * area)
    return left_open, faces, beside, area / ((HEIGHT - NOTCH) * edge)


def draw(axes, edges, area):
    """Broken area over that of the plane, over the size of the elements."""
    axes.plot(1e3 * np.array(edges), area.T, "o", color=RED, ms=4)
    axes.plot([], [], "o", color=RED, label="a random mesh")
    axes.axhline(1.0, color=BLACK, lw=0.8, label="a plane")
    axes.set(xlabel="edge of an element [mm]", xscale="log")
    axes.set_ylabel("broken area / area of the plane [1]")
    axes.legend()
