"""Hard cases of the blast: contacts, pressure, and what has to be refused."""

from dataclasses import replace

import numpy as np

from cases.closed_forms import damped_opening, velocity_after_impact
from cases.hard import Cases
from cases.hard.blast_run import EDGE, FREE, TOUCHING, Run, X
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, StepControl, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.mesh.topology import body_properties, spheres_of_faces

case = CASES = Cases("blast")
BASIC = {"uniform": Uniform, "multirate_held": Multirate, "implicit": ImplicitDashpots}
LIMITED = (("limited", "controlled"), "separate too fast")
PAIR_TOO_FAST = ("uniform", "multirate_held", "multirate_drifted"), "push bodies apart"
JUMPING = {
    "controlled": Multirate(8e-8, 5e-9, control=StepControl(level_jump=None)),
    "multirate_held": Multirate(8e-8, 5e-9),
}
#: Of cases that know the exact solution of spheres.
SPHERES = {"effects": [effects.SphereContact(), effects.Friction()]}
#: One body moves towards another at rest [m/s].
MEETING = np.array([X, 0.0 * X])


def right_half():
    """The second body of a pair, alone."""
    return checked_mesh(pair().points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})


def beside(mesh, shift, other):
    """Two solids in one mesh, the first shifted [m]."""
    return placed_together({"first": (mesh, shift), "other": (other, np.zeros(3))})


def shot_at_block():
    """A fragment of 100 m/s, 10 µm before a cube of six bodies at rest: mesh and velocities."""
    block = bar(0.1, 0.1, (1, 1, 1))
    velocity = np.outer(np.arange(7) == 0, 100.0 * X)
    return beside(single(), (-1e-5, 0.05, 0.05), block), velocity


@case(TOUCHING)
def fragment_hits_block(trial):
    """A fragment of 100 m/s hits a resting block at once: no energy, no momentum from nowhere."""
    mesh, velocity = shot_at_block()
    run = Run(trial, mesh, velocity=velocity)
    run.nothing_made()
    trial.limit("block not reached", not run.moved[-1, 1:].any(), 0.0, "it was hit")


@case(JUMPING)
def jump_of_ten_levels(trial):
    """A fragment of 100 m/s hits a block whose bodies sleep ten levels above its own."""
    mesh, velocity = shot_at_block()
    run = Run(trial, mesh, 1e-5, methods=JUMPING, velocity=velocity)
    run.nothing_made()
    level = run["level"][0]
    jump = max(1.0, level[0] - level[1:].min())
    trial.limit("10 / jump at the start", 10.0 / jump, 1.0, "log2(v dt0 / l)")


@case(["implicit"], PAIR_TOO_FAST, LIMITED)
def deep_overlap_at_start(trial):
    """Two fragments, their spheres 1 mm in each other, are pushed apart as dashpots let them.

    Mirror images: six spheres of either face meet, each overlapped by the 1 mm.
    """
    run = Run(trial, beside(single(), 1e-3 * X, right_half()), **SPHERES)
    laws = 6.0 * CONCRETE.contact_stiffness, 6.0 * CONCRETE.contact_damping
    way = 1e-3 - damped_opening(0.5 * run.mass[0], *laws, 1e-3, 0.0, run.time_s)
    # Up to 1 % of the overlap: later on those that touch at an angle part before the others.
    early = run.time_s < 2.1e-5
    parted = run.moved[:, 1, 0] - run.moved[:, 0, 0]
    run.momentum_kept()
    run.converged("error of the way apart / way", parted[early], way[early], way[early][-1])


@case(["implicit"], LIMITED)
def mass_ratio_1e4(trial):
    """A body of 3.5 mg meets one of 35 g at 1 m/s: dashpots stop the spheres that meet."""
    both = single(0.05 * 1e-4 ** (1.0 / 3.0)), right_half()
    # The spheres stand behind the faces, so that two of them have to be aimed at each other.
    points = [sphere_on_base(mesh) for mesh in both]
    shift = points[1] - points[0] - 1e-7 * X
    methods = {**TOUCHING, "limited": Uniform(4e-9, dashpot="limited")}
    # The exact solution knows one contact; later the small body has turned, and others meet.
    motion = {"methods": methods, "velocity": MEETING}
    run = Run(trial, beside(both[0], shift, both[1]), 2e-5, **motion, **SPHERES)
    centres = [body_properties(mesh, CONCRETE.density)[1][0] for mesh in both]
    arms = [point - centre for point, centre in zip(points, centres)]
    true = velocity_after_impact(both, CONCRETE, arms, X, X)
    speed = run["velocity"][:, 0]
    run.momentum_kept()
    run.converged("velocity error / speed", speed[-1], true, 1.0)


