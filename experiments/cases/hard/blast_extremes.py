"""Hard cases of the blast: clocks, sizes, distances and limits far from those of the paper."""

import numpy as np

from cases.hard import Cases
from cases.hard.blast_bonds import free
from cases.hard.blast_run import AREA, EDGE, FREE, MASS, TOUCHING, Run, X, apart
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Uniform, simulate
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single

case = CASES = Cases("blast")
MULTIRATE = ("multirate_held", "multirate_drifted")


@case(FREE)
def clock_beyond_31_bits(trial):
    """A body flies straight while the clock passes 2^31 and 2^32 ticks: 2048 and 4096 steps."""
    until = 5000 * max(method.dt0 for method in FREE.values())
    motion = {"methods": FREE, "effects": (), "velocity": (10.0, -20.0, 5.0)}
    run = Run(trial, single(), until, **motion)
    run.flies_straight()
    trial.limit("4096 / largest steps", 4096.0 / run.steps, 1.0, "2^32 ticks")


@case((), (FREE, "until must"))
def more_steps_than_can_be_counted(trial):
    """A run of more steps than the clock can count."""
    method = FREE[trial.method]
    simulate(Scene(single(), CONCRETE), method=method, until=2.0**43 * method.dt0)


@case(("uniform", *MULTIRATE))
def undamped_block_for_long(trial):
    """An undamped block in motion keeps its energy: none is lost or made over many steps."""
    mesh, dt = bar(0.2, 0.1, (2, 1, 1)), 1e-7
    method = Uniform(dt)
    if trial.method != "uniform":
        method = Multirate(dt, 1e-5, trial.method[10:])
    shape = np.sin(np.arange(3 * mesh.body_count).reshape(-1, 3))
    until = (20_000 if trial.quick else 10_000_000) * dt
    given = {"effects": (), "velocity": 0.1 * shape, "methods": {trial.method: method}}
    run = Run(trial, mesh, until, **given)
    # Strain and kinetic energy beat by (w dt)^2 / 4; w dt is 2 at the limit of the springs.
    held = abs(run.result.report.energy_balance["residual"]) / run.kinetic_energy[0]
    trial.limit("energy error / given", held, 0.01, "no trend, and (w dt)^2 / 4")
    run.momentum_kept()


@case(MULTIRATE)
def levels_that_flip(trial):
    """A pair swings so fast that levels change in every quarter period: no energy is made.

    Each change of a step costs energy, in proportion to the step, until none is needed any more.
    """
    k = AREA * CONCRETE.normal_stiffness
    dt = 2.0 * np.pi * (0.5 * MASS / k) ** 0.5 / 64.0
    # A quarter of the largest speed is what the largest step bears.
    method = Multirate(dt, 0.25 * dt, trial.method[10:])
    until = (20_000 if trial.quick else 1_000_000) * dt
    given = {"effects": (), "velocity": [X, -X], "methods": {trial.method: method}}
    run = Run(trial, pair(), until, **given)
    run.nothing_made()
    few = 2.0 / len(np.unique(run["level"]))
    trial.limit("2 / levels seen", few, 1.0, "speeds up to four times what the largest step bears")


@case(
    ("uniform", "implicit"),
    bodies_of_a_micrometre=1e-6,
    bodies_of_a_millimetre=1e-3,
    bodies_of_a_hundred_metres=100.0,
    bodies_of_a_kilometre=1e3,
)
def eases_at_scale(trial, edge):
    """Bodies of {0:g} m ease as those of 50 mm.

    A pair is opened by 1e-3 of its limit. The rate of the dashpots grows as 1 / edge, that of the
    springs as its root.
    """
    area, mass = AREA * (edge / EDGE) ** 2, MASS * (edge / EDGE) ** 3
    k, c = area * CONCRETE.normal_stiffness, area * CONCRETE.normal_damping
    # Shear units turn the bodies 20 times as fast as they part.
    dt = min(0.5 * mass / c, (0.5 * mass / k) ** 0.5) / 200.0
    opening = 1e-3 * CONCRETE.onset_opening
    methods = {"uniform": Uniform(dt), "implicit": ImplicitDashpots(dt, refresh=1e6)}
    run = Run(trial, pair(edge), 1000 * dt, methods=methods, shift=apart(opening))
    run.eases(opening, area)


