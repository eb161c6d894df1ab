"""Hard cases of the blast: clocks, sizes, distances and limits far from those of the paper."""

from dataclasses import replace
from functools import partial

import numpy as np

from _closed_forms import damped_opening
from _hard_cases._blast_run import AREA, EDGE, EPS, FREE, MASS, TOUCHING, Run, beside, right_half
from _hard_cases.blast_bonds import apart, free
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Uniform, effects, simulate
from taichi_dem.kit.study.cases import Cases
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single

case = CASES = Cases("blast")
X = np.array([1.0, 0.0, 0.0])
#: Two blocks that meet at 500 m/s, and a fragment that flies at 50 m/s.
FAST, SHOT = 500.0, 50.0


@case(FREE)
def clock_beyond_31_bits(trial):
    """A body flies straight while the clock passes 2^31 and 2^32 ticks: 2048 and 4096 steps."""
    longest = max(method.dt0 for method in FREE.values())
    mesh, motion = single(), {"velocity": (10.0, -20.0, 5.0)}
    run = Run(trial, mesh, 5000 * longest, methods=FREE, effects=(), **motion)
    off = abs(run.moved[:, 0] - run["velocity"][0, 0] * run.time_s[:, None])
    steps = run.steps * 2.0 ** run["level"].max()
    bound = 0.5 * steps * EPS * abs(run["position"]).max()
    trial.limit("off its path [m]", off, bound, "n steps x eps / 2 x place")
    trial.limit("4096 / largest steps", 4096.0 / run.steps, 1.0, "2^32 ticks")


@case((), (FREE, "until must"))
def more_steps_than_can_be_counted(trial):
    """A run of more steps than the clock can count."""
    method = FREE[trial.method]
    simulate(Scene(single(), CONCRETE), method=method, until=2.0**43 * method.dt0)


@case(("uniform", "multirate_held", "multirate_drifted"))
def undamped_block_for_long(trial):
    """An undamped block in motion keeps its energy: none is lost or made over many steps."""
    mesh, dt = bar(0.2, 0.1, (2, 1, 1)), 1e-7
    method = Uniform(dt)
    if trial.method != "uniform":
        method = Multirate(dt, 1e-5, trial.method[10:])
    shape = np.sin(np.arange(3 * mesh.body_count).reshape(-1, 3))
    until = (20_000 if trial.quick else 10_000_000) * dt
    given = {"effects": (), "velocity": 0.1 * shape}
    run = Run(trial, mesh, until, methods={trial.method: method}, **given)
    account = run.result.report.energy_balance
    # Strain and kinetic energy beat by (w dt)^2 / 4; w dt is 2 at the limit of the springs.
    held = abs(account["residual"]) / run.kinetic_energy[0]
    trial.limit("energy error / given", held, 0.01, "no trend, and (w dt)^2 / 4")
    run.momentum_kept()


@case(("multirate_held", "multirate_drifted"))
def levels_that_flip(trial):
    """A pair swings so fast that levels change in every quarter period: no energy is made.

    Each change of a step costs energy, in proportion to the step, until none is needed any more.
    """
    k = AREA * CONCRETE.normal_stiffness
    dt = 2.0 * np.pi * (0.5 * MASS / k) ** 0.5 / 64.0
    # A quarter of the largest speed is what the largest step bears.
    method = Multirate(dt, 0.25 * dt, trial.method[10:])
    steps = 20_000 if trial.quick else 1_000_000
    given = {"effects": (), "velocity": [X, -X], "methods": {trial.method: method}}
    run = Run(trial, pair(), steps * dt, **given)
    run.momentum_kept()
    run.no_energy_made()
    few = 2.0 / len(np.unique(run["level"]))
    trial.limit("2 / levels seen", few, 1.0, "speeds up to four times what the largest step bears")


def vertices_at_faces(trial, contact):
    """Bodies fired at 50 m/s, vertex first, at faces four times their size; they do not pass."""
    draw, parts = np.random.default_rng(0), {}
    for k in range(4 if trial.quick else 16):
        y, z = draw.uniform(0.05, 0.15, 2)
        parts[f"shot{k}"] = right_half(), (-0.041, y, z + 1.0 * k)
        parts[f"wall{k}"] = bar(0.1, 0.2, (1, 1, 1)), (0.0, 0.0, 1.0 * k)
    mesh = placed_together(parts)
    first = np.arange(mesh.body_count) % 7 == 0
    options = {"velocity": np.outer(first, SHOT * X), "effects": [contact]}
    run = Run(trial, mesh, 1e-3, **options)
    run.momentum_kept()
    run.no_energy_made()
    way = run.moved[-1, first, 0].max() / EDGE
    trial.limit("way / size", way, 0.5, "a vertex sinks in, at most by half")


