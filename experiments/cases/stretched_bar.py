"""A bar that is stretched until it breaks everywhere: its mean fragment over the formula of others.

Zhou, Molinari and Ramesh, Appl. Phys. Lett. 88 (2006) 261905, fit it to their simulations. What a
cohesive law itself gives, beside any mesh, comes from a row of masses and springs.
"""

import math
from itertools import product

import numpy as np

from cases.meshes import with_moved_nodes
from cases.trust.plates import material_of, pulled
from taichi_dem.kit import study
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import topology_of

#: E [Pa], density [kg/m^3], strength [Pa], fracture energy [J/m^2], wave speed [m/s].
YOUNG, DENSITY, STRENGTH, ENERGY = 32e9, 2450.0, 3e6, 3.0
SPEED = math.sqrt(YOUNG / DENSITY)
#: Boxes in a fragment of the formula, and in a bar of 20 of these; spread of the strength.
BOXES, COUNT, SPREAD = 5, 100, 0.003
#: Corners of softening: way beyond the onset, 1 where one line ends, and traction over strength.
SOFTENING = {
    "one_line": ((0.0, 1.0), (1.0, 0.0)),
    "two_lines": ((0.0, 0.4, 1.8), (1.0, 1.0 / 3.0, 0.0)),
    "late": ((0.0, 0.5, 5.0 / 7.0), (1.0, 0.7, 0.0)),
}
#: Largest shifts of the points of meshes, as shares of a box.
MESHES = {"rows": 0.0, "scattered": 0.2}
TABLE = study.Table(
    rate=("rate", "rate [1/s]", ".0f"),
    name=("name", "bar"),
    bars=("bars", "bars", "d"),
    mean=("mean", "mean fragment / formula", ".2f", "1"),
    error=("error", "standard error", ".2f", "1"),
)


def formula(rate):
    """Mean fragment [m] at a rate [1/s]."""
    length = YOUNG * ENERGY / STRENGTH**2
    share = rate * YOUNG * length / (SPEED * STRENGTH)
    return 4.5 * length / (1.0 + 0.77 * share**0.25 + 5.4 * share**0.75)


def until(rate):
    """Time [s] by which a bar is in pieces: three times that in which a fragment's crack opens."""
    opened = 2.0 * ENERGY / STRENGTH
    return STRENGTH / YOUNG / rate + 3.0 * opened / (rate * formula(rate))


def strengths(count, seed):
    """Strength of each face over the mean, (count,)."""
    return 1.0 + SPREAD * np.random.default_rng(seed).uniform(-1.0, 1.0, count)


def ideal(rate, corners, seed):
    """Fragments of a row of masses whose springs soften along lines through corners."""
    edge = formula(rate) / BOXES
    stiffness, step = YOUNG / edge, 0.5 * edge / SPEED
    onset = strengths(COUNT - 1, seed) * STRENGTH / stiffness
    steep = 2.0 * ENERGY * stiffness / STRENGTH**2 - 1.0
    velocity = rate * edge * (np.arange(COUNT) - 0.5 * (COUNT - 1))
    place, most = np.zeros(COUNT), onset.copy()
    for _ in range(math.ceil(until(rate) / step)):
        place += step * velocity
        jump = np.diff(place)
        most = np.maximum(most, jump)
        # Unloading goes to the origin; what is pressed is whole.
        left = np.interp((most / onset - 1.0) / steep, *corners) * onset / most
        pull = stiffness * jump * np.where(jump > 0.0, left, 1.0)
        velocity[1:-1] += step / (DENSITY * edge) * np.diff(pull)
    return 1 + np.count_nonzero(most >= onset * (1.0 + steep * corners[0][-1]))


def meshed(rate, shift, laws, seed):
    """Fragments of a bar of boxes of six bodies each, whose points are shifted."""
    edge = formula(rate) / BOXES
    length = COUNT * edge
    mesh = with_moved_nodes(bar(length, edge, (COUNT, 1, 1)), shift * edge, seed)
    options = {"tensile_strength": STRENGTH, "fracture_energy": ENERGY, "density": DENSITY}
    more = {"friction_angle": 30.0, "cohesion": 3.0 * STRENGTH, "damping_ratio": 0.0}
    material = material_of(mesh, YOUNG, 0.0, (0,), **options, **more)
    simulation = pulled(
        mesh,
        material,
        laws,
        0.5 * rate * length,
        velocity=lambda centre: (centre - [0.5 * length, 0.0, 0.0]) * [rate, 0.0, 0.0],
        strength=strengths(topology_of(mesh).bond_count, seed),
    )
    simulation.advance_to(round(until(rate) / simulation.method.dt0))
    return len(np.unique(simulation.model.pieces(simulation.state.broken())))


def fragments(name, rate, laws, bars):
    """Fragments of a number of bars of a kind, ten times as many where there is no mesh."""
    if name in MESHES:
        return [meshed(rate, MESHES[name], laws, seed) for seed in range(bars)]
    return [ideal(rate, SOFTENING[name], seed) for seed in range(10 * bars)]


def fragmented(rates, laws, bars):
    """Mean fragment of bars over the formula's, by kind and rate. Rows of TABLE."""
    runs = [*product(rates, (*SOFTENING, *MESHES))]
    with ProgressBar("bars") as progress:
        for done, (rate, name) in enumerate(runs):
            progress.count(done, len(runs))
            means = COUNT / BOXES / np.array(fragments(name, rate, laws, bars))
            row = {"rate": rate, "name": name, "bars": len(means), "mean": float(means.mean())}
            yield {**row, "error": float(means.std(ddof=1)) / math.sqrt(len(means))}