def sphere_on_base(mesh):
    """Where the first contact sphere of a single body's face in x = 0 touches it [m], (3,)."""
    _, centre, _ = body_properties(mesh, 1.0)
    spheres = spheres_of_faces(mesh, centre, effects.SphereGeometry().divisions)
    apex = int(abs(mesh.points[mesh.tetrahedra[0]][:, 0]).argmax())
    return (centre[0] + spheres.centre[0, apex, 0]) * [0.0, 1.0, 1.0]


@case(("controlled", "implicit"))
def strongest_dashpot(trial):
    """Contacts of the least restitution bring two bodies to one speed, to half of it."""
    laws, least = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()], 0.01
    mesh = beside(single(), -1e-7 * X, right_half())
    contact = [effects.BodyContact(restitution=least), effects.StickingFriction()]
    run = Run(trial, mesh, effects=[*laws, *contact], velocity=MEETING)
    speed = run["velocity"][:, :, 0]
    run.momentum_kept()
    run.converged("speed error / first", speed[-1], 0.5, 1.0, formula="1 % of one speed")


@case(("multirate_held", "controlled", "implicit"))
def sudden_pressure_on_sleepers(trial):
    """Full pressure within 10 ns on bodies at rest: momentum is the pressure's to rounding."""
    gas = effects.GasPressure(group="left", peak=100e6, rise=1e-8, decay_ratio=1e7)
    acting = [effects.BondDamping(), effects.Softening(), effects.ShearSlip(), gas]
    methods = {**FREE, "multirate_held": Multirate(1e-8, 1e-7)}
    run = Run(trial, bar(0.2, 0.1, (2, 1, 1)), methods=methods, effects=acting)
    impulse, given = run.momentum[:, 0], 100e6 * 0.1**2 * run.time_s[-1]
    late, report = (2.0 * run.dt + 1e-8) / run.time_s[-1], run.result.report
    trial.limit("impulse error", abs(impulse[-1] / given - 1.0), late, "(2 dt + rise) / t")
    trial.limit("momentum error", report.linear_momentum_error, 1e-12, "rounding")
    residual = report.energy_residual_fraction
    trial.limit("energy from nowhere", residual, 0.05, "the specification")


@case(("implicit",))
def blocks_at_500_m_s(trial):
    """Two blocks of 48 bodies meet at 500 m/s: momentum is kept, and no energy is made."""
    block = bar(0.1, 0.1, (2, 2, 2))
    mesh = beside(block, np.array([-0.1001, 0.002, 0.003]), block)
    first = np.arange(mesh.body_count) < block.body_count
    methods = {"implicit": ImplicitDashpots(5e-8, sweeps=(2, 50), tolerance=1e-3)}
    options = {"methods": methods, "velocity": np.outer(first, 500.0 * X)}
    run = Run(trial, mesh, 5e-6 if trial.quick else 5e-5, **options)
    run.nothing_made()
    hit = np.ptp(run["velocity"][-1, ~first, 0])
    trial.limit("block not reached", hit == 0.0, 0.0, "they meet after 0.2 us")


@case(
    ["implicit"],
    scene_turned_by_90_degrees=([[0, -1, 0], [1, 0, 0], [0, 0, 1]], "turned by 90 degrees"),
    scene_mirrored=([[1, 0, 0], [0, -1, 0], [0, 0, 1]], "mirrored"),
)
def same_in_another_frame(trial, matrix, _):
    """Scene {1}: the same motion.

    It is a pair of bodies, one of which hits the other.
    """
    turn = np.asarray(matrix, dtype=float)
    mesh = beside(single(), np.array([-1e-5, 0.0, 0.0]), right_half())
    bodies = mesh.tetrahedra.copy()
    if np.linalg.det(turn) < 0.0:
        bodies[:, [2, 3]] = bodies[:, [3, 2]]
    velocity = np.array([[1.0, 0.2, 0.1], [0.0] * 3])
    here = Run(trial, mesh, velocity=velocity)
    there = Run(trial, checked_mesh(mesh.points @ turn.T, bodies, {}), velocity=velocity @ turn.T)
    apart = abs(here.moved @ turn.T - there.moved) / abs(here.moved).max()
    # Sweeps visit the contacts in another order, and end once they agree to this.
    bound = TOUCHING["implicit"].tolerance
    trial.limit("difference / way", apart, bound, "tolerance of the sweeps")