case.add(
    "vertices_at_coarse_faces",
    "Sixteen bodies fired at 50 m/s, vertex first, at coarse faces: none passes.",
    partial(vertices_at_faces, contact=effects.BodyContact()),
    ["implicit"],
)
case.add(
    "vertices_between_spheres",
    "The same where faces are six spheres: they pass between, and the run says so.",
    partial(vertices_at_faces, contact=effects.SphereContact()),
    [],
    (["implicit"], "volume"),
)


def eases_at_scale(trial, edge):
    """A pair of another size [m], opened by 1e-4 of it, eases as its springs and dashpots let it.

    The rate of the dashpots grows as 1 / edge, that of the springs as its root.
    """
    area, mesh = 0.25 * 3.0**0.5 * edge**2, pair(edge)
    mass = CONCRETE.density * edge**3 / (6.0 * 2.0**0.5)
    k, c = area * CONCRETE.normal_stiffness, area * CONCRETE.normal_damping
    # Shear units turn the bodies 20 times as fast as they part.
    dt = min(0.5 * mass / c, (0.5 * mass / k) ** 0.5) / 200.0
    opening = 1e-3 * CONCRETE.onset_opening
    methods = {"uniform": Uniform(dt), "implicit": ImplicitDashpots(dt, refresh=1e6)}
    run = Run(trial, mesh, 1000 * dt, methods=methods, shift=apart(opening))
    true = damped_opening(0.5 * mass, k, c, opening, 0.0, run.time_s)
    run.converged("error of the opening / first", run.gap(opening), true, opening)


SIZES = {"micrometre": 1e-6, "millimetre": 1e-3, "hundred_metres": 100.0, "kilometre": 1e3}
for word, size in SIZES.items():
    question = f"Bodies of {size:g} m ease as those of 50 mm."
    scaled = partial(eases_at_scale, edge=size)
    case.add(f"bodies_of_a_{word}", question, scaled, ("uniform", "implicit"))


@case(TOUCHING)
def fragment_a_thousand_km_away(trial):
    """A pair eases as if alone while the same scene holds a fragment 1000 km away."""
    far = placed_together({"pair": (pair(), np.zeros(3)), "far": (single(), 1e6 * X)})
    runs = [
        Run(
            trial, mesh, shift=[*apart(5e-6), *[[0.0] * 3] * (mesh.body_count - 2)], bodies=slice(2)
        )
        for mesh in (pair(), far)
    ]
    difference = abs(runs[0].moved - runs[1].moved)
    trial.limit("difference [m]", difference, 1e-18, "same bits, or a sum in another order")


@case(("implicit",))
def blocks_at_500_m_s(trial):
    """Two blocks of 48 bodies meet at 500 m/s: momentum is kept, and no energy is made."""
    block = bar(0.1, 0.1, (2, 2, 2))
    mesh = beside(block, np.array([-0.1001, 0.002, 0.003]), block)
    first = np.arange(mesh.body_count) < block.body_count
    methods = {"implicit": ImplicitDashpots(5e-8, sweeps=(2, 50), tolerance=1e-3)}
    options = {"methods": methods, "velocity": np.outer(first, FAST * X)}
    run = Run(trial, mesh, 5e-6 if trial.quick else 5e-5, **options)
    run.momentum_kept()
    run.no_energy_made()
    hit = np.ptp(run["velocity"][-1, ~first, 0])
    trial.limit("block not reached", hit == 0.0, 0.0, "they meet after 0.2 us")


@case(TOUCHING)
def all_bonds_break_at_once(trial):
    """A block whose bodies fly apart at up to 2 km/s: every bond fails in the first steps."""
    mesh = bar(0.1, 0.1, (1, 1, 1))
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    velocity = 4e4 * (centre - centre.mean(axis=0))
    run = Run(trial, mesh, 2e-6, velocity=velocity)
    bonds = run.result.model.bond_count
    trial.limit("bonds that held", bonds - run.broken, 0.0, "all open at 100 m/s at least")
    run.momentum_kept()
    run.no_energy_made()


@case(TOUCHING)
def bond_exactly_at_its_limit(trial):
    """A pair opened exactly to the onset of softening gives back all of its strain, undamaged."""
    opening = CONCRETE.onset_opening
    run = Run(trial, pair(), shift=apart(opening))
    run.momentum_kept()
    trial.limit("bonds broken", run.broken, 0.0, "at the onset nothing is lost")
    softened = run.result.report.energy_balance["softening"]
    strain = 0.5 * CONCRETE.normal_stiffness * opening**2 * 0.25 * 3.0**0.5 * 0.05**2
    # The place is rounded to an ulp of the body's size, and the opening with it.
    bound = 4.0 * np.spacing(0.05) / opening
    trial.limit("softening / strain", abs(softened) / strain, bound, "4 ulp(size) / opening")