@case(TOUCHING)
def fragment_a_thousand_km_away(trial):
    """A pair eases as if alone while the same scene holds a fragment 1000 km away."""
    far = placed_together({"pair": (pair(), np.zeros(3)), "far": (single(), 1e6 * X)})
    both = ((pair(), apart(5e-6)), (far, apart(5e-6, others=1)))
    runs = [Run(trial, mesh, shift=shift, bodies=slice(2)) for mesh, shift in both]
    difference = abs(runs[0].moved - runs[1].moved)
    trial.limit("difference [m]", difference, 1e-18, "same bits, or a sum in another order")


@case(TOUCHING)
def all_bonds_break_at_once(trial):
    """A block whose bodies fly apart at up to 2 km/s: every bond fails in the first steps."""
    mesh = bar(0.1, 0.1, (1, 1, 1))
    centre = mesh.points[mesh.tetrahedra].mean(axis=1)
    run = Run(trial, mesh, 2e-6, velocity=4e4 * (centre - centre.mean(axis=0)))
    held = run.result.model.bond_count - run.broken
    trial.limit("bonds that held", held, 0.0, "all open at 100 m/s at least")
    run.nothing_made()


@case(TOUCHING)
def bond_exactly_at_its_limit(trial):
    """A pair opened exactly to the onset of softening gives back all of its strain, undamaged."""
    opening = CONCRETE.onset_opening
    run = Run(trial, pair(), shift=apart(opening))
    run.momentum_kept()
    trial.limit("bonds broken", run.broken, 0.0, "at the onset nothing is lost")
    softened = run.result.report.energy_balance["softening"]
    strain = 0.5 * CONCRETE.normal_stiffness * opening**2 * AREA
    # The place is rounded to an ulp of the body's size, and the opening with it.
    bound = 4.0 * np.spacing(0.05) / opening
    trial.limit("softening / strain", abs(softened) / strain, bound, "4 ulp(size) / opening")


@case(TOUCHING)
def bond_open_beyond_failure(trial):
    """A pair that begins beyond its failure opening lets go in the first step and rests."""
    run = Run(trial, pair(), 1e-6, shift=apart(1.5 * CONCRETE.failure_opening))
    trial.limit("bonds that held", 1 - run.broken, 0.0, "beyond failure at the start")
    fastest = (AREA * CONCRETE.fracture_energy / run.mass[0]) ** 0.5
    speed = abs(run["velocity"]).max() / fastest
    trial.limit("speed / that of all of G_f", speed, 1.0, "(A G_f / m)^0.5")


@case(TOUCHING)
def three_units_fail_at_once(trial):
    """A pair torn straight apart fails at its three units at once: it gets no spin."""
    run = Run(trial, pair(), velocity=[-100.0 * X, 100.0 * X])
    trial.limit("bonds that held", 1 - run.broken, 0.0, "v m / (2 c A) > 30 um")
    turned = abs(run["spin"]).max() * EDGE / 200.0
    trial.limit("spin x size / speed", turned, 1e-9, "symmetry, to rounding of the places")


@case(("implicit", "multirate_held"))
def points_renumbered(trial):
    """The same bodies with their points numbered backwards move with the same bits."""
    mesh = pair()
    other = checked_mesh(mesh.points[::-1], mesh.point_count - 1 - mesh.tetrahedra, {})
    runs = [Run(trial, one, shift=apart(5e-6)) for one in (mesh, other)]
    trial.limit("difference [m]", abs(runs[0].moved - runs[1].moved), 0.0, "same bits")


@case(FREE)
def sizes_of_1_to_1000(trial):
    """Bodies of 1 mm and 1 m fly side by side, each straight."""
    mesh = placed_together({"small": (single(1e-3), -2.0 * X), "large": (single(1.0), 0.0 * X)})
    run = free(trial, mesh, velocity=np.array([[3.0, 2.0, 1.0], [-3.0, 2.0, -1.0]]))
    run.flies_straight(1.0, "n steps x eps x place")