@case(("implicit",))
def friction_of_a_thousand(trial):
    """A body that grazes another with a friction of 1000 gains nothing from it."""
    mesh = beside(single(), -1e-6 * X, right_half())
    rough = replace(CONCRETE, friction=1e3)
    Run(trial, mesh, material=rough, velocity=[[1.0, 5.0, 3.0], [0.0] * 3]).nothing_made()


@case(("implicit",))
def heavy_top(trial):
    """A body 1000 times as heavy falls on a small one at 1 m/s: no energy, no momentum is made."""
    run = Run(trial, beside(single(0.5), -1e-6 * X, right_half()), velocity=[X, 0.0 * X])
    run.nothing_made()
    trial.limit("body not reached", not run.moved[-1, 1].any(), 0.0, "it was hit")


@case((), (["implicit"], "share"))
def blocks_within_each_other(trial):
    """Two blocks that begin at one place, but for a millimetre."""
    block = bar(0.1, 0.1, (1, 1, 1))
    run = Run(trial, beside(block, np.array([1e-3, 2e-3, 3e-3]), block))
    trial.warnings += run.result.report.unresolved


@case((), (["uniform"], "moves at"))
def faster_than_the_bound(trial):
    """A body beyond the speed at which a scene counts as run away."""
    Run(trial, single(), 1e-5, methods=FREE, effects=(), velocity=1e3 * X, max_speed=100.0)


@case((), (["uniform"], "volume"))
def flat_element(_):
    """Four points in one plane are no body."""
    checked_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2, 3]], {})


@case((), (["uniform"], "face"))
def face_of_three(_):
    """A face between three bodies is no bond."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1]]
    checked_mesh(points, [[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]], {})


@case((), (["uniform"], "points"))
def points_at_one_place(_):
    """Two bodies that share a place but no points look joined, and are not."""
    checked_mesh(np.vstack([single().points] * 2), [[0, 1, 2, 3], [4, 5, 6, 7]], {})


@case((), (BASIC, "positive finite"))
def step_that_is_no_number(trial):
    """A step that is no number."""
    BASIC[trial.method](float("nan"))


@case((), (["uniform"], "fracture_energy"))
def strength_beyond_stiffness(_):
    """A bond whose fracture energy is spent before it reaches its strength."""
    replace(CONCRETE, fracture_energy=1.0)


@case(["implicit"])
def vertices_at_coarse_faces(trial):
    """Sixteen bodies fired at 50 m/s, vertex first, at coarse faces: none passes."""
    fire(trial, effects.BodyContact())


@case((), (["implicit"], "volume"))
def vertices_between_spheres(trial):
    """The same where faces are six spheres: they pass between, and the run says so."""
    fire(trial, effects.SphereContact())


def fire(trial, contact):
    """Fire bodies at faces four times their size; they do not pass."""
    draw, parts = np.random.default_rng(0), {}
    for k in range(4 if trial.quick else 16):
        y, z = draw.uniform(0.05, 0.15, 2)
        parts[f"shot{k}"] = right_half(), (-0.041, y, z + 1.0 * k)
        parts[f"wall{k}"] = bar(0.1, 0.2, (1, 1, 1)), (0.0, 0.0, 1.0 * k)
    mesh = placed_together(parts)
    first = np.arange(mesh.body_count) % 7 == 0
    run = Run(trial, mesh, 1e-3, velocity=np.outer(first, 50.0 * X), effects=[contact])
    run.nothing_made()
    way = run.moved[-1, first, 0].max() / EDGE
    trial.limit("way / size", way, 0.5, "a vertex sinks in, at most by half")