@case(TOUCHING)
def bond_open_beyond_failure(trial):
    """A pair that begins beyond its failure opening lets go in the first step and rests."""
    run = Run(trial, pair(), 1e-6, shift=apart(1.5 * CONCRETE.failure_opening))
    trial.limit("bonds that held", 1 - run.broken, 0.0, "beyond failure at the start")
    speed = abs(run["velocity"]).max()
    strain = 0.5 * 0.25 * 3.0**0.5 * 0.05**2 * CONCRETE.fracture_energy / run.mass[0]
    trial.limit("speed / that of all of G_f", speed / np.sqrt(2.0 * strain), 1.0, "(A G_f / m)^0.5")


@case(TOUCHING)
def three_units_fail_at_once(trial):
    """A pair torn straight apart fails at its three units at once: it gets no spin."""
    run = Run(trial, pair(), velocity=[[-100.0, 0.0, 0.0], [100.0, 0.0, 0.0]])
    trial.limit("bonds that held", 1 - run.broken, 0.0, "v m / (2 c A) > 30 um")
    turned = abs(run["spin"]).max() * 0.05 / 200.0
    trial.limit("spin x size / speed", turned, 1e-9, "symmetry, to rounding of the places")


def same_in_another_frame(trial, matrix):
    """A strained pair beside a fragment that hits it moves alike where the scene is turned."""
    turn = np.asarray(matrix, dtype=float)
    mesh = beside(single(), np.array([-1e-5, 0.0, 0.0]), right_half())
    bodies = mesh.tetrahedra.copy()
    if np.linalg.det(turn) < 0.0:
        bodies[:, [2, 3]] = bodies[:, [3, 2]]
    runs = [
        Run(trial, made, velocity=[[1.0, 0.2, 0.1], [0.0] * 3] @ by.T)
        for made, by in ((mesh, np.eye(3)), (checked_mesh(mesh.points @ turn.T, bodies, {}), turn))
    ]
    way = runs[0].moved @ turn.T - runs[1].moved
    scale = abs(runs[0].moved).max()
    # Sweeps visit the contacts in another order, and end once they agree to this.
    bound = TOUCHING["implicit"].tolerance
    trial.limit("difference / way", abs(way) / scale, bound, "tolerance of the sweeps")


FRAMES = {
    "scene_turned_by_90_degrees": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "scene_mirrored": [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
}
for name, matrix in FRAMES.items():
    same = partial(same_in_another_frame, matrix=matrix)
    case.add(name, f"{name.replace('_', ' ').capitalize()}: the same motion.", same, ["implicit"])


@case(("implicit", "multirate_held"))
def points_renumbered(trial):
    """The same bodies with their points numbered backwards move with the same bits."""
    mesh = pair()
    last = mesh.point_count - 1
    other = checked_mesh(mesh.points[::-1], last - mesh.tetrahedra, {})
    runs = [Run(trial, one, shift=apart(5e-6)) for one in (mesh, other)]
    trial.limit("difference [m]", abs(runs[0].moved - runs[1].moved), 0.0, "same bits")


@case(("implicit",))
def friction_of_a_thousand(trial):
    """A body that grazes another with a friction of 1000 gains nothing from it."""
    mesh = beside(single(), -1e-6 * X, right_half())
    rough = replace(CONCRETE, friction=1e3)
    run = Run(trial, mesh, material=rough, velocity=[[1.0, 5.0, 3.0], [0.0] * 3])
    run.momentum_kept()
    run.no_energy_made()


@case(("implicit",))
def heavy_top(trial):
    """A body 1000 times as heavy falls on a small one at 1 m/s: no energy, no momentum is made."""
    mesh = beside(single(0.5), -1e-6 * X, right_half())
    run = Run(trial, mesh, velocity=[X, 0.0 * X])
    run.momentum_kept()
    run.no_energy_made()
    trial.limit("body not reached", not run.moved[-1, 1].any(), 0.0, "it was hit")


@case(FREE)
def sizes_of_1_to_1000(trial):
    """Bodies of 1 mm and 1 m fly side by side, each straight."""
    mesh = placed_together({"small": (single(1e-3), -2.0 * X), "large": (single(1.0), 0.0 * X)})
    velocity = np.array([[3.0, 2.0, 1.0], [-3.0, 2.0, -1.0]])
    run = free(trial, mesh, velocity=velocity)
    off = abs(run.moved - velocity * run.time_s[:, None, None])
    steps = run.steps * 2.0 ** run["level"].max()
    bound = steps * EPS * abs(run["position"]).max()
    trial.limit("off their paths [m]", off, bound, "n steps x eps x place")


@case((), (["implicit"], "share"))
def blocks_within_each_other(trial):
    """Two blocks that begin at one place, but for a millimetre."""
    block = bar(0.1, 0.1, (1, 1, 1))
    run = Run(trial, beside(block, np.array([1e-3, 2e-3, 3e-3]), block))
    trial.warnings += run.result.report.unresolved
